//! What a pilot does: has the drone take off, hands it over, takes it, gives it back.

use uav_relay::Instant;

use super::spec::Takeover;
use crate::simulator::drones::Point;

/// Drones take off one after the other.
const FIRST_S: u64 = 5;
const NEXT_MS: u64 = 500;

/// So long after the climb a pilot chooses the mode of a companion, and so long after the autopilot was switched off and on.
const LOOKS_S: u64 = 2;
const RECOVERS_S: u64 = 10;

/// Who flies.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    /// The pilot.
    Sticks,
    /// The autopilot by itself: it hovers.
    Hold,
    /// The relay.
    Companion,
}

/// The pilot of one drone.
#[derive(Clone, Debug)]
pub(super) struct Pilot {
    arms_at: Instant,
    /// When to hand it over, once that is known.
    hands_over_at: Option<Instant>,
    takeovers: Vec<Takeover>,
}

impl Pilot {
    /// Of the drone of that index, from 0.
    pub(super) fn new(index: usize, all: &[Takeover]) -> Self {
        let later = u64::try_from(index).unwrap_or(0) * NEXT_MS;
        let own = |takeover: &&Takeover| usize::from(takeover.relay) == index + 1;
        Self {
            arms_at: Instant::from_millis(1_000 * FIRST_S + later),
            hands_over_at: None,
            takeovers: all.iter().filter(own).copied().collect(),
        }
    }

    pub(super) fn has_armed(&self, now: Instant) -> bool {
        now >= self.arms_at
    }

    /// The drone hovers where it climbed to.
    pub(super) fn is_up(&mut self, now: Instant) {
        // Not earlier where the autopilot was switched off and on during the climb.
        let looked = now + uav_relay::Duration::from_millis(1_000 * LOOKS_S);
        self.hands_over_at = self.hands_over_at.max(Some(looked));
    }

    /// The autopilot was switched off and on.
    pub(super) fn has_seen_a_restart(&mut self, now: Instant) {
        self.hands_over_at = Some(now + uav_relay::Duration::from_millis(1_000 * RECOVERS_S));
    }

    /// The mode that the pilot chooses now, if any. A drone that flies, or that another one flies past, is not handed over.
    pub(super) fn chooses(&mut self, now: Instant, may_hand_over: bool) -> Option<Mode> {
        if self.has_sticks(now) {
            // It is handed over once more afterwards.
            self.hands_over_at = Some(now);
            return Some(Mode::Sticks);
        }
        if may_hand_over && self.hands_over_at.is_some_and(|at| at <= now) {
            self.hands_over_at = None;
            return Some(Mode::Companion);
        }
        None
    }

    /// Place to which the pilot who has the sticks flies it, if that is any.
    pub(super) fn flies_to(&self, now: Instant) -> Option<Point> {
        let during = |it: &&Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().find(during)?.to
    }

    /// The autopilot has refused the mode.
    pub(super) fn tries_again(&mut self, now: Instant) {
        self.hands_over_at = Some(now + uav_relay::Duration::from_millis(1_000 * LOOKS_S));
    }

    pub(super) fn has_sticks(&self, now: Instant) -> bool {
        let during = |it: &Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().any(during)
    }
}
