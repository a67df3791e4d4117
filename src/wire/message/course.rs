//! A pass of the joint method, and what came of it, which travels back.

use serde::{Deserialize, Serialize};

use super::parts::{PassId, is_place, profile};
use crate::optimiser::joint::Outlook;
use crate::optimiser::joint::outlook::PARTS;
use crate::optimiser::joint::trial::{Bar, TRIALS, Trial, Trials};
use crate::place::Placement;

/// One pass of the joint method: a few trials of a target and of a step by every relay.
#[derive(Clone, PartialEq, Debug)]
pub struct Course {
    /// Number of the pass, wrapping.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// The sender's transmit power, W.
    pub power_w: f32,
    /// By what they are judged.
    pub bar: Bar,
    /// A few trials, and where the sender is in each of them.
    pub trials: Trials,
}

#[derive(Serialize, Deserialize)]
pub(super) struct CourseBody {
    pass: PassId,
    /// Power, trust, slope and estimate.
    numbers: [f32; 4],
    /// For each trial target, penalty and place.
    trials: heapless::Vec<[f32; 5], TRIALS>,
}

impl CourseBody {
    pub(super) fn of(course: &Course) -> Self {
        let mut trials = heapless::Vec::new();
        for trial in &course.trials {
            let Trial {
                target,
                penalty_m,
                place,
            } = *trial;
            _ = trials.push([target, penalty_m, place.x_m, place.y_m, place.altitude_m]);
        }
        let Bar {
            trust,
            slope,
            estimate,
        } = course.bar;
        Self {
            pass: PassId::new(course.number, course.mission),
            numbers: [course.power_w, trust, slope, estimate],
            trials,
        }
    }

    pub(super) fn length(&self) -> usize {
        22 + 20 * self.trials.len()
    }

    pub(super) fn checked(self) -> Option<Course> {
        let [power_w, trust, slope, estimate] = self.numbers;
        let mut course = Course {
            number: self.pass.number(),
            mission: self.pass.mission(),
            power_w: profile(1.0, power_w)?.power_w,
            bar: bar(trust, slope, estimate)?,
            trials: Trials::new(),
        };
        for parts in self.trials {
            course.trials.push(trial(parts)?).ok()?;
        }
        Some(course)
    }
}

/// What trials are judged by, if its numbers are in range.
fn bar(trust: f32, slope: f32, estimate: f32) -> Option<Bar> {
    let sound = (0.0..=1.0).contains(&trust)
        && (f32::MIN..0.0).contains(&slope)
        && (-1e3..=1e3).contains(&estimate);
    sound.then_some(Bar {
        trust,
        slope,
        estimate,
    })
}

/// A trial, if its numbers are in range.
fn trial([target, penalty_m, x_m, y_m, altitude_m]: [f32; 5]) -> Option<Trial> {
    let place = Placement {
        x_m,
        y_m,
        altitude_m,
    };
    let sound = (f32::MIN_POSITIVE..=1e30).contains(&target)
        && (0.0..=f32::MAX).contains(&penalty_m)
        && is_place(place);
    sound.then_some(Trial {
        target,
        penalty_m,
        place,
    })
}

/// What came of a course, as it travels back.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Worth {
    /// Number of the pass.
    pub number: u16,
    /// [`digest`](crate::wire::digest::digest) of the sender.
    pub mission: u16,
    /// The trial that is gone by; `None` if none got through.
    pub trial: Option<u8>,
    /// Its slack, m.
    pub slack_m: f32,
    /// What the rest of the chain is worth about where the receiver is in it, or in the last one before.
    pub outlook: Outlook,
}

#[derive(Serialize, Deserialize)]
pub(super) struct WorthBody {
    pass: PassId,
    trial: Option<u8>,
    slack_m: f32,
    outlook: [f32; PARTS],
}

impl WorthBody {
    pub(super) fn of(worth: &Worth) -> Self {
        Self {
            pass: PassId::new(worth.number, worth.mission),
            trial: worth.trial,
            slack_m: worth.slack_m,
            outlook: worth.outlook.parts(),
        }
    }

    pub(super) fn length(&self) -> usize {
        58 + usize::from(self.trial.is_some())
    }

    pub(super) fn checked(self) -> Option<Worth> {
        let known = self.trial.is_none_or(|trial| usize::from(trial) < TRIALS);
        (known && self.slack_m.is_finite()).then_some(Worth {
            number: self.pass.number(),
            mission: self.pass.mission(),
            trial: self.trial,
            slack_m: self.slack_m,
            outlook: Outlook::from_parts(self.outlook)?,
        })
    }
}
