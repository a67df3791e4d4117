//! Second codec: bodies by the tables of `FORMAT.md`, CRC and COBS of other crates.
//!
//! The names of the tables connect the values of a message here with its bytes, and `message` with the crate's type.
//!
//! | file | content |
//! | --- | --- |
//! | `codec.rs` | message kinds; encoding and decoding by the tables |
//! | `sweep.rs`, `turn.rs`, `seats.rs`, `hearing.rs`, `hello.rs`, `votes.rs` | longer messages, and their conversion |
//! | `fields.rs` | values that consist of several fields |
//! | `frame.rs` | frame around a body |

pub(crate) mod fields;
mod frame;
mod hearing;
mod hello;
mod seats;
mod sweep;
mod turn;
mod votes;

use std::iter;
use std::sync::LazyLock;

use serde::de::value::{MapAccessDeserializer, MapDeserializer};
use serde::{Deserialize, Serialize};
use uav_relay::guard::Fence;
use uav_relay::place::CrossSection;
use uav_relay::wire::message::{Claim, Message, MessageError, Pulse, Pulsed};
use uav_relay_decode::format::Format;
use uav_relay_decode::refusal::Refusal;
use uav_relay_decode::value::Fields;
use uav_relay_decode::{walk, write};

pub(crate) use frame::{header, plain, sealed, wire};
pub(crate) use hearing::Heard;
pub(crate) use hello::Greeting;
pub(crate) use seats::Seats;
pub(crate) use sweep::{Judged, Swept};
pub(crate) use turn::{Handed, Shifted};
pub(crate) use votes::{Call, Decided, Proposed, SizedView};

use super::offer::Offer;

/// Content of a body, by message.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) enum Said {
    Sweep(Swept),
    Verdict(Judged),
    Busy {
        number: u16,
    },
    Heartbeat {
        mission: u16,
        /// Number of the sender's request, and of the answered request; 0 for none.
        request: u16,
        reply: u16,
    },
    Measured {
        #[serde(flatten)]
        sweep: Swept,
        upsilon_per_w: f32,
    },
    Aside {
        #[serde(flatten)]
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
        view_digest: u16,
        #[serde(rename = "lease_ds")]
        lease: u16,
    },
    Pulsed {
        number: u16,
        view_digest: u16,
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
        other_number: u32,
        flags: u8,
    },
}

/// Fence message of the guard.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub(crate) struct Fenced {
    pub(crate) association: u16,
    pub(crate) line_digest: u16,
    pub(crate) echo: u16,
    pub(crate) number: u16,
    /// Fence x, final x, y and altitude of the sender, and its distance from the fence, m.
    #[serde(flatten, with = "fields::places")]
    pub(crate) places: [f32; 5],
    pub(crate) flags: u8,
}

impl Fenced {
    fn message(&self) -> Message {
        let [x_m, target_m, y_m, altitude_m, apart_m] = self.places;
        Message::Fence {
            line_digest: self.line_digest,
            fence: Fence {
                association: self.association,
                echo: self.echo,
                number: self.number,
                x_m,
                target_m,
                across: CrossSection { y_m, altitude_m },
                apart_m,
                flags: self.flags,
            },
        }
    }
}

/// Tables of `FORMAT.md`.
pub(crate) static FORMAT: LazyLock<Format> = LazyLock::new(|| Format::load().unwrap());

/// Decodes and checks the fields of a body.
fn walked(body: &[u8]) -> Result<(&'static str, Fields<'static>), MessageError> {
    match walk::message(&FORMAT, body) {
        Ok((layout, fields)) => Ok((&layout.name, fields)),
        Err(Refusal::Range) => Err(MessageError::Value),
        Err(_) => Err(MessageError::Encoding),
    }
}

impl Said {
    pub(crate) fn body(&self) -> Vec<u8> {
        let said = serde_json::to_value(self).unwrap();
        let (name, fields) = said
            .as_object()
            .and_then(|said| said.iter().next())
            .unwrap();
        write::write(&FORMAT, name, fields).unwrap_or_else(|error| panic!("{error}: {self:?}"))
    }

    /// Decodes a body; the error is the reason for refusal.
    pub(crate) fn read(body: &[u8]) -> Result<Self, MessageError> {
        let (name, fields) = walked(body)?;
        Ok(Self::of(name, &fields))
    }

    /// Returns the message with these fields.
    pub(crate) fn of(name: &str, fields: &Fields<'_>) -> Self {
        let one = MapDeserializer::new(iter::once((name, fields)));
        Self::deserialize(MapAccessDeserializer::new(one)).unwrap()
    }

    /// Returns the reason for refusal of a body, if any.
    pub(crate) fn verdict(body: &[u8]) -> Result<(), MessageError> {
        walked(body).map(|_| ())
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
            Self::Busy { number } => Message::Busy { number },
            Self::Heartbeat {
                mission,
                request,
                reply,
            } => Message::Heartbeat {
                mission,
                request,
                reply,
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
                view_digest: mission,
                lease,
            } => Message::Pulse(Pulse {
                number,
                view_digest: mission,
                lease,
            }),
            Self::Pulsed {
                number,
                view_digest: mission,
                done,
            } => Message::Pulsed(Pulsed {
                number,
                view_digest: mission,
                done,
            }),
            Self::Sense(_) | Self::Sensed(_) => Heard::message(self),
            Self::Level { mission, power_w } => Message::Level { mission, power_w },
            Self::Claim {
                number,
                other_number: heard,
                flags,
            } => Message::Claim(Claim {
                number,
                other_number: heard,
                passive: flags % 2 == 1,
                echo: flags / 2 % 2 == 1,
            }),
        }
    }
}
