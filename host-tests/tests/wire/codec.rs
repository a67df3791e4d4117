//! Second codec, written from the rules in `FORMAT.md` without the crate's code or postcard. CRC and COBS are of other crates.
//!
//! | file | content |
//! | --- | --- |
//! | `codec.rs` | message kinds |
//! | `sweep.rs`, `turn.rs`, `seats.rs`, `hearing.rs`, `hello.rs`, `votes.rs` | longer messages: bytes, conversion, ranges |
//! | `bytes.rs`, `reader.rs`, `limits.rs` | encoding, decoding and ranges of parts |
//! | `frame.rs` | frame around a body |

mod bytes;
mod frame;
mod hearing;
mod hello;
mod limits;
mod reader;
mod seats;
mod sweep;
mod turn;
mod votes;

use serde::Deserialize;
use uav_relay::guard::Fence;
use uav_relay::place::CrossSection;
use uav_relay::wire::message::{Claim, Message, MessageError, Pulse, Pulsed};

pub(crate) use frame::{header, plain, sealed, wire};
pub(crate) use hearing::Heard;
pub(crate) use hello::Greeting;
pub(crate) use seats::Seats;
pub(crate) use sweep::{Judged, Swept, narrow, targets, wide};
pub(crate) use turn::{Handed, Shifted};
pub(crate) use votes::{Call, Decided, Proposed, SizedView};

use super::offer::Offer;
use bytes::{pass, reals, words};
use limits::is_beside;
use reader::Reader;

/// Content of a body, by message.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) enum Said {
    Sweep(Swept),
    Verdict(Judged),
    Busy {
        number: u16,
    },
    Heartbeat {
        mission: u16,
        /// Number of the sender's question, and of the question that it answers; 0 for none.
        ask: u16,
        answer: u16,
    },
    Measured {
        sweep: Swept,
        upsilon_per_w: f32,
    },
    Aside {
        sweep: Swept,
        y_m: f32,
    },
    Gather(Seats),
    Gathered(Seats),
    Token(Handed),
    Moved(Shifted),
    Hello(Greeting),
    Proposal(Proposed),
    Decision(Decided),
    Fence(Fenced),
    Offer(Offer),
    Pulse {
        number: u16,
        mission: u16,
        lease: u16,
    },
    Pulsed {
        number: u16,
        mission: u16,
        done: bool,
    },
    Sense(Heard),
    Sensed(Heard),
    /// Interference at the sender, which is on the ground.
    Level {
        mission: u16,
        power_w: f32,
    },
    /// Claim to a node number, or its echo.
    Claim {
        number: u32,
        heard: u32,
        flags: u8,
    },
}

/// Fence message of the guard.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub(crate) struct Fenced {
    pub(crate) number: u16,
    pub(crate) mission: u16,
    pub(crate) echo: u16,
    pub(crate) fence: u16,
    /// Fence x, final x, y and altitude of the sender, and its distance from the fence, m.
    pub(crate) places: [f32; 5],
    pub(crate) flags: u8,
}

impl Fenced {
    fn body(&self) -> Vec<u8> {
        let mut out = pass(13, [self.number, self.mission]);
        words(&mut out, &[self.echo, self.fence]);
        reals(&mut out, &self.places);
        out.push(self.flags);
        out
    }

    fn message(&self) -> Message {
        let [x_m, target_m, y_m, altitude_m, apart_m] = self.places;
        Message::Fence {
            mission: self.mission,
            fence: Fence {
                association: self.number,
                echo: self.echo,
                number: self.fence,
                x_m,
                target_m,
                across: CrossSection { y_m, altitude_m },
                apart_m,
                flags: self.flags,
            },
        }
    }

    fn read(rest: &mut Reader) -> Option<Self> {
        Some(Self {
            number: rest.word()?,
            mission: rest.word()?,
            echo: rest.word()?,
            fence: rest.word()?,
            places: rest.reals()?,
            flags: rest.byte()?,
        })
    }

    fn in_range(&self) -> bool {
        let [places @ .., apart_m] = self.places;
        let within = places.iter().all(|place| place.abs() <= 1e7);
        self.number != 0 && within && (0.0..=1e5).contains(&apart_m) && self.flags < 128
    }
}

impl Said {
    pub(crate) fn body(&self) -> Vec<u8> {
        match self {
            Self::Sweep(sweep) => sweep.body(0, &[]),
            Self::Verdict(judged) => judged.body(),
            Self::Busy { number } => [&[2], &number.to_le_bytes()[..]].concat(),
            Self::Heartbeat {
                mission,
                ask,
                answer,
            } => {
                let mut out = pass(3, [*mission, *ask]);
                words(&mut out, &[*answer]);
                out
            }
            Self::Measured {
                sweep,
                upsilon_per_w,
            } => sweep.body(4, &[*upsilon_per_w]),
            Self::Aside { sweep, y_m } => sweep.body(5, &[*y_m]),
            Self::Gather(seats) => seats.body(6),
            Self::Gathered(seats) => seats.body(7),
            Self::Token(handed) => handed.body(),
            Self::Moved(shifted) => shifted.body(),
            Self::Hello(greeting) => greeting.body(),
            Self::Proposal(proposed) => proposed.body(),
            Self::Decision(decided) => decided.body(),
            Self::Fence(fenced) => fenced.body(),
            Self::Offer(offer) => offer.body(),
            Self::Pulse {
                number,
                mission,
                lease,
            } => {
                let mut out = pass(15, [*number, *mission]);
                words(&mut out, &[*lease]);
                out
            }
            Self::Pulsed {
                number,
                mission,
                done,
            } => {
                let mut out = pass(16, [*number, *mission]);
                out.push(u8::from(*done));
                out
            }
            Self::Sense(heard) => heard.body(17),
            Self::Sensed(heard) => heard.body(18),
            Self::Level { mission, power_w } => {
                let mut out = vec![19];
                words(&mut out, &[*mission]);
                reals(&mut out, &[*power_w]);
                out
            }
            Self::Claim {
                number,
                heard,
                flags,
            } => {
                let mut out = vec![20];
                out.extend(number.to_le_bytes());
                out.extend(heard.to_le_bytes());
                out.push(*flags);
                out
            }
        }
    }

    /// Converts to the crate's message.
    pub(crate) fn message(&self) -> Message {
        match *self {
            Self::Sweep(ref sweep) => sweep.message(None, None),
            Self::Measured {
                ref sweep,
                upsilon_per_w,
            } => sweep.message(None, Some(upsilon_per_w)),
            Self::Aside { ref sweep, y_m } => sweep.message(Some(y_m), None),
            Self::Verdict(ref judged) => judged.message(),
            Self::Busy { number } => Message::Busy { sweep: number },
            Self::Heartbeat {
                mission,
                ask,
                answer,
            } => Message::Heartbeat {
                mission,
                ask,
                answer,
            },
            Self::Gather(ref seats) => Message::Gather(seats.roster()),
            Self::Gathered(ref seats) => Message::Gathered(seats.roster()),
            Self::Token(ref handed) => handed.message(),
            Self::Moved(ref shifted) => shifted.message(),
            Self::Hello(greeting) => greeting.message(),
            Self::Proposal(proposed) => proposed.message(),
            Self::Decision(decided) => decided.message(),
            Self::Fence(ref fenced) => fenced.message(),
            Self::Offer(offer) => offer.message(),
            Self::Pulse {
                number,
                mission,
                lease,
            } => Message::Pulse(Pulse {
                number,
                mission,
                lease,
            }),
            Self::Pulsed {
                number,
                mission,
                done,
            } => Message::Pulsed(Pulsed {
                number,
                mission,
                done,
            }),
            Self::Sense(ref heard) => heard.message(17),
            Self::Sensed(ref heard) => heard.message(18),
            Self::Level { mission, power_w } => Message::Level { mission, power_w },
            Self::Claim {
                number,
                heard,
                flags,
            } => Message::Claim(Claim {
                number,
                heard,
                passive: flags % 2 == 1,
                echo: flags / 2 % 2 == 1,
            }),
        }
    }

    /// Decodes a body; the error is the reason for refusal.
    pub(crate) fn read(body: &[u8]) -> Result<Self, MessageError> {
        let mut rest = Reader(body);
        let said = Self::take(&mut rest).ok_or(MessageError::Encoding)?;
        if !rest.0.is_empty() {
            return Err(MessageError::Encoding);
        }
        if said.in_range() {
            Ok(said)
        } else {
            Err(MessageError::Value)
        }
    }

    /// Decodes a message at the start of the rest.
    fn take(rest: &mut Reader) -> Option<Self> {
        Some(match rest.byte()? {
            0 => {
                let (sweep, []) = Swept::read(rest)?;
                Self::Sweep(sweep)
            }
            1 => Self::Verdict(Judged::read(rest)?),
            2 => Self::Busy {
                number: rest.word()?,
            },
            3 => Self::Heartbeat {
                mission: rest.word()?,
                ask: rest.word()?,
                answer: rest.word()?,
            },
            4 => {
                let (sweep, [upsilon_per_w]) = Swept::read(rest)?;
                Self::Measured {
                    sweep,
                    upsilon_per_w,
                }
            }
            5 => {
                let (sweep, [y_m]) = Swept::read(rest)?;
                Self::Aside { sweep, y_m }
            }
            6 => Self::Gather(Seats::read(rest)?),
            7 => Self::Gathered(Seats::read(rest)?),
            8 => Self::Token(Handed::read(rest)?),
            9 => Self::Moved(Shifted::read(rest)?),
            10 => Self::Hello(Greeting::read(rest)?),
            11 => Self::Proposal(Proposed::read(rest)?),
            12 => Self::Decision(Decided::read(rest)?),
            13 => Self::Fence(Fenced::read(rest)?),
            14 => {
                let (offer, behind) = Offer::read(rest.0)?;
                rest.0 = behind;
                Self::Offer(offer)
            }
            15 => Self::Pulse {
                number: rest.word()?,
                mission: rest.word()?,
                lease: rest.word()?,
            },
            16 => Self::Pulsed {
                number: rest.word()?,
                mission: rest.word()?,
                done: rest.bool()?,
            },
            17 => Self::Sense(Heard::read(rest)?),
            18 => Self::Sensed(Heard::read(rest)?),
            19 => Self::Level {
                mission: rest.word()?,
                power_w: rest.real()?,
            },
            20 => Self::Claim {
                number: rest.long()?,
                heard: rest.long()?,
                flags: rest.byte()?,
            },
            _ => return None,
        })
    }

    fn in_range(&self) -> bool {
        match self {
            Self::Sweep(sweep) => sweep.in_range(),
            Self::Measured {
                sweep,
                upsilon_per_w,
            } => sweep.in_range() && (1e-9..=1e32).contains(upsilon_per_w),
            Self::Aside { sweep, y_m } => sweep.in_range() && is_beside(*y_m),
            Self::Verdict(judged) => judged.in_range(),
            Self::Busy { .. } | Self::Heartbeat { .. } | Self::Pulsed { .. } => true,
            Self::Claim { flags, .. } => *flags < 4,
            Self::Pulse { lease, .. } => *lease > 0,
            Self::Gather(seats) | Self::Gathered(seats) => seats.in_range(),
            Self::Token(handed) => handed.in_range(),
            Self::Moved(shifted) => shifted.in_range(),
            Self::Hello(greeting) => greeting.in_range(),
            Self::Proposal(proposed) => proposed.in_range(),
            Self::Decision(decided) => decided.in_range(),
            Self::Fence(fenced) => fenced.in_range(),
            Self::Offer(offer) => offer.in_range(),
            Self::Sense(heard) | Self::Sensed(heard) => heard.in_range(),
            Self::Level { power_w, .. } => (1e-30..=1e6).contains(power_w),
        }
    }
}
