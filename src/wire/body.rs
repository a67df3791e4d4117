//! Messages as bytes: postcard of the types below, whose order of variants and fields is the format.
//!
//! They hold bytes; `checks` has what their values may be. What several messages have in common is a type of its own, which
//! costs no byte and saves the code to read it once more.

use serde::{Deserialize, Serialize};

use super::forming::Forming;
use super::message::{Message, Turn};
#[cfg(feature = "upload")]
use super::upload::{LENGTH, Terms};
use crate::optimiser::PerTarget;
use crate::optimiser::joint::outlook::PARTS;
use crate::optimiser::joint::trial::{TRIALS, Trial};
use crate::optimiser::local::Local;
use crate::place::Placement;

/// Which pass, of which mission.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Pass {
    number: [u8; 2],
    mission: [u8; 2],
}

impl Pass {
    pub(super) const fn new(number: u16, mission: u16) -> Self {
        Self {
            number: number.to_le_bytes(),
            mission: mission.to_le_bytes(),
        }
    }

    pub(super) const fn number(self) -> u16 {
        u16::from_le_bytes(self.number)
    }

    pub(super) const fn mission(self) -> u16 {
        u16::from_le_bytes(self.mission)
    }
}

/// What a sweep begins with.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Targets {
    pub(super) pass: Pass,
    /// Below zero for a plain pass.
    pub(super) anchor: f32,
    pub(super) gap: u8,
    pub(super) growth: u8,
    pub(super) altitude_m: f32,
    pub(super) power_w: f32,
}

/// A place.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct At {
    pub(super) x_m: f32,
    pub(super) altitude_m: f32,
}

/// The wire form of a message.
#[derive(Serialize, Deserialize)]
pub(super) enum Body {
    Sweep(Targets, PerTarget),
    Verdict(Pass, bool, Option<u8>, PerTarget, Option<f32>),
    Busy([u8; 2]),
    Heartbeat([u8; 2], bool),
    Measured(Targets, f32, PerTarget),
    Aside(Targets, f32, PerTarget),
    /// Power, trust, slope and estimate; for each trial target, penalty and place.
    Course(Pass, [f32; 4], heapless::Vec<[f32; 5], TRIALS>),
    Worth(Pass, Option<u8>, f32, [f32; PARTS]),
    Token {
        pass: Pass,
        at: At,
        power_w: f32,
        turn: u8,
        explore_m: f32,
        columns: u8,
        rows: u8,
        sir: f32,
    },
    Moved(Pass, At, bool, f32),
    Hello(Forming),
    Proposal(Forming),
    Decision(Forming),
    /// The number is that of the talk; its echo, the number of the fence, where it is, where the sender is to be.
    Fence(Pass, [u8; 2], [u8; 2], f32, f32),
    #[cfg(feature = "upload")]
    Offer(Terms),
}

impl Body {
    /// Bytes of the shortest encoding. postcard reads longer ones too, whose tag or count is padded with empty varint bytes,
    /// and how many it puts up with depends on the width of a usize: what one node took, another would refuse.
    pub(super) fn shortest(&self) -> usize {
        match self {
            Self::Sweep(_, reaches) => 20 + 4 * reaches.len(),
            Self::Verdict(_, _, commit, slacks, stand) => {
                let stand = if stand.is_some() { 4 } else { 0 };
                9 + usize::from(commit.is_some()) + 4 * slacks.len() + stand
            }
            Self::Busy(_) => 3,
            Self::Heartbeat(..) => 4,
            Self::Measured(_, _, reaches) => 24 + 4 * reaches.len(),
            Self::Aside(_, _, reaches) => 24 + 4 * reaches.len(),
            Self::Course(_, _, trials) => 22 + 20 * trials.len(),
            Self::Worth(_, trial, ..) => 58 + usize::from(trial.is_some()),
            Self::Token { .. } => 28,
            Self::Moved(..) => 18,
            Self::Hello(_) | Self::Proposal(_) | Self::Decision(_) => 14,
            Self::Fence(..) => 17,
            #[cfg(feature = "upload")]
            Self::Offer(_) => LENGTH,
        }
    }
}

impl Message {
    /// Writes the body into `buffer` and returns how many bytes it takes, at most [`MAX_BODY`](super::message::MAX_BODY);
    /// `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let body = match self {
            Self::Sweep(sweep) => {
                let (anchor, gap, growth) = sweep.ladder.parts();
                let targets = Targets {
                    pass: Pass::new(sweep.number, sweep.mission),
                    anchor: if sweep.ladder.is_plain() {
                        -anchor
                    } else {
                        anchor
                    },
                    gap,
                    growth,
                    altitude_m: sweep.relay.at.altitude_m,
                    power_w: sweep.relay.power_w,
                };
                let reaches = sweep.reaches.clone();
                match sweep.measured_per_w {
                    _ if sweep.chosen => Body::Aside(targets, sweep.relay.at.y_m, reaches),
                    None => Body::Sweep(targets, reaches),
                    Some(upsilon_per_w) => Body::Measured(targets, upsilon_per_w, reaches),
                }
            }
            Self::Verdict(answer) => Body::Verdict(
                Pass::new(answer.number, answer.mission),
                answer.own,
                answer.verdict.commit,
                answer.verdict.slacks.clone(),
                answer.stand,
            ),
            Self::Busy { sweep } => Body::Busy(sweep.to_le_bytes()),
            Self::Heartbeat { mission, answer } => Body::Heartbeat(mission.to_le_bytes(), *answer),
            Self::Course(course) => {
                let mut trials = heapless::Vec::new();
                for trial in &course.trials {
                    let Trial {
                        target,
                        penalty_m,
                        place,
                    } = *trial;
                    _ = trials.push([target, penalty_m, place.x_m, place.y_m, place.altitude_m]);
                }
                Body::Course(
                    Pass::new(course.number, course.mission),
                    [
                        course.power_w,
                        course.bar.trust,
                        course.bar.slope,
                        course.bar.estimate,
                    ],
                    trials,
                )
            }
            Self::Worth(worth) => Body::Worth(
                Pass::new(worth.number, worth.mission),
                worth.trial,
                worth.slack_m,
                worth.outlook.parts(),
            ),
            Self::Token(token) => {
                let (turn, explore_m, columns, rows) = turn_parts(token.turn);
                Body::Token {
                    pass: Pass::new(token.number, token.mission),
                    at: at(token.place),
                    power_w: token.power_w,
                    turn,
                    explore_m,
                    columns,
                    rows,
                    sir: token.sir,
                }
            }
            Self::Moved(moved) => Body::Moved(
                Pass::new(moved.number, moved.mission),
                at(moved.place),
                moved.any,
                moved.worst,
            ),
            Self::Hello(hello) => Body::Hello(Forming::of_hello(hello)),
            Self::Proposal(proposal) => Body::Proposal(Forming::of_proposal(proposal)),
            Self::Decision(count) => Body::Decision(Forming::of_decision(count)),
            Self::Fence { mission, fence } => Body::Fence(
                Pass::new(fence.association, *mission),
                fence.echo.to_le_bytes(),
                fence.number.to_le_bytes(),
                fence.x_m,
                fence.target_m,
            ),
            #[cfg(feature = "upload")]
            Self::Offer(upload) => Body::Offer(Terms::of(upload)),
        };
        postcard::to_slice(&body, buffer)
            .ok()
            .map(|written| written.len())
    }
}

/// A turn as one byte and three numbers, all of them 0 where they mean nothing.
const fn turn_parts(turn: Turn) -> (u8, f32, u8, u8) {
    match turn {
        Turn::Look => (0, 0.0, 0, 0),
        Turn::Stop => (1, 0.0, 0, 0),
        Turn::Move {
            explore_m,
            local: Local::Fine,
        } => (2, explore_m, 0, 0),
        Turn::Move {
            explore_m,
            local: Local::Grid { columns, rows },
        } => (2, explore_m, columns, rows),
    }
}

const fn at(place: Placement) -> At {
    At {
        x_m: place.x_m,
        altitude_m: place.altitude_m,
    }
}
