//! Pilot of a drone: take-off, hand-over to the relay, takeover.

use uav_relay::Instant;

use super::spec::Takeover;
use crate::simulator::drones::Point;

/// Take-off time of the first drone, and interval between drones.
const FIRST_S: u64 = 5;
const NEXT_MS: u64 = 500;

/// Delay of the hand-over after the climb, and after a restart of the autopilot.
const LOOKS_S: u64 = 2;
const RECOVERS_S: u64 = 10;

/// Flight mode.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Mode {
    /// Pilot control.
    Sticks,
    /// Hover, controlled by the autopilot alone.
    Hold,
    /// Control by the relay's setpoint.
    Companion,
}

#[derive(Clone, Debug)]
pub(super) struct Pilot {
    arms_at: Instant,
    /// Time of the next hand-over, once known.
    hands_over_at: Option<Instant>,
    takeovers: Vec<Takeover>,
}

impl Pilot {
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

    /// Handles the end of the climb.
    pub(super) fn is_up(&mut self, now: Instant) {
        // Keep a later hand-over time: the autopilot may have restarted during the climb.
        let looked = now + uav_relay::Duration::from_millis(1_000 * LOOKS_S);
        self.hands_over_at = self.hands_over_at.max(Some(looked));
    }

    /// Handles a restart of the autopilot.
    pub(super) fn has_seen_a_restart(&mut self, now: Instant) {
        self.hands_over_at = Some(now + uav_relay::Duration::from_millis(1_000 * RECOVERS_S));
    }

    /// Returns the mode that the pilot selects now, if any. `may_hand_over` is false while the drone moves or traffic is near.
    pub(super) fn chooses(&mut self, now: Instant, may_hand_over: bool) -> Option<Mode> {
        if self.has_sticks(now) {
            // Schedule a hand-over after the takeover.
            self.hands_over_at = Some(now);
            return Some(Mode::Sticks);
        }
        if may_hand_over && self.hands_over_at.is_some_and(|at| at <= now) {
            self.hands_over_at = None;
            return Some(Mode::Companion);
        }
        None
    }

    /// Returns the position to which the pilot flies the drone during a takeover, if any.
    pub(super) fn flies_to(&self, now: Instant) -> Option<Point> {
        let during = |it: &&Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().find(during)?.to
    }

    /// Schedules another attempt after the autopilot rejected the mode.
    pub(super) fn tries_again(&mut self, now: Instant) {
        self.hands_over_at = Some(now + uav_relay::Duration::from_millis(1_000 * LOOKS_S));
    }

    pub(super) fn has_sticks(&self, now: Instant) -> bool {
        let during = |it: &Takeover| now >= it.from && it.until.is_none_or(|until| now < until);
        self.takeovers.iter().any(during)
    }
}
