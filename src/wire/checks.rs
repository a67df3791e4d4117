//! What bytes say: one message in its one encoding, every number of it in its range, or nothing.
//!
//! The types of `body` hold any bytes; what [`Message::decode`] makes of them holds none that a relay would have to doubt.

use super::body::{At, Body, Targets};
use super::message::{Answer, Course, Message, MessageError, Moved, Sweep, Token, Turn, Worth};
use crate::field::is_upsilon;
use crate::guard::Fence;
use crate::mission::Profile;
use crate::optimiser::PerTarget;
use crate::optimiser::joint::Outlook;
use crate::optimiser::joint::trial::{Bar, TRIALS, Trial, Trials};
use crate::optimiser::ladder::{Ladder, TARGETS};
use crate::optimiser::local::Local;
use crate::optimiser::verdict::Verdict;
use crate::place::{CrossSection, Placement, Station};

/// No slack or reach in metres is larger: a place is at most 1e6, a reach of the last hop is cut at 1e9.
const FARTHEST_M: f32 = 2e9;

impl Message {
    /// The message in `bytes`, with every number in its range. Work linear in their number, at most
    /// [`MAX_BODY`](super::message::MAX_BODY) of use.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if it is not one message in its shortest form and nothing else, [`MessageError::Value`] for
    /// a number that is not finite or outside its range.
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (body, rest): (Body, _) =
            postcard::take_from_bytes(bytes).map_err(|_| MessageError::Encoding)?;
        if !rest.is_empty() || bytes.len() != body.shortest() {
            return Err(MessageError::Encoding);
        }
        checked(body).ok_or(MessageError::Value)
    }
}

/// The message that `body` is, if every number is in its range.
fn checked(body: Body) -> Option<Message> {
    Some(match body {
        Body::Sweep(targets, reaches) => Message::Sweep(sweep(targets, None, None, reaches)?),
        Body::Measured(targets, upsilon_per_w, reaches) if cfg!(feature = "field") => {
            Message::Sweep(sweep(targets, None, Some(upsilon_per_w), reaches)?)
        }
        Body::Aside(targets, y_m, reaches) if cfg!(feature = "altitude") => {
            Message::Sweep(sweep(targets, Some(y_m), None, reaches)?)
        }
        Body::Verdict(pass, own, commit, slacks, stand) => {
            let known = commit.is_none_or(|target| usize::from(target) < TARGETS);
            let placed = stand.is_none_or(|x_m| (0.0..=1e6).contains(&x_m));
            if !(in_range(&slacks, -FARTHEST_M) && known && placed) {
                return None;
            }
            Message::Verdict(Answer {
                number: pass.number(),
                mission: pass.mission(),
                verdict: Verdict { commit, slacks },
                own,
                stand,
            })
        }
        Body::Busy(number) => Message::Busy {
            sweep: u16::from_le_bytes(number),
        },
        Body::Heartbeat(mission, answer) => Message::Heartbeat {
            mission: u16::from_le_bytes(mission),
            answer,
        },
        Body::Course(pass, [power_w, trust, slope, estimate], trials)
            if cfg!(feature = "altitude") =>
        {
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
            Message::Course(course)
        }
        Body::Worth(pass, trial, slack_m, outlook) if cfg!(feature = "altitude") => {
            if trial.is_some_and(|trial| usize::from(trial) >= TRIALS) {
                return None;
            }
            Message::Worth(Worth {
                number: pass.number(),
                mission: pass.mission(),
                trial,
                slack_m: Some(slack_m).filter(|slack| slack.is_finite())?,
                outlook: Outlook::from_parts(outlook)?,
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
        Body::Hello(forming) => Message::Hello(forming.hello()?),
        Body::Proposal(forming) => Message::Proposal(forming.proposal()?),
        Body::Decision(forming) => Message::Decision(forming.count()?),
        Body::Fence(pass, echo, number, x_m, target_m) if cfg!(feature = "guard") => {
            Message::Fence {
                mission: pass.mission(),
                fence: fence(pass.number(), echo, number, x_m, target_m)?,
            }
        }
        #[cfg(feature = "upload")]
        Body::Offer(terms) => Message::Offer(terms.upload()?),
        // Of a method that this relay was built without.
        _ => return None,
    })
}

/// A sweep of these parts, at the cross-section chosen if there is a `y_m`.
fn sweep(
    targets: Targets,
    y_m: Option<f32>,
    measured_per_w: Option<f32>,
    reaches: PerTarget,
) -> Option<Sweep> {
    let ladder = Ladder::from_parts(targets.anchor.abs(), targets.gap, targets.growth)?
        .plainly(targets.anchor < 0.0);
    let fits = reaches.len() <= ladder.len() && in_range(&reaches, 0.0);
    let measured = measured_per_w.is_none_or(is_upsilon);
    let beside = y_m.is_none_or(is_beside);
    let own = profile(targets.altitude_m, targets.power_w)?;
    (fits && measured && beside).then_some(Sweep {
        number: targets.pass.number(),
        mission: targets.pass.mission(),
        ladder,
        relay: Station {
            at: CrossSection {
                y_m: y_m.unwrap_or(0.0),
                altitude_m: own.altitude_m,
            },
            power_w: own.power_w,
        },
        chosen: y_m.is_some(),
        measured_per_w,
        reaches,
    })
}

/// The fence of these parts, if they are in range.
fn fence(
    association: u16,
    echo: [u8; 2],
    number: [u8; 2],
    x_m: f32,
    target_m: f32,
) -> Option<Fence> {
    let fence = Fence {
        association,
        echo: u16::from_le_bytes(echo),
        number: u16::from_le_bytes(number),
        x_m,
        target_m,
    };
    fence.is_valid().then_some(fence)
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

/// The place above the line, if it may be one.
fn place(at: At) -> Option<Placement> {
    let place = Placement::on_line(at.x_m, at.altitude_m);
    is_place(place).then_some(place)
}

/// Whether a relay may be there.
fn is_place(at: Placement) -> bool {
    (0.0..=1e6).contains(&at.x_m) && is_beside(at.y_m) && (0.1..=1e5).contains(&at.altitude_m)
}

/// Whether a relay may be so far from the line, m.
fn is_beside(y_m: f32) -> bool {
    (-1e5..=1e5).contains(&y_m)
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
