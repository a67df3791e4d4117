//! Track of a moving interferer: its velocity, and its predicted position.
//!
//! There is a Kalman filter of position and velocity for each axis; the velocity is a random walk. A fit refers to the mean time
//! of its measurements. Two successive fits share the measurements that have not faded between them, so each counts in proportion
//! to the time between them over the half-life.

use super::fit::FoundSource;
use crate::time::{Duration, Instant};

/// Initial standard deviation of the velocity, m/s.
const SPEED: f32 = 10.0;

/// Minimum squared velocity of a moving interferer, relative to its variance.
const CERTAIN: f32 = 16.0;

/// Squared deviation, relative to the variance, from which on a fit belongs to another interferer.
const ELSEWHERE: f32 = 49.0;

/// Position and velocity along one axis, m and m/s, and their covariance.
#[derive(Clone, Copy, Debug)]
struct Axis {
    at: f32,
    speed: f32,
    variance: [f32; 3],
}

impl Axis {
    const fn new(at: f32, variance: f32) -> Self {
        Self {
            at,
            speed: 0.0,
            variance: [variance, 0.0, SPEED * SPEED],
        }
    }

    /// Predicts the state `seconds` later; the velocity's variance grows by `walk` m^2/s^3.
    fn later(&mut self, seconds: f32, walk: f32) {
        self.at += seconds * self.speed;
        let [at, both, speed] = &mut self.variance;
        *at += seconds * (2.0 * *both + seconds * (*speed + walk * seconds / 3.0));
        *both += seconds * (*speed + 0.5 * walk * seconds);
        *speed += walk * seconds;
    }

    /// Updates the state with a position of the given variance.
    fn take(&mut self, found: f32, variance: f32) {
        let [at, both, speed] = self.variance;
        let sum = at + variance;
        if !(sum > 0.0) {
            return;
        }
        if !sum.is_finite() {
            // The last fit is too old to be of use.
            *self = Self::new(found, variance);
            return;
        }
        let off = found - self.at;
        if off * off > ELSEWHERE * sum {
            *self = Self::new(found, variance);
            return;
        }
        self.at += off * at / sum;
        self.speed += off * both / sum;
        self.variance = [
            at * variance / sum,
            both * variance / sum,
            speed - both * both / sum,
        ];
    }

    fn is_moving(&self) -> bool {
        let [_, _, speed] = self.variance;
        self.speed * self.speed > CERTAIN * speed
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    axes: [Axis; 2],
    /// Time of the state; `None` before the first fit.
    at: Option<Instant>,
}

impl Track {
    pub(crate) const NONE: Self = Self {
        axes: [Axis::new(0.0, 0.0); 2],
        at: None,
    };

    /// Updates the track with a fit of measurements at `at`, with this half-life.
    pub(crate) fn take(&mut self, found: &FoundSource, at: Instant, half_life: Duration) {
        let half_life = half_life.as_micros() as f32 * 1e-6;
        let fits = [found.source.x_m, found.source.y_m]
            .into_iter()
            .zip(found.variance_m2);
        let Some(before) = self.at else {
            for (axis, (place, variance)) in self.axes.iter_mut().zip(fits) {
                *axis = Axis::new(place, variance);
            }
            self.at = Some(at);
            return;
        };
        let seconds = at.since(before).as_micros() as f32 * 1e-6;
        if !(seconds > 0.0) {
            return;
        }
        // The velocity may change by 1 m/s in three half-lives.
        let walk = 1.0 / (3.0 * half_life);
        let shared = (1.44 * half_life / seconds).max(1.0);
        for (axis, (place, variance)) in self.axes.iter_mut().zip(fits) {
            axis.later(seconds, walk);
            axis.take(place, variance * shared);
        }
        self.at = Some(at);
    }

    /// Returns the last and the predicted position at `then`, m along the line and to its right; `None` while it does not move.
    pub(crate) fn ahead(&self, then: Instant) -> Option<[[f32; 2]; 2]> {
        let seconds = then.since(self.at?).as_micros() as f32 * 1e-6;
        let [x, y] = self.axes;
        let along = |axis: Axis, seconds: f32| {
            let speed = if axis.is_moving() { axis.speed } else { 0.0 };
            axis.at + seconds * speed
        };
        (x.is_moving() || y.is_moving())
            .then(|| [[x.at, y.at], [along(x, seconds), along(y, seconds)]])
    }
}
