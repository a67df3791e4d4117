//! Links that come and go: how long a node is to be heard before it is taken, and before it is said to be heard.
//!
//! A link that was lost more often than is forgiven is held down: it is as if nothing came over it, until its node has been heard all through
//! a time that is twice as long after every other loss, up to six times `dead_after`. The hellos of this relay say so, so that nobody
//! makes room for a node that could not be linked.

use super::hearing::mask;
use crate::settings::Settings;
use crate::time::{Duration, Instant};

/// Doublings of the hold-down, and the longest one in `dead_after`.
const DOUBLINGS: u8 = 3;
const LONGEST: u32 = 6;

/// Losses after which a link is not one that comes and goes yet.
const FORGIVEN: u8 = 2;

/// Least time from one loss of a link to the next, in `dead_after`, if the link comes and goes slowly.
const SLOW: u32 = 10;

/// After so many times `dead_after` without another, a loss is forgotten.
const MEMORY: u32 = 32;

/// A node that was heard again and again.
#[derive(Clone, Copy, Debug)]
struct Heard {
    distance: u16,
    since: Instant,
    last: Instant,
}

impl Heard {
    /// Since when the node `distance` places away has been heard all through, as it is now.
    fn again(known: Option<Self>, distance: u16, now: Instant, settings: &Settings) -> Self {
        let since = match known {
            Some(known)
                if known.distance == distance && now.since(known.last) <= settings.dead_after =>
            {
                known.since
            }
            _ => now,
        };
        Self {
            distance,
            since,
            last: now,
        }
    }
}

/// A link that was lost.
#[derive(Clone, Copy, Debug)]
struct Loss {
    /// How far away its node is, 0 for none.
    distance: u16,
    at: Instant,
    /// Since when the node is back.
    back: Option<Heard>,
    losses: u8,
    /// Time since the loss before.
    apart: Duration,
}

impl Loss {
    /// Number of losses that are not forgotten yet.
    fn recent(&self, now: Instant, settings: &Settings) -> u8 {
        if self.distance == 0 || now.since(self.at) >= settings.dead_after.times(MEMORY) {
            0
        } else {
            self.losses
        }
    }

    /// Returns true if the link is held down.
    fn holds(&self, now: Instant, settings: &Settings) -> bool {
        let Some(more) = self.losses.checked_sub(FORGIVEN + 1) else {
            return false;
        };
        let times = (1 << more.min(DOUBLINGS)).min(LONGEST);
        let span = settings.dead_after.times(times);
        self.back.is_none_or(|back| now.since(back.since) < span)
    }
}

/// What is remembered of the links on one side: the last two that were lost.
#[derive(Clone, Copy, Debug)]
pub(super) struct Damping {
    /// A node that may be taken once it has been heard for long enough.
    candidate: Option<Heard>,
    last: Loss,
    before: Loss,
}

impl Damping {
    pub(super) const fn new(now: Instant) -> Self {
        let none = Loss {
            distance: 0,
            at: now,
            back: None,
            losses: 0,
            apart: Duration::from_micros(0),
        };
        Self {
            candidate: None,
            last: none,
            before: none,
        }
    }

    /// The node `distance` places away is lost: one more of a link that comes and goes, or the first one for long. Where many frames are
    /// lost it is the channel that comes and goes, and the loss does not count, unless the link has come and gone before.
    ///
    /// Where another link on this side is one that comes and goes, so is this one: both lead across the same gap.
    pub(super) fn lose(&mut self, distance: u16, counts: bool, now: Instant, settings: &Settings) {
        if distance != self.last.distance {
            core::mem::swap(&mut self.last, &mut self.before);
        }
        let other = self.before.recent(now, settings);
        let (own, apart) = if distance == self.last.distance {
            (self.last.recent(now, settings), now.since(self.last.at))
        } else {
            (0, Duration::from_micros(0))
        };
        let known = if other > FORGIVEN {
            own.max(other)
        } else {
            own
        };
        let counts = counts || known > FORGIVEN;
        self.last = Loss {
            distance,
            at: now,
            back: None,
            losses: known.saturating_add(u8::from(counts)),
            apart,
        };
    }

    /// A frame has come from the node `distance` places away.
    pub(super) fn hear(&mut self, distance: u16, now: Instant, settings: &Settings) {
        for lost in [&mut self.last, &mut self.before] {
            if distance == lost.distance {
                lost.back = Some(Heard::again(lost.back, distance, now, settings));
            }
        }
    }

    /// Whether the link to the node `distance` places away is held down.
    pub(super) fn holds(&self, distance: u16, now: Instant, settings: &Settings) -> bool {
        let links = [&self.last, &self.before];
        let mut held = links.iter().filter(|lost| lost.distance == distance);
        held.any(|lost| lost.holds(now, settings))
    }

    /// Returns true if a link on this side comes and goes slowly: it has been lost more often than is forgiven, and stays for long each time,
    /// so that it is worth to notice early when it is lost again.
    pub(super) fn is_slow(&self, now: Instant, settings: &Settings) -> bool {
        let slow = settings.dead_after.times(SLOW);
        let is_slow = |lost: &Loss| lost.recent(now, settings) > FORGIVEN && lost.apart >= slow;
        is_slow(&self.last) || is_slow(&self.before)
    }

    /// The nodes whose links are held down: bit 0 is the nearest one.
    pub(super) fn held(&self, now: Instant, settings: &Settings) -> u8 {
        [&self.last, &self.before]
            .iter()
            .filter(|lost| lost.holds(now, settings))
            .fold(0, |held, lost| held | mask(lost.distance))
    }

    /// No candidate is heard any more.
    pub(super) const fn clear(&mut self) {
        self.candidate = None;
    }

    /// Whether a candidate that is heard now has been for `probe_after`, or for `more`.
    pub(super) fn passes(
        &mut self,
        distance: u16,
        more: Duration,
        now: Instant,
        settings: &Settings,
    ) -> bool {
        // Of two that are heard in turn the nearer one counts: else neither would be heard all through.
        if let Some(known) = self.candidate
            && known.distance < distance
            && now.since(known.last) <= settings.dead_after
        {
            return false;
        }
        let heard = Heard::again(self.candidate, distance, now, settings);
        self.candidate = Some(heard);
        now.since(heard.since) >= settings.probe_after.max(more)
    }
}
