//! Nodes on one side of a relay: recently received nodes, consecutive events, and pending hellos.

use crate::event::NodeEvent;
use crate::settings::Settings;
use crate::time::{Duration, Instant};

pub(crate) use crate::wire::CANDIDATES;

/// Minimum interval between two reports to the firmware about one refused node.
const MINUTE: Duration = Duration::from_millis(60_000);

/// Count of successive events of one kind, for each of the four nearest nodes. An event is, for example, a handshake of
/// the node that is signed with a wrong key.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConsecutiveCounts([u8; CANDIDATES as usize]);

impl ConsecutiveCounts {
    pub(super) const NONE: Self = Self([0; CANDIDATES as usize]);

    /// Counts an event of the node `distance` relays away; sets its count to 0 if `occurred` is false. Returns true
    /// when the count has just become `most`.
    pub(super) fn count(&mut self, distance: u16, occurred: bool, most: u8) -> bool {
        let at = usize::from(distance).wrapping_sub(1);
        let Some(times) = self.0.get_mut(at) else {
            return false;
        };
        if !occurred {
            *times = 0;
            return false;
        }
        let reached = *times + 1 == most;
        *times = times.saturating_add(1).min(most);
        reached
    }

    /// Returns true if the last `most` checks of the node `distance` relays away all found an event.
    pub(super) fn has(self, distance: u16, most: u8) -> bool {
        let times = self.0.get(usize::from(distance).wrapping_sub(1));
        times.is_some_and(|times| *times >= most)
    }
}

/// Bit mask whose bits expire: each remains set for one to two periods after it was last set.
#[derive(Clone, Copy, Debug)]
struct RecentBits {
    /// Start of the current period.
    since: Instant,
    /// Bits that were set in the current period.
    current: u16,
    /// Bits that were set in the previous period.
    previous: u16,
}

impl RecentBits {
    const fn new(now: Instant) -> Self {
        Self {
            since: now,
            current: 0,
            previous: 0,
        }
    }

    /// Sets `bits` at `now`. Returns true if any of them was not yet set in the current period.
    fn set(&mut self, bits: u16, now: Instant, period: Duration) -> bool {
        self.expire(now, period);
        let new = bits & !self.current;
        self.current |= new;
        new != 0
    }

    const fn clear(&mut self, bits: u16) {
        self.current &= !bits;
        self.previous &= !bits;
    }

    fn get(mut self, now: Instant, period: Duration) -> u16 {
        self.expire(now, period);
        self.current | self.previous
    }

    fn expire(&mut self, now: Instant, period: Duration) {
        let span = now.since(self.since);
        if span >= period {
            let is_old = span >= period.times(2);
            self.previous = if is_old { 0 } else { self.current };
            (self.current, self.since) = (0, now);
        }
    }
}

/// Set of recently received nodes on one side of the relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hearing(RecentBits);

impl Hearing {
    pub(super) const fn new(now: Instant) -> Self {
        Self(RecentBits::new(now))
    }

    pub(super) fn add(&mut self, distance: u16, now: Instant, settings: &Settings) {
        let bit = u16::from(mask(distance));
        self.0.set(bit, now, settings.probe_after);
    }

    /// Returns a bit mask of the recently received nodes; bit 0 is the nearest node. A node stays in the mask for one
    /// to two times `probe_after` after its last frame.
    pub(super) fn recent(self, now: Instant, settings: &Settings) -> u8 {
        let [nodes, _] = self.0.get(now, settings.probe_after).to_le_bytes();
        nodes
    }
}

/// Nodes on one side of the relay that recently used a wrong mission, an old epoch or a wrong key.
///
/// Bits 0 to 3 stand for nodes with a wrong mission, bits 4 to 7 for nodes with an old epoch, bits 8 to 11 for nodes
/// with a wrong key; the nearest node is first. Bits 12 to 14 stand for a ground station farther away, in the same
/// order of the reasons. A bit remains set for one to two minutes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refusals(RecentBits);

impl Refusals {
    pub(super) const NONE: Self = Self(RecentBits::new(Instant::ZERO));

    /// Records a wrong mission, an old epoch or a wrong key of the node `distance` relays away.
    ///
    /// Returns true at most once a minute for each node and reason.
    pub(crate) fn add(&mut self, reason: NodeEvent, distance: u16, now: Instant) -> bool {
        let reason = match reason {
            NodeEvent::Mission => 0,
            NodeEvent::Epoch => 1,
            _ => 2,
        };
        self.0.set(Self::bit(reason, distance), now, MINUTE)
    }

    /// Records that the node `distance` relays away uses this relay's key and a new epoch.
    pub(super) fn remove_signer(&mut self, distance: u16) {
        self.0
            .clear(Self::bit(1, distance) | Self::bit(2, distance));
    }

    /// Returns the bit of the node `distance` relays away, for a reason: 0 mission, 1 epoch, 2 key.
    const fn bit(reason: u16, distance: u16) -> u16 {
        match mask(distance) {
            0 => 0x1000 << reason,
            near => (near as u16) << (CANDIDATES * reason),
        }
    }

    /// Returns the distances of the nearest nodes that are refused; 0 for none.
    ///
    /// The values are for a wrong mission, an old epoch, and a wrong key, in this order. Nodes `end` or more relays
    /// away are left out.
    pub(crate) fn nearest(self, now: Instant, end: u16) -> [u16; 3] {
        let nodes = self.0.get(now, MINUTE);
        [0, CANDIDATES, 2 * CANDIDATES].map(|first| {
            let nodes = nodes >> first & 0x0F;
            #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
            let distance = nodes.trailing_zeros() as u16 + 1;
            if nodes == 0 || distance >= end {
                0
            } else {
                distance
            }
        })
    }
}

/// Returns the bit of the node `distance` relays away in a bit mask. The result is 0 for a node that is not one of the
/// four nearest.
pub(crate) const fn mask(distance: u16) -> u8 {
    if distance >= 1 && distance <= CANDIDATES {
        1 << (distance - 1)
    } else {
        0
    }
}

/// Pending hellos to the four nearest nodes on one side of the relay, as bit masks. Bit 0 is the nearest node.
///
/// One mask has all pending hellos, the other mask those that request an answer.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Hellos {
    due: u8,
    reply: u8,
}

impl Hellos {
    pub(super) const NONE: Self = Self { due: 0, reply: 0 };

    /// Schedules a hello to the node `distance` relays away. If `ask` is true, the hello requests an answer.
    pub(super) const fn schedule(&mut self, distance: u16, ask: bool) {
        let bit = mask(distance);
        self.due |= bit;
        if ask {
            self.reply |= bit;
        }
    }

    /// Schedules hellos that request an answer, to the four nearest nodes on this side of the relay.
    pub(super) const fn schedule_all(&mut self) {
        self.due = 0x0F;
        self.reply = 0x0F;
    }

    /// Returns the distance of the nearest node with a pending hello, and marks the hello as sent. The distance is in
    /// relays. The second value is true if the hello requests an answer. `None` if no hello is pending.
    pub(super) fn poll(&mut self) -> Option<(u16, bool)> {
        let distance = (1..=CANDIDATES).find(|distance| self.due & mask(*distance) != 0)?;
        let bit = mask(distance);
        self.due &= !bit;
        let ask = self.reply & bit != 0;
        self.reply &= !bit;
        Some((distance, ask))
    }
}
