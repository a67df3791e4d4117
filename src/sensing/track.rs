//! An interferer that moves: its velocity from one fit to the next, and where it will be when the chain stands for it.
//!
//! A Kalman filter for each axis, of place and velocity, whose velocity walks at random. A fit is of what was heard a while ago, on average
//! the age of its sums; and two fits share what has not faded between them, so each counts as much as the time between them is of a
//! half-life.

use super::fit::FoundSource;
use crate::time::{Duration, Instant};

/// The velocity that an interferer may have, m/s, before anything is known of it.
const SPEED: f32 = 10.0;

/// Times the standard deviation that a velocity must be to count.
const CERTAIN: f32 = 16.0;

/// Times the standard deviation from which on a fit is of another interferer.
const ELSEWHERE: f32 = 49.0;

/// Place and velocity along one axis, m and m/s, and their covariance.
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

    /// So many seconds later, of a velocity that walks by `walk` m^2/s^3.
    fn later(&mut self, seconds: f32, walk: f32) {
        self.at += seconds * self.speed;
        let [at, both, speed] = &mut self.variance;
        *at += seconds * (2.0 * *both + seconds * (*speed + walk * seconds / 3.0));
        *both += seconds * (*speed + 0.5 * walk * seconds);
        *speed += walk * seconds;
    }

    /// A fit of that variance puts it there.
    fn take(&mut self, found: f32, variance: f32) {
        let [at, both, speed] = self.variance;
        let sum = at + variance;
        if !(sum > 0.0) {
            return;
        }
        if !sum.is_finite() {
            // It was seen too long ago to say anything.
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

/// What is known of an interferer's way.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    axes: [Axis; 2],
    /// The time that they are of; `None` before the first fit.
    at: Option<Instant>,
}

impl Track {
    pub(crate) const NONE: Self = Self {
        axes: [Axis::new(0.0, 0.0); 2],
        at: None,
    };

    /// Takes a fit of what was heard at `at`, with this half-life.
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
        // Over three half-lives the velocity may become another one by 1 m/s.
        let walk = 1.0 / (3.0 * half_life);
        let shared = (1.44 * half_life / seconds).max(1.0);
        for (axis, (place, variance)) in self.axes.iter_mut().zip(fits) {
            axis.later(seconds, walk);
            axis.take(place, variance * shared);
        }
        self.at = Some(at);
    }

    /// Where it was by the last fit, and where it will be at `then`, m along the line and to its right; `None` while it is not seen to move.
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
