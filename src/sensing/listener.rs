//! Measurements of one relay. The average at its current position, and faded sums of the earlier positions.

use super::sums::{Sums, Terms, terms};
use crate::place::Placement;
use crate::sir::square;
use crate::time::{Duration, Instant};

/// Distance from which on a position is another one, as a fraction of D.
const APART: f32 = 1.0 / 200.0;

/// Measurements of one relay. 120 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listener {
    half_life: Duration,
    past: Sums,
    faded: Instant,
    /// Current position of the relay, and the average there, in units of `UNIT_W`.
    at: Placement,
    heard: Average,
}

/// Current position of a listener and its measurement.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) terms: Terms,
    pub(crate) v: f32,
}

impl Listener {
    pub(crate) const fn new(half_life: Duration, now: Instant) -> Self {
        Self {
            half_life,
            past: Sums::NONE,
            faded: now,
            at: Placement::on_line(0.0, 0.0),
            heard: Average::NONE,
        }
    }

    pub(crate) const fn half_life(&self) -> Duration {
        self.half_life
    }

    /// Adds a measurement `heard` above 0 at `at`; `expected` returns v of the estimate by terms.
    pub(crate) fn take(
        &mut self,
        now: Instant,
        distance_m: f32,
        at: Placement,
        heard: f32,
        expected: impl Fn(&Terms) -> Option<f32>,
    ) {
        let off = square(at.x_m - self.at.x_m)
            + square(at.y_m - self.at.y_m)
            + square(at.altitude_m - self.at.altitude_m);
        if !(off <= square(APART * distance_m)) {
            self.past = self.sums(now, distance_m, expected);
            self.faded = now;
            self.at = at;
            self.heard = Average::NONE;
        }
        self.heard.take(now, self.half_life, heard);
        let share = 1.0 / self.heard.weight;
        self.at.x_m += (at.x_m - self.at.x_m) * share;
        self.at.y_m += (at.y_m - self.at.y_m) * share;
        self.at.altitude_m += (at.altitude_m - self.at.altitude_m) * share;
    }

    pub(crate) fn place(&self, distance_m: f32) -> Option<Place> {
        (self.heard.mean > 0.0).then(|| Place {
            terms: terms(distance_m, self.at),
            v: 1.0 / self.heard.mean,
        })
    }

    /// Returns the sums of all measurements as of `now`.
    pub(crate) fn sums(
        &self,
        now: Instant,
        distance_m: f32,
        expected: impl Fn(&Terms) -> Option<f32>,
    ) -> Sums {
        let mut sums = self.past;
        self.fade(&mut sums, now.since(self.faded));
        if let Some(place) = self.place(distance_m) {
            let mut own = Sums::NONE;
            let expected = expected(&place.terms).unwrap_or(place.v);
            own.add(&place.terms, place.v, expected, 1.0, self.heard.weight);
            own.fade(1.0, self.heard.behind_s);
            self.fade(&mut own, now.since(self.heard.last));
            sums.merge(&own);
        }
        sums
    }

    fn fade(&self, sums: &mut Sums, age: Duration) {
        let seconds = age.as_micros() as f32 * 1e-6;
        sums.fade(left(age, self.half_life), seconds);
    }

    /// Discards the measurements at earlier positions.
    pub(crate) const fn forget_past(&mut self) {
        self.past = Sums::NONE;
    }
}

/// Returns the fraction that remains after `age`.
pub(crate) fn left(age: Duration, half_life: Duration) -> f32 {
    libm::exp2f(-(age.as_micros() as f32 / half_life.as_micros() as f32))
}

/// Exponentially weighted mean of measurements, with a half-life.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Average {
    /// Mean; 0 without a measurement.
    pub(crate) mean: f32,
    pub(crate) weight: f32,
    pub(crate) last: Instant,
    /// Mean age of the measurements at `last`, s.
    pub(crate) behind_s: f32,
}

impl Average {
    pub(crate) const NONE: Self = Self {
        mean: 0.0,
        weight: 0.0,
        last: Instant::ZERO,
        behind_s: 0.0,
    };

    pub(crate) fn take(&mut self, now: Instant, half_life: Duration, value: f32) {
        let age = now.since(self.last);
        let before = self.weight * left(age, half_life);
        self.weight = before + 1.0;
        let seconds = age.as_micros() as f32 * 1e-6;
        self.behind_s = (self.behind_s + seconds) * before / self.weight;
        self.mean += (value - self.mean) / self.weight;
        self.last = now;
    }
}
