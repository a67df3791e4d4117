//! Reachable interval: the x at which the relay may be between its last report and its setpoints.
//!
//! A relay that is told to turn flies on for a while, but never beyond its earlier setpoints, where it could have stopped. So it
//! may be anywhere between its reported x and all setpoints within the [`lag`](GuardConfig::lag) before that report.

use crate::time::Instant;

use super::config::GuardConfig;

#[derive(Clone, Copy, PartialEq, Debug)]
struct Span {
    low_m: f32,
    high_m: f32,
}

impl Span {
    const fn at(x_m: f32) -> Self {
        Self {
            low_m: x_m,
            high_m: x_m,
        }
    }

    fn and(self, other: Self) -> Self {
        Self {
            low_m: self.low_m.min(other.low_m),
            high_m: self.high_m.max(other.high_m),
        }
    }
}

/// Reachable interval of the relay, m along x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ReachableInterval {
    pub(super) at_m: f32,
    pub(super) low_m: f32,
    pub(super) high_m: f32,
    /// Time of the last change of the setpoint.
    changed: Instant,
    /// Span of all setpoints since `since`.
    late: Span,
    since: Instant,
    /// Span of earlier setpoints that may still have had an effect at the last report.
    before: Span,
    reported: Instant,
    /// True once a report shows the effect of the first setpoint.
    known: bool,
}

impl ReachableInterval {
    /// Returns the interval before the first setpoint.
    pub(super) const fn unknown(now: Instant) -> Self {
        Self::at(0.0, now)
    }

    /// Returns the interval for the first setpoint. Until it takes effect, the relay may be on its way to an earlier one.
    pub(super) const fn at(x_m: f32, now: Instant) -> Self {
        Self {
            at_m: x_m,
            low_m: x_m,
            high_m: x_m,
            changed: now,
            late: Span::at(x_m),
            since: now,
            before: Span::at(x_m),
            reported: now,
            known: false,
        }
    }

    fn is(&mut self, span: Span) {
        (self.low_m, self.high_m) = (span.low_m, span.high_m);
    }

    const fn span(&self) -> Span {
        Span {
            low_m: self.low_m,
            high_m: self.high_m,
        }
    }

    /// Takes a new setpoint: the relay may first fly on toward the last one, and then turn.
    pub(super) fn go(&mut self, x_m: f32, now: Instant) {
        if (x_m - self.at_m).abs() > 0.0 {
            self.at_m = x_m;
            self.changed = now;
            self.late = self.late.and(Span::at(x_m));
            self.is(self.span().and(Span::at(x_m)));
        }
    }

    /// Takes a report of time `at`: the relay is between there and its recent setpoints.
    pub(super) fn report(&mut self, at: Instant, x_m: f32, config: &GuardConfig) {
        let hovers = (x_m - self.at_m).abs() <= config.hover_m + config.rounding();
        let here = Span::at(if hovers { self.at_m } else { x_m });
        if at >= self.since + config.lag {
            self.known = true;
            self.before = self.late;
            self.late = Span::at(self.at_m);
            self.since = self.changed;
        }
        if at >= self.changed + config.lag {
            self.before = self.late;
        }
        if self.known && at >= self.reported {
            self.reported = at;
            self.is(self.before.and(self.late).and(here));
        } else {
            self.is(self.span().and(here));
        }
    }

    pub(super) const fn is_known(&self) -> bool {
        self.known
    }

    /// Returns true if the relay has arrived at its setpoint.
    pub(super) fn is_still(&self) -> bool {
        self.known && self.high_m <= self.low_m
    }
}
