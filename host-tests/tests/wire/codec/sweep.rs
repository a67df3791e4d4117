//! Sweep of targets, and its verdict.

use serde::Deserialize;
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::pass::Verdict;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::message::{Answer, Message, Sweep};

use super::bytes::{list, option, pass, reals};
use super::limits::{is_altitude, is_place, is_power};
use super::reader::Reader;

/// Common content of all sweeps.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Swept {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    /// Negative in a plain pass.
    pub(crate) anchor: f32,
    pub(crate) gap: u8,
    pub(crate) growth: u8,
    pub(crate) altitude_m: f32,
    pub(crate) power_w: f32,
    pub(crate) reaches: Vec<f32>,
}

impl Swept {
    /// Encodes the body, with the numbers `more` before the reaches.
    pub(super) fn body(&self, tag: u8, more: &[f32]) -> Vec<u8> {
        let mut out = pass(tag, [self.number, self.mission]);
        reals(&mut out, &[self.anchor]);
        out.extend([self.gap, self.growth]);
        reals(&mut out, &[self.altitude_m, self.power_w]);
        reals(&mut out, more);
        list(&mut out, &self.reaches);
        out
    }

    /// Converts to the crate's message, with a chosen lateral offset or a measured Upsilon.
    pub(super) fn message(&self, chosen_y_m: Option<f32>, measured_per_w: Option<f32>) -> Message {
        let ladder = Ladder::from_parts(self.anchor.abs(), self.gap, self.growth).unwrap();
        Message::Sweep(Sweep {
            number: self.number,
            mission: self.mission,
            ladder: ladder.plainly(self.anchor < 0.0),
            relay: Station {
                at: CrossSection {
                    y_m: chosen_y_m.unwrap_or(0.0),
                    altitude_m: self.altitude_m,
                },
                power_w: self.power_w,
            },
            chosen: chosen_y_m.is_some(),
            measured_per_w,
            reaches: PerTarget::from_slice(&self.reaches).unwrap(),
        })
    }

    /// Returns true if the ladder is valid with enough targets, and all numbers are in range.
    pub(super) fn in_range(&self) -> bool {
        let targets = targets(self.anchor.abs(), self.gap, self.growth);
        (self.gap > 0 || self.growth == 0)
            && targets[0] >= f32::MIN_POSITIVE
            && targets[targets.len() - 1] < f32::INFINITY
            && self.reaches.len() <= targets.len()
            && self.reaches.iter().all(|reach| (0.0..=2e9).contains(reach))
            && is_altitude(self.altitude_m)
            && is_power(self.power_w)
    }

    /// Decodes a sweep with the numbers before its reaches.
    pub(super) fn read<const N: usize>(rest: &mut Reader) -> Option<(Self, [f32; N])> {
        let mut sweep = Self {
            number: rest.word()?,
            mission: rest.word()?,
            anchor: rest.real()?,
            gap: rest.byte()?,
            growth: rest.byte()?,
            altitude_m: rest.real()?,
            power_w: rest.real()?,
            reaches: Vec::new(),
        };
        let more = rest.reals()?;
        sweep.reaches = rest.list()?;
        Some((sweep, more))
    }
}

/// Returns a ladder's targets; each step is rounded from f64, which equals one f32 operation.
pub(crate) fn targets(anchor: f32, gap: u8, growth: u8) -> Vec<f32> {
    if gap == 0 {
        return vec![anchor];
    }
    let (e, m) = (i32::from(gap >> 3), f64::from(gap & 7));
    let ratio = 1.0 + f64::from(growth) / 16.0;
    let mut gaps = [narrow((1.0 + m / 8.0) * 2_f64.powi(e - 25)); 8];
    let mut targets = vec![anchor; 16];
    for k in 0..7 {
        gaps[k + 1] = narrow(wide(gaps[k]) * ratio);
    }
    for k in 0..8 {
        let step = narrow(wide(targets[7 + k]) * wide(gaps[k]));
        targets[8 + k] = narrow(wide(targets[7 + k]) + wide(step));
    }
    for k in 1..8 {
        let factor = narrow(1.0 + wide(gaps[k]));
        targets[7 - k] = narrow(wide(targets[8 - k]) / wide(factor));
    }
    targets
}

pub(crate) fn wide(value: f32) -> f64 {
    value.into()
}

pub(crate) fn narrow(value: f64) -> f32 {
    value as f32
}

/// Content of a verdict.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Judged {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    pub(crate) own: bool,
    pub(crate) commit: Option<u8>,
    pub(crate) slacks: Vec<f32>,
    pub(crate) stand: Option<f32>,
}

impl Judged {
    pub(super) fn body(&self) -> Vec<u8> {
        let mut out = pass(1, [self.number, self.mission]);
        out.push(u8::from(self.own));
        option(&mut out, self.commit);
        list(&mut out, &self.slacks);
        match self.stand {
            None => out.push(0),
            Some(x_m) => {
                out.push(1);
                reals(&mut out, &[x_m]);
            }
        }
        out
    }

    pub(super) fn message(&self) -> Message {
        Message::Verdict(Answer {
            number: self.number,
            mission: self.mission,
            verdict: Verdict {
                commit: self.commit,
                slacks: PerTarget::from_slice(&self.slacks).unwrap(),
            },
            stand: self.stand,
            own: self.own,
        })
    }

    pub(super) fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            number: rest.word()?,
            mission: rest.word()?,
            own: rest.bool()?,
            commit: rest.option(Reader::byte)?,
            slacks: rest.list()?,
            stand: rest.option(Reader::real)?,
        })
    }

    pub(super) fn in_range(&self) -> bool {
        self.commit.is_none_or(|target| target <= 15)
            && self.slacks.iter().all(|slack| (-2e9..=2e9).contains(slack))
            && self.stand.is_none_or(is_place)
    }
}
