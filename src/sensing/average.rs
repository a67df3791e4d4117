//! A mean that fades.

use crate::time::{Duration, Instant};

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
