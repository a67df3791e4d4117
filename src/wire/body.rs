//! Messages as bytes: postcard of the types below, whose order of variants and fields is the format.
//!
//! They hold bytes, and their values are checked where they become messages: what [`Message::decode`] returns is in range.
//! What several messages have in common is a type of its own, which costs no byte and saves the code to read it once more.

use serde::{Deserialize, Serialize};

use super::forming::Forming;
use super::message::{Answer, Message, MessageError, Moved, Sweep, Token, Trace, Turn, Wave};
use crate::field::is_upsilon;
use crate::guard::Fence;
use crate::mission::Profile;
use crate::placement::PerTarget;
use crate::placement::coded::{PLACES, WIDTH};
use crate::placement::ladder::{Ladder, TARGETS};
use crate::placement::levels::{Levels, MOST_LEVELS};
use crate::placement::local::Local;
use crate::placement::verdict::Verdict;
use crate::placement::wave::{Choice, Rungs};
use crate::sir::Placement;

/// No slack or reach in metres is larger: a place is at most 1e6, a reach of the last hop is cut at 1e9.
const FARTHEST_M: f32 = 2e9;

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
struct Targets {
    pass: Pass,
    anchor: f32,
    gap: u8,
    growth: u8,
    altitude_m: f32,
    power_w: f32,
}

/// A place.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct At {
    x_m: f32,
    altitude_m: f32,
}

/// The wire form of a message.
#[derive(Serialize, Deserialize)]
enum Body<'a> {
    Sweep(Targets, PerTarget),
    Verdict(Pass, Option<u8>, PerTarget),
    Busy([u8; 2]),
    Heartbeat([u8; 2], bool),
    Measured(Targets, f32, PerTarget),
    Wave {
        pass: Pass,
        base: f32,
        rise: f32,
        targets: u8,
        centre_m: f32,
        width_m: f32,
        levels: u8,
        power_w: f32,
        #[serde(borrow)]
        reaches: &'a [u8],
    },
    Trace(Pass, Option<[u8; 2]>),
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
    Hail(Forming),
    Roster(Forming),
    Count(Forming),
    /// The number is that of the talk; its echo, the number of the fence, where it is, where the sender is to be.
    Fence(Pass, [u8; 2], [u8; 2], f32, f32),
}

impl Body<'_> {
    /// Bytes of the shortest encoding. postcard reads longer ones too, whose tag or count is padded with empty varint bytes,
    /// and how many it puts up with depends on the width of a usize: what one node took, another would refuse.
    fn shortest(&self) -> usize {
        match self {
            Self::Sweep(_, reaches) => 20 + 4 * reaches.len(),
            Self::Verdict(_, commit, slacks) => {
                7 + usize::from(commit.is_some()) + 4 * slacks.len()
            }
            Self::Busy(_) => 3,
            Self::Heartbeat(..) => 4,
            Self::Measured(_, _, reaches) => 24 + 4 * reaches.len(),
            Self::Wave { reaches, .. } => 28 + usize::from(reaches.len() > 127) + reaches.len(),
            Self::Trace(_, None) => 6,
            Self::Trace(_, Some(_)) => 8,
            Self::Token { .. } => 28,
            Self::Moved(..) => 18,
            Self::Hail(_) | Self::Roster(_) | Self::Count(_) => 12,
            Self::Fence(..) => 17,
        }
    }
}

impl<'a> Message<'a> {
    /// Writes the body into `buffer` and returns how many bytes it takes, at most [`MAX_BODY`](super::message::MAX_BODY);
    /// `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let body = match self {
            Self::Sweep(sweep) => {
                let (anchor, gap, growth) = sweep.ladder.parts();
                let targets = Targets {
                    pass: Pass::new(sweep.number, sweep.mission),
                    anchor,
                    gap,
                    growth,
                    altitude_m: sweep.profile.altitude_m,
                    power_w: sweep.profile.power_w,
                };
                let reaches = sweep.reaches.clone();
                match sweep.measured_per_w {
                    None => Body::Sweep(targets, reaches),
                    Some(upsilon_per_w) => Body::Measured(targets, upsilon_per_w, reaches),
                }
            }
            Self::Verdict(answer) => Body::Verdict(
                Pass::new(answer.number, answer.mission),
                answer.verdict.commit,
                answer.verdict.slacks.clone(),
            ),
            Self::Busy { sweep } => Body::Busy(sweep.to_le_bytes()),
            Self::Heartbeat { mission, answer } => Body::Heartbeat(mission.to_le_bytes(), *answer),
            Self::Wave(wave) => {
                let (base, rise, targets) = wave.rungs.parts();
                let (centre_m, width_m, levels) = wave.levels.parts();
                Body::Wave {
                    pass: Pass::new(wave.number, wave.mission),
                    base,
                    rise,
                    targets,
                    centre_m,
                    width_m,
                    levels,
                    power_w: wave.power_w,
                    reaches: wave.reaches,
                }
            }
            Self::Trace(trace) => Body::Trace(
                Pass::new(trace.number, trace.mission),
                trace.choice.map(|choice| [choice.target, choice.level]),
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
            Self::Hail(hail) => Body::Hail(Forming::of_hail(hail)),
            Self::Roster(roster) => Body::Roster(Forming::of_roster(roster)),
            Self::Count(count) => Body::Count(Forming::of_count(count)),
            Self::Fence { mission, fence } => Body::Fence(
                Pass::new(fence.tie, *mission),
                fence.echo.to_le_bytes(),
                fence.number.to_le_bytes(),
                fence.x_m,
                fence.target_m,
            ),
        };
        postcard::to_slice(&body, buffer)
            .ok()
            .map(|written| written.len())
    }

    /// The message in `bytes`, with every number in its range. Work linear in their number, at most
    /// [`MAX_BODY`](super::message::MAX_BODY) of use.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if it is not one message in its shortest form and nothing else, [`MessageError::Value`] for
    /// a number that is not finite or outside its range.
    #[inline(never)]
    pub fn decode(bytes: &'a [u8]) -> Result<Self, MessageError> {
        let (body, rest): (Body<'a>, _) =
            postcard::take_from_bytes(bytes).map_err(|_| MessageError::Encoding)?;
        if !rest.is_empty() || bytes.len() != body.shortest() {
            return Err(MessageError::Encoding);
        }
        checked(body).ok_or(MessageError::Value)
    }
}

/// The message that `body` is, if every number is in its range.
fn checked(body: Body<'_>) -> Option<Message<'_>> {
    Some(match body {
        Body::Sweep(targets, reaches) => Message::Sweep(sweep(targets, None, reaches)?),
        Body::Measured(targets, upsilon_per_w, reaches) if cfg!(feature = "field") => {
            Message::Sweep(sweep(targets, Some(upsilon_per_w), reaches)?)
        }
        Body::Verdict(pass, commit, slacks) => {
            let known = commit.is_none_or(|target| usize::from(target) < TARGETS);
            if !(in_range(&slacks, -FARTHEST_M) && known) {
                return None;
            }
            Message::Verdict(Answer {
                number: pass.number(),
                mission: pass.mission(),
                verdict: Verdict { commit, slacks },
            })
        }
        Body::Busy(number) => Message::Busy {
            sweep: u16::from_le_bytes(number),
        },
        Body::Heartbeat(mission, answer) => Message::Heartbeat {
            mission: u16::from_le_bytes(mission),
            answer,
        },
        Body::Wave {
            pass,
            base,
            rise,
            targets,
            centre_m,
            width_m,
            levels,
            power_w,
            reaches,
        } if cfg!(feature = "altitude") => {
            let pairs = usize::from(targets) * usize::from(levels);
            if pairs > PLACES || reaches.len() != WIDTH * pairs {
                return None;
            }
            Message::Wave(Wave {
                number: pass.number(),
                mission: pass.mission(),
                rungs: Rungs::from_parts(base, rise, targets)?,
                levels: Levels::from_parts(centre_m, width_m, levels)?,
                power_w: profile(centre_m, power_w)?.power_w,
                reaches,
            })
        }
        Body::Trace(pass, choice) if cfg!(feature = "altitude") => {
            let choice = choice.map(|[target, level]| Choice { target, level });
            let most = MOST_LEVELS;
            let fits = |choice: Choice| choice.target < most && choice.level < most;
            if !choice.is_none_or(fits) {
                return None;
            }
            Message::Trace(Trace {
                number: pass.number(),
                mission: pass.mission(),
                choice,
            })
        }
        Body::Token {
            pass,
            at,
            power_w,
            turn,
            explore_m,
            columns,
            rows,
            sir,
        } if cfg!(feature = "adjust") => Message::Token(Token {
            number: pass.number(),
            mission: pass.mission(),
            place: place(at)?,
            power_w: profile(at.altitude_m, power_w)?.power_w,
            turn: turn_from_parts(turn, explore_m, columns, rows)?,
            sir: sir_in_range(sir)?,
        }),
        Body::Moved(pass, at, any, worst) if cfg!(feature = "adjust") => Message::Moved(Moved {
            number: pass.number(),
            mission: pass.mission(),
            place: place(at)?,
            any,
            worst: sir_in_range(worst)?,
        }),
        Body::Hail(forming) if cfg!(feature = "membership") => Message::Hail(forming.hail()?),
        Body::Roster(forming) if cfg!(feature = "membership") => Message::Roster(forming.roster()?),
        Body::Count(forming) if cfg!(feature = "membership") => Message::Count(forming.count()?),
        Body::Fence(pass, echo, number, x_m, target_m) if cfg!(feature = "guard") => {
            Message::Fence {
                mission: pass.mission(),
                fence: fence(pass.number(), echo, number, x_m, target_m)?,
            }
        }
        // Of a method that this relay was built without.
        _ => return None,
    })
}

fn sweep(targets: Targets, measured_per_w: Option<f32>, reaches: PerTarget) -> Option<Sweep> {
    let ladder = Ladder::from_parts(targets.anchor, targets.gap, targets.growth)?;
    let fits = reaches.len() <= ladder.len() && in_range(&reaches, 0.0);
    let measured = measured_per_w.is_none_or(is_upsilon);
    (fits && measured).then_some(Sweep {
        number: targets.pass.number(),
        mission: targets.pass.mission(),
        ladder,
        profile: profile(targets.altitude_m, targets.power_w)?,
        measured_per_w,
        reaches,
    })
}

/// The fence of these parts, if they are in range.
fn fence(tie: u16, echo: [u8; 2], number: [u8; 2], x_m: f32, target_m: f32) -> Option<Fence> {
    let fence = Fence {
        tie,
        echo: u16::from_le_bytes(echo),
        number: u16::from_le_bytes(number),
        x_m,
        target_m,
    };
    fence.is_valid().then_some(fence)
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

/// The turn of these parts, if they could not be written otherwise and are in range.
fn turn_from_parts(turn: u8, explore_m: f32, columns: u8, rows: u8) -> Option<Turn> {
    let rest = explore_m.to_bits() == 0 && columns == 0 && rows == 0;
    match turn {
        0 if rest => Some(Turn::Look),
        1 if rest => Some(Turn::Stop),
        2 if (0.0..=1e5).contains(&explore_m) => {
            let local = match (columns, rows) {
                (0, 0) => Local::Fine,
                (2.., 2..) => Local::Grid { columns, rows },
                _ => return None,
            };
            Some(Turn::Move { explore_m, local })
        }
        _ => None,
    }
}

const fn at(place: Placement) -> At {
    At {
        x_m: place.x_m,
        altitude_m: place.altitude_m,
    }
}

/// The place, if it may be one.
fn place(at: At) -> Option<Placement> {
    let sound = (0.0..=1e6).contains(&at.x_m) && (0.1..=1e5).contains(&at.altitude_m);
    sound.then_some(Placement {
        x_m: at.x_m,
        altitude_m: at.altitude_m,
    })
}

/// The profile of these numbers, if they are in range.
fn profile(altitude_m: f32, power_w: f32) -> Option<Profile> {
    let profile = Profile {
        altitude_m,
        power_w,
    };
    profile.is_valid().then_some(profile)
}

/// A linear SIR, if it is one.
fn sir_in_range(sir: f32) -> Option<f32> {
    (0.0..=f32::MAX).contains(&sir).then_some(sir)
}

/// Whether all numbers are within [`least`, `FARTHEST_M`].
fn in_range(numbers: &[f32], least: f32) -> bool {
    numbers
        .iter()
        .all(|number| (least..=FARTHEST_M).contains(number))
}
