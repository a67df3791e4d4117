//! The search for the altitudes of a chain: which targets and levels the leader tries next, from what the last pass gave.
//!
//! First the whole band, coarsely: from the leader's own prediction where it may predict, else by trying. Then tubes about
//! what each relay has chosen, with targets that rise from the one that is met in halving steps; how wide a relay's tube is
//! it finds out for itself ([`Levels::about`](super::levels::Levels::about)). It ends when two passes in a row bring less
//! than a quarter of the tolerance, or after [`MOST_WAVES`], with a pass of one target and one level: the chain as it has
//! been found, which every relay takes its place in.

use super::levels::TUBE;
use super::wave::{Choice, Rungs};

/// The most passes of one search.
pub const MOST_WAVES: u8 = 24;

/// Levels of the whole band, and targets for each, where nothing has been predicted.
const COARSE: (u8, u8) = (21, 3);

/// Targets of a pass of tubes.
const TARGETS: u8 = 7;

/// How far the targets of the first tubes rise.
const FIRST_RISE: f32 = 0.1;

/// How far the first targets over the whole band rise, and below what the tubes take over.
const COARSE_RISE: (f32, f32) = (1.0, 0.02);

/// What is tried.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Stage {
    /// This many levels of the whole band, for which the leader has predicted the target.
    Predicted(u8),
    /// The whole band, with targets that rise.
    Coarse,
    Tubes,
}

/// The state of a search.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Climb {
    stage: Stage,
    /// The highest target known to be met.
    target: f32,
    /// What the leader has predicted.
    predicted: f32,
    rise: f32,
    tolerance: f32,
    waves: u8,
    /// Passes in a row that brought next to nothing.
    idle: u8,
    /// Whether any pass has met a target.
    found: bool,
}

/// What one pass tries.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Attempt {
    /// The targets.
    pub rungs: Rungs,
    /// Levels for each: a [`TUBE`], as many over the whole band, or the one altitude that was chosen, to agree on it.
    pub levels: u8,
}

impl Climb {
    /// A search from `target`, which the chain meets as it stands, to the relative `tolerance`.
    ///
    /// `predicted` is a target that the leader expects a chain on so many levels of the whole band to meet.
    pub fn new(target: f32, tolerance: f32, predicted: Option<(f32, u8)>) -> Self {
        Self {
            stage: predicted.map_or(Stage::Coarse, |(_, levels)| Stage::Predicted(levels)),
            target,
            predicted: predicted.map_or(target, |(predicted, _)| predicted),
            rise: COARSE_RISE.0,
            tolerance,
            waves: 0,
            idle: 0,
            found: false,
        }
    }

    fn is_over(&self) -> bool {
        self.waves >= MOST_WAVES || self.idle >= 2
    }

    /// Whether it is over and no pass has met what the chain met before it.
    pub fn is_vain(&self) -> bool {
        self.is_over() && !self.found
    }

    /// The highest target known to be met.
    pub const fn target(&self) -> f32 {
        self.target
    }

    /// What to try now.
    pub fn attempt(&self) -> Attempt {
        if self.is_over() {
            return Attempt {
                rungs: Rungs::new(self.target, 0.0, 1),
                levels: 1,
            };
        }
        match self.stage {
            Stage::Predicted(levels) => Attempt {
                rungs: Rungs::new(self.predicted, 0.0, 1),
                levels,
            },
            Stage::Coarse => Attempt {
                rungs: Rungs::new(self.target, self.rise, COARSE.1),
                levels: COARSE.0,
            },
            Stage::Tubes => Attempt {
                rungs: Rungs::new(self.target, self.rise, TARGETS),
                levels: TUBE,
            },
        }
    }

    /// Takes what came of the pass of [`Climb::attempt`]. Constant work.
    pub fn advance(&mut self, rungs: Rungs, choice: Option<Choice>) {
        self.waves = self.waves.saturating_add(1);
        let gain = choice.map_or(0.0, |choice| rungs.rise(choice.target));
        if let Some(choice) = choice {
            self.found = true;
            self.target = self.target.max(rungs.target(choice.target));
        }
        match self.stage {
            Stage::Predicted(_) => self.go_over(if choice.is_some() {
                Stage::Tubes
            } else {
                Stage::Coarse
            }),
            Stage::Coarse => {
                self.rise = if gain > 0.0 && gain >= self.rise {
                    self.rise * 4.0
                } else if gain > 0.0 {
                    self.rise * 0.5
                } else {
                    self.rise * 0.25
                };
                if self.rise < COARSE_RISE.1 {
                    self.go_over(Stage::Tubes);
                }
            }
            Stage::Tubes => {
                let next = if gain > 0.0 {
                    gain * 4.0
                } else {
                    // As far as the lowest target, which is a 32nd of the way up, was not met either.
                    self.rise * 0.0625
                };
                self.rise = next.max(self.tolerance).min(1.0);
                // What a wide rise steps over says nothing.
                let settled = gain < 0.25 * self.tolerance && next <= 8.0 * self.tolerance;
                self.idle = if settled {
                    self.idle.saturating_add(1)
                } else {
                    0
                };
            }
        }
    }

    fn go_over(&mut self, stage: Stage) {
        self.stage = stage;
        self.rise = match stage {
            Stage::Tubes => FIRST_RISE,
            _ => COARSE_RISE.0,
        };
    }
}
