//! What neighbours say to each other; `FORMAT.md` has the byte tables.
//!
//! For each kind of message there is one file, with the type, the one way to write it and the one way to read it, which checks
//! its ranges. `parts` has what several kinds have in common.

mod course;
mod fence;
mod hello;
#[cfg(feature = "upload")]
mod offer;
mod parts;
mod sweep;
mod turn;
mod view;

use serde::{Deserialize, Serialize};

pub use self::course::{Course, Worth};
pub use self::hello::Hello;
pub use self::sweep::{Answer, Sweep};
pub use self::turn::{Moved, Token, Turn};
pub use self::view::{Decision, PriorView, Proposal};

use self::course::{CourseBody, WorthBody};
use self::fence::FenceBody;
#[cfg(feature = "upload")]
use self::offer::OfferBody;
use self::parts::ViewBody;
use self::sweep::{AnswerBody, SweepHead, SweepKind};
use self::turn::{MovedBody, TokenBody};
#[cfg(feature = "upload")]
use super::upload::{LENGTH, Upload};
use crate::guard::Fence;
use crate::optimiser::PerTarget;

/// The longest body: a sweep of sixteen targets with what was measured, or from aside of the line.
pub const MAX_BODY: usize = 88;

/// One message between neighbours. *Onward* is the way a pass goes: toward Rx, or toward Tx in a field.
#[derive(Clone, PartialEq, Debug)]
pub enum Message {
    /// Onward: targets, and how far the sender reaches for each.
    Sweep(Sweep),
    /// Back: what became of them. It acknowledges the sweep of the same number.
    Verdict(Answer),
    /// Back: the pass of this number has arrived, what became of it is not known yet. Sent for a repeated one only.
    Busy {
        /// The number of the pass.
        sweep: u16,
    },
    /// Either way: a sign of life from a link that would be silent otherwise.
    Heartbeat {
        /// The sender's mission digest, so that a wrong configuration shows before take-off.
        mission: u16,
        /// Whether the sender asks for a heartbeat in return.
        answer: bool,
    },
    /// Onward: where the sender would be in each of a few trials.
    Course(Course),
    /// Back: which of them is gone by, and what the rest of the chain is worth about it.
    Worth(Worth),
    /// Onward: whose turn it is to move.
    Token(Token),
    /// Back: who has moved where.
    Moved(Moved),
    /// Either way, also to nodes that are no neighbours: who the sender takes for its neighbour, and which view it holds.
    Hello(Hello),
    /// Onward: who is there, for a new view of the chain.
    Proposal(Proposal),
    /// Back: how many there are.
    Decision(Decision),
    /// Either way: the fence between two neighbours.
    Fence {
        /// [`digest`](super::digest::digest) of the sender's mission, as it was loaded.
        mission: u16,
        /// What the sender says of it.
        fence: Fence,
    },
    /// Either way, also from the ground: a mission that is newer than the one that the receiver holds.
    #[cfg(feature = "upload")]
    Offer(Upload),
}

impl Message {
    /// The digest of the sender's mission; a [`Message::Busy`] bears none.
    pub const fn mission(&self) -> Option<u16> {
        match self {
            Self::Sweep(sweep) => Some(sweep.mission),
            Self::Verdict(answer) => Some(answer.mission),
            Self::Busy { .. } => None,
            Self::Heartbeat { mission, .. } | Self::Fence { mission, .. } => Some(*mission),
            Self::Course(course) => Some(course.mission),
            Self::Worth(worth) => Some(worth.mission),
            Self::Token(token) => Some(token.mission),
            Self::Moved(moved) => Some(moved.mission),
            Self::Hello(hello) => Some(hello.mission),
            Self::Proposal(proposal) => Some(proposal.mission_id.digest),
            Self::Decision(count) => Some(count.mission_id.digest),
            #[cfg(feature = "upload")]
            Self::Offer(upload) => Some(upload.base()),
        }
    }

    /// Whether it is said of a pass that places come of: then its digest is that of a view of the chain.
    pub(crate) const fn is_of_a_view(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_)
                | Self::Verdict(_)
                | Self::Course(_)
                | Self::Worth(_)
                | Self::Token(_)
                | Self::Moved(_)
        )
    }

    /// Whether it is said of the call for a view: then its digest is that of the mission to be flown in it.
    pub(crate) const fn is_of_a_call(&self) -> bool {
        matches!(self, Self::Proposal(_) | Self::Decision(_))
    }

    /// Whether it is a pass, which goes onward.
    pub const fn is_onward(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_) | Self::Course(_) | Self::Token(_) | Self::Proposal(_)
        )
    }
}

/// What becomes of a message on the wire: postcard of this, whose order of variants and fields is the format. It holds any
/// numbers; what [`Message::decode`] makes of it holds none that a relay would have to doubt.
#[derive(Serialize, Deserialize)]
enum Body {
    Sweep(SweepHead, PerTarget),
    Verdict(AnswerBody),
    Busy([u8; 2]),
    Heartbeat([u8; 2], bool),
    Measured(SweepHead, f32, PerTarget),
    Aside(SweepHead, f32, PerTarget),
    Course(CourseBody),
    Worth(WorthBody),
    Token(TokenBody),
    Moved(MovedBody),
    Hello(ViewBody),
    Proposal(ViewBody),
    Decision(ViewBody),
    Fence(FenceBody),
    #[cfg(feature = "upload")]
    Offer(OfferBody),
}

impl Body {
    fn of(message: &Message) -> Self {
        match message {
            Message::Sweep(sweep) => {
                let (head, reaches) = (SweepHead::of(sweep), sweep.reaches.clone());
                match SweepKind::of(sweep) {
                    SweepKind::Plain => Self::Sweep(head, reaches),
                    SweepKind::Measured(upsilon_per_w) => {
                        Self::Measured(head, upsilon_per_w, reaches)
                    }
                    SweepKind::Aside(y_m) => Self::Aside(head, y_m, reaches),
                }
            }
            Message::Verdict(answer) => Self::Verdict(AnswerBody::of(answer)),
            Message::Busy { sweep } => Self::Busy(sweep.to_le_bytes()),
            Message::Heartbeat { mission, answer } => {
                Self::Heartbeat(mission.to_le_bytes(), *answer)
            }
            Message::Course(course) => Self::Course(CourseBody::of(course)),
            Message::Worth(worth) => Self::Worth(WorthBody::of(worth)),
            Message::Token(token) => Self::Token(TokenBody::of(token)),
            Message::Moved(moved) => Self::Moved(MovedBody::of(moved)),
            Message::Hello(hello) => Self::Hello(hello.body()),
            Message::Proposal(proposal) => Self::Proposal(proposal.body()),
            Message::Decision(decision) => Self::Decision(decision.body()),
            Message::Fence { mission, fence } => Self::Fence(FenceBody::of(*mission, fence)),
            #[cfg(feature = "upload")]
            Message::Offer(upload) => Self::Offer(OfferBody::of(upload)),
        }
    }

    /// Bytes of the shortest encoding. postcard reads longer ones too, whose tag or count is padded with empty varint bytes,
    /// and how many it puts up with depends on the width of a usize: what one node took, another would refuse.
    fn length(&self) -> usize {
        match self {
            Self::Sweep(_, reaches) => SweepKind::Plain.length(reaches),
            Self::Verdict(body) => body.length(),
            Self::Busy(_) => 3,
            Self::Heartbeat(..) => 4,
            Self::Measured(_, upsilon_per_w, reaches) => {
                SweepKind::Measured(*upsilon_per_w).length(reaches)
            }
            Self::Aside(_, y_m, reaches) => SweepKind::Aside(*y_m).length(reaches),
            Self::Course(body) => body.length(),
            Self::Worth(body) => body.length(),
            Self::Token(_) => TokenBody::LENGTH,
            Self::Moved(_) => MovedBody::LENGTH,
            Self::Hello(_) | Self::Proposal(_) | Self::Decision(_) => ViewBody::LENGTH,
            Self::Fence(_) => FenceBody::LENGTH,
            #[cfg(feature = "upload")]
            Self::Offer(_) => LENGTH,
        }
    }

    /// The message, if every number is in its range, and of a method that this relay was built with.
    fn checked(self) -> Option<Message> {
        Some(match self {
            Self::Sweep(head, reaches) => Message::Sweep(head.checked(SweepKind::Plain, reaches)?),
            Self::Measured(head, upsilon_per_w, reaches) if cfg!(feature = "field") => {
                Message::Sweep(head.checked(SweepKind::Measured(upsilon_per_w), reaches)?)
            }
            Self::Aside(head, y_m, reaches) if cfg!(feature = "altitude") => {
                Message::Sweep(head.checked(SweepKind::Aside(y_m), reaches)?)
            }
            Self::Verdict(body) => Message::Verdict(body.checked()?),
            Self::Busy(number) => Message::Busy {
                sweep: u16::from_le_bytes(number),
            },
            Self::Heartbeat(mission, answer) => Message::Heartbeat {
                mission: u16::from_le_bytes(mission),
                answer,
            },
            Self::Course(body) if cfg!(feature = "altitude") => Message::Course(body.checked()?),
            Self::Worth(body) if cfg!(feature = "altitude") => Message::Worth(body.checked()?),
            Self::Token(body) if cfg!(feature = "adjust") => Message::Token(body.checked()?),
            Self::Moved(body) if cfg!(feature = "adjust") => Message::Moved(body.checked()?),
            Self::Hello(body) if cfg!(feature = "membership") => {
                Message::Hello(Hello::checked(body)?)
            }
            Self::Proposal(body) if cfg!(feature = "membership") => {
                Message::Proposal(Proposal::checked(body)?)
            }
            Self::Decision(body) if cfg!(feature = "membership") => {
                Message::Decision(Decision::checked(body)?)
            }
            Self::Fence(body) if cfg!(feature = "guard") => {
                let (mission, fence) = body.checked()?;
                Message::Fence { mission, fence }
            }
            #[cfg(feature = "upload")]
            Self::Offer(body) => Message::Offer(body.checked()?),
            _ => return None,
        })
    }
}

impl Message {
    /// Writes the body into `buffer` and returns how many bytes it takes, at most [`MAX_BODY`]; `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        postcard::to_slice(&Body::of(self), buffer)
            .ok()
            .map(|written| written.len())
    }

    /// The message in `bytes`, with every number in its range. Work linear in their number, at most [`MAX_BODY`] of use.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if it is not one message in its shortest form and nothing else, [`MessageError::Value`] for
    /// a number that is not finite or outside its range.
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (body, rest): (Body, _) =
            postcard::take_from_bytes(bytes).map_err(|_| MessageError::Encoding)?;
        if !rest.is_empty() || bytes.len() != body.length() {
            return Err(MessageError::Encoding);
        }
        body.checked().ok_or(MessageError::Value)
    }
}

/// Stored, an upload is the body of its offer.
#[cfg(feature = "upload")]
impl Upload {
    /// Writes it as it is to be stored, [`LENGTH`] bytes, into `buffer`; `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        Message::Offer(*self).encode(buffer)
    }

    /// Reads it back; `None` if `bytes` are anything but one upload in range. Whether they were stored whole is for a check
    /// sequence around them to say.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        match Message::decode(bytes) {
            Ok(Message::Offer(upload)) => Some(upload),
            _ => None,
        }
    }
}

/// Why a body is no message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MessageError {
    /// Not the one encoding of any message, or bytes are left over.
    Encoding,
    /// A number is not finite or outside its range.
    Value,
}

impl core::fmt::Display for MessageError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Encoding => "the body is not a message",
            Self::Value => "a number in the message is outside its range",
        })
    }
}

impl core::error::Error for MessageError {}
