//! A pass of the joint method, and what came of it, which travels back.

use super::parts::{MessageError, PassId, is_place, profile, read, write};
use super::tag;
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

/// For each trial target, penalty and place.
type Parts = heapless::Vec<[f32; 5], TRIALS>;

impl Course {
    /// Power, trust, slope and estimate come before the trials.
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let Bar {
            trust,
            slope,
            estimate,
        } = self.bar;
        let mut trials = Parts::new();
        for trial in &self.trials {
            let Trial {
                target,
                penalty_m,
                place,
            } = *trial;
            _ = trials.push([target, penalty_m, place.x_m, place.y_m, place.altitude_m]);
        }
        let numbers = [self.power_w, trust, slope, estimate];
        write(&(tag::COURSE, pass, numbers, trials), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, numbers, trials): (PassId, [f32; 4], Parts) = read(body)?;
        // No empty varint bytes in the count of trials: see `take_targets`.
        if body.len() != 21 + 20 * trials.len() {
            return Err(MessageError::Encoding);
        }
        checked(pass, numbers, trials).ok_or(MessageError::Value)
    }
}

fn checked(pass: PassId, numbers: [f32; 4], trials: Parts) -> Option<Course> {
    let [power_w, trust, slope, estimate] = numbers;
    let mut course = Course {
        number: pass.number(),
        mission: pass.mission(),
        power_w: profile(1.0, power_w)?.power_w,
        bar: bar(trust, slope, estimate)?,
        trials: Trials::new(),
    };
    for parts in trials {
        course.trials.push(trial(parts)?).ok()?;
    }
    Some(course)
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

impl Worth {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.mission);
        let outlook = self.outlook.parts();
        write(
            &(tag::WORTH, pass, self.trial, self.slack_m, outlook),
            buffer,
        )
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, trial, slack_m, outlook): (PassId, Option<u8>, f32, [f32; PARTS]) = read(body)?;
        let known = trial.is_none_or(|trial| usize::from(trial) < TRIALS);
        if !(known && slack_m.is_finite()) {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: pass.number(),
            mission: pass.mission(),
            trial,
            slack_m,
            outlook: Outlook::from_parts(outlook).ok_or(MessageError::Value)?,
        })
    }
}
