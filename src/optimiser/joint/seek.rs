//! The highest target for which a chain that does not change has no slack missing.

/// A search in ln gamma.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Seek {
    /// The highest that was met, and whether relays have to hold back for it.
    low: Option<(f32, bool)>,
    /// The lowest that was not.
    high: Option<f32>,
    /// What is tried.
    pub(super) sigma: f32,
    step: f32,
    growth: f32,
    width: f32,
}

impl Seek {
    /// Downward from `sigma`, by `step` and then `growth` times as much each time, until one is met; to `width`.
    pub(super) const fn down(sigma: f32, step: f32, growth: f32, width: f32) -> Self {
        Self {
            low: None,
            high: None,
            sigma,
            step,
            growth,
            width,
        }
    }

    /// Upward from `sigma`, which is met, with relays that have to hold back or not, by `step` and then three times as much each time; to `width`.
    pub(super) const fn up(sigma: f32, holds_back: bool, step: f32, width: f32) -> Self {
        Self {
            low: Some((sigma, holds_back)),
            high: None,
            sigma: sigma + step,
            step,
            growth: 3.0,
            width,
        }
    }

    /// What came of it: that it is met, and whether relays have to hold back. Whether there is more to try.
    pub(super) fn tried(&mut self, met: Option<bool>) -> bool {
        match met {
            Some(holds_back) => self.low = Some((self.sigma, holds_back)),
            None => self.high = Some(self.sigma),
        }
        self.sigma = match (self.low, self.high) {
            (Some((low, _)), Some(high)) => {
                let middle = 0.5 * (low + high);
                if high - low <= self.width || middle <= low || middle >= high {
                    return false;
                }
                middle
            }
            (low, _) => {
                let step = if low.is_some() { self.step } else { -self.step };
                self.step *= self.growth;
                if self.step > MOST_STEP {
                    return false;
                }
                self.sigma + step
            }
        };
        true
    }

    /// The highest target that was met, and whether relays have to hold back for it.
    pub(super) const fn found(&self) -> Option<(f32, bool)> {
        self.low
    }
}

/// No target is so many e-folds away.
const MOST_STEP: f32 = 40.0;
