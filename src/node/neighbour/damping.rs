//! Links that come and go: how long a node is to be heard before it is taken.

use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Doublings of the hold-down.
const DOUBLINGS: u8 = 4;

/// Losses after which a link is not one that comes and goes yet.
const FORGIVEN: u8 = 3;

/// After so many times `dead_after` without another, a loss is forgotten.
const MEMORY: u32 = 32;

/// A node that may be taken once it has been heard for long enough.
#[derive(Clone, Copy, Debug)]
struct HoldDown {
    node: u16,
    since: Instant,
    heard: Instant,
}

/// What is remembered of the links on one side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Damping {
    hold_down: Option<HoldDown>,
    /// The node that was lost last, and when.
    lost: u16,
    lost_at: Instant,
    losses: u8,
}

impl Damping {
    pub(super) const fn new(now: Instant) -> Self {
        Self {
            hold_down: None,
            lost: 0,
            lost_at: now,
            losses: 0,
        }
    }

    /// Node `node` is lost: one more of a link that comes and goes, or the first one for long. Where many frames are lost it is the channel
    /// that comes and goes, and the loss does not count.
    pub(super) fn lose(&mut self, node: u16, counts: bool, now: Instant, settings: &Settings) {
        let long = now.since(self.lost_at) >= settings.dead_after.times(MEMORY);
        let before = if long { 0 } else { self.losses };
        self.losses = before.saturating_add(u8::from(counts));
        self.lost = node;
        self.lost_at = now;
    }

    /// Whether its link comes and goes.
    pub(super) const fn flaps(&self, node: u16) -> bool {
        node == self.lost && self.losses > FORGIVEN
    }

    /// Nobody is in a hold-down any more.
    pub(super) const fn clear(&mut self) {
        self.hold_down = None;
    }

    /// Whether a node that is heard now has been for the whole of its hold-down.
    pub(super) fn passes(
        &mut self,
        node: u16,
        more: Duration,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        let since = match self.hold_down {
            Some(known) if known.node == node && now.since(known.heard) <= settings.dead_after => {
                known.since
            }
            _ => now,
        };
        self.hold_down = Some(HoldDown {
            node,
            since,
            heard: now,
        });
        let hold_down = match self.losses.checked_sub(FORGIVEN + 1) {
            None => settings.probe_after,
            Some(more) => settings.dead_after.times(1 << more.min(DOUBLINGS)),
        };
        now.since(since) >= hold_down.max(more)
    }
}
