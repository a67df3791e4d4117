//! The highest target for which a chain that does not change has no slack missing.

/// A search in ln gamma.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Seek {
    /// The highest that was met, and its slack, m.
    low: Option<(f32, f32)>,
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

    /// Upward from `sigma`, which has `slack`, by `step` and then three times as much each time; to `width`.
    pub(super) const fn up(sigma: f32, slack: f32, step: f32, width: f32) -> Self {
        Self {
            low: Some((sigma, slack)),
            high: None,
            sigma: sigma + step,
            step,
            growth: 3.0,
            width,
        }
    }

    /// What came of it: `slack`, m, or that a hop cannot meet it. Whether there is more to try.
    pub(super) fn tried(&mut self, slack: Option<f32>) -> bool {
        match slack.filter(|slack| *slack >= 0.0) {
            Some(slack) => self.low = Some((self.sigma, slack)),
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

    /// The highest target that was met.
    pub(super) fn found(&self) -> Option<f32> {
        self.low.map(|(sigma, _)| sigma)
    }
}

/// No target is so many e-folds away.
const MOST_STEP: f32 = 40.0;
