//! Where the relay may be along x: on its way between where it was reported and what it was told to fly to.
//!
//! A relay that is told to turn flies on for a while, but never beyond what it was told before: there it could have stopped. So it may
//! be anywhere between where it was reported and all the setpoints of the [`lag`](GuardConfig::lag) before that report.

use crate::time::Instant;

use super::config::GuardConfig;

/// From one x to another one, m.
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

/// The relay's own stretch, m along x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct ReachableInterval {
    /// The setpoint.
    pub(super) at_m: f32,
    /// The low end.
    pub(super) low_m: f32,
    /// The high end.
    pub(super) high_m: f32,
    /// When the setpoint became what it is.
    changed: Instant,
    /// All setpoints since then, and since when.
    late: Span,
    since: Instant,
    /// Those before that may still have had an effect at the last report.
    before: Span,
    /// Of when that was.
    reported: Instant,
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

    /// A new setpoint: the relay may go on to the last one for a while, and then turns here.
    pub(super) fn go(&mut self, x_m: f32, now: Instant) {
        if (x_m - self.at_m).abs() > 0.0 {
            self.at_m = x_m;
            self.changed = now;
            self.late = self.late.and(Span::at(x_m));
            self.is(self.span().and(Span::at(x_m)));
        }
    }

    /// A report of time `at`: the relay is between here and what it was told of late.
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

    /// Whether anything can be promised.
    pub(super) const fn is_known(&self) -> bool {
        self.known
    }

    /// Whether the relay has arrived at its setpoint.
    pub(super) fn is_still(&self) -> bool {
        self.known && self.high_m <= self.low_m
    }
}
