//! What a course carries: a few trials of a target and of a part of the step, and by what they are judged.

use crate::place::Placement;

/// Parts of the step that are tried, one after the other.
pub(crate) const SHARES: [f32; 3] = [1.0, 0.3, 0.09];

/// What is trusted at first, of a relay's distance from the interferer and of ln gamma.
pub(crate) const TRUST: f32 = 0.5;

/// The most trials of one course.
pub const TRIALS: usize = SHARES.len();

/// One trial of a course.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Trial {
    /// Linear SIR.
    pub target: f32,
    /// What relays up to the sender take off the slack for being too near the interferer, m.
    pub penalty_m: f32,
    /// Where the sender is.
    pub place: Placement,
}

/// Trials of a course, the one with the whole step first.
pub type Trials = heapless::Vec<Trial, TRIALS>;

/// By what the last relay judges the trials, in ln gamma and m.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bar {
    /// How far of its distance from the interferer a relay may step, 0 to 1.
    pub trust: f32,
    /// The slack's slope by ln gamma, m, below 0.
    pub slope: f32,
    /// The logarithm of the target that is to be exceeded.
    pub estimate: f32,
}

impl Bar {
    /// Of the first course: relays are where they have chosen to be, and whatever comes of it is gone by.
    pub(crate) const FIRST: Self = Self {
        trust: TRUST,
        slope: -1.0,
        estimate: -1e3,
    };

    /// Whether it is that of a first course.
    pub(crate) fn begins(self) -> bool {
        self.estimate <= -1e3
    }

    /// The trust after a course of which `trial` is gone by.
    pub(crate) const fn trust_after(self, trial: Option<u8>) -> f32 {
        match trial {
            None => 0.2 * self.trust,
            Some(0) if self.estimate > -1e3 => (2.0 * self.trust).min(1.0),
            Some(_) => self.trust,
        }
    }
}
