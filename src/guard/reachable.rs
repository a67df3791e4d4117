//! Where the relay may be along x: on its way between where it was reported and what it was told to fly to.

use crate::time::Instant;

use super::config::GuardConfig;

/// The relay's own stretch, m along x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ReachableInterval {
    /// The setpoint.
    pub(super) at_m: f32,
    /// The low end.
    pub(super) low_m: f32,
    /// The high end.
    pub(super) high_m: f32,
    /// Since when the setpoint is what it is.
    since: Instant,
    /// Whether a report has come that the first setpoint had its effect on.
    known: bool,
}

impl ReachableInterval {
    /// Before the first setpoint.
    pub(super) const fn unknown(now: Instant) -> Self {
        Self::at(0.0, now)
    }

    /// The first setpoint. Until it is in effect, the relay may be on its way to another one of before the start.
    pub(super) const fn at(x_m: f32, now: Instant) -> Self {
        Self {
            at_m: x_m,
            low_m: x_m,
            high_m: x_m,
            since: now,
            known: false,
        }
    }

    /// A new setpoint: the relay may go on to the last one for a while, and then turns here.
    pub(super) fn go(&mut self, x_m: f32, now: Instant) {
        if (x_m - self.at_m).abs() > 0.0 {
            self.at_m = x_m;
            self.low_m = self.low_m.min(x_m);
            self.high_m = self.high_m.max(x_m);
            self.since = now;
        }
    }

    /// A report of time `at`. If the flight controller had the present setpoint by then, the relay is between here and there.
    pub(super) fn report(&mut self, at: Instant, x_m: f32, config: &GuardConfig) {
        let hovers = (x_m - self.at_m).abs() <= config.hover_m + config.rounding();
        let x_m = if hovers { self.at_m } else { x_m };
        if at >= self.since + config.lag {
            self.known = true;
            self.low_m = self.at_m;
            self.high_m = self.at_m;
        }
        self.low_m = self.low_m.min(x_m);
        self.high_m = self.high_m.max(x_m);
    }

    /// Whether anything can be promised.
    pub(super) const fn is_known(&self) -> bool {
        self.known
    }

    /// Whether the relay has arrived at its setpoint.
    pub(super) fn is_still(&self) -> bool {
        self.known && self.high_m <= self.low_m
    }
}
