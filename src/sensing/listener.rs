//! What one relay has heard: the place where it is, averaged, and the places before it, faded.
//!
//! Measurements are averaged and fade with time.

use super::sums::Sums;
use super::terms::{Terms, terms};
use crate::place::Placement;
use crate::sir::square;
use crate::time::{Duration, Instant};

/// A place is another one from this part of the distance on.
const APART: f32 = 1.0 / 200.0;

/// Measurements of one relay. 120 bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Listener {
    half_life: Duration,
    past: Sums,
    faded: Instant,
    /// Where the relay is, and what is heard there, in units that the listener is told.
    at: Placement,
    heard: Average,
}

/// What a listener makes of its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) terms: Terms,
    /// v of what is heard there.
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

    /// Interference of `heard` was measured at `at`, above 0; `expected` tells the v that is believed at terms.
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

    /// What it hears where it is.
    pub(crate) fn place(&self, distance_m: f32) -> Option<Place> {
        (self.heard.mean > 0.0).then(|| Place {
            terms: terms(distance_m, self.at),
            v: 1.0 / self.heard.mean,
        })
    }

    /// All that it has heard, as of `now`.
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

    /// What was heard elsewhere is nothing to go by.
    pub(crate) const fn forget_past(&mut self) {
        self.past = Sums::NONE;
    }
}

/// Which share of something that old is left.
pub(crate) fn left(age: Duration, half_life: Duration) -> f32 {
    libm::exp2f(-(age.as_micros() as f32 / half_life.as_micros() as f32))
}

/// The mean of what was measured, in which what is a half-life older counts half.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Average {
    /// The mean; 0 of nothing.
    pub(crate) mean: f32,
    /// How many measurements are left in it.
    pub(crate) weight: f32,
    /// When the last one was.
    pub(crate) last: Instant,
    /// How much older they are on average than that, s.
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
