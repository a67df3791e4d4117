//! What neighbours say to each other; `FORMAT.md` has the byte tables.
//!
//! For each kind of message there is one file, with the type, the one way to write it and the one way to read it, which checks
//! its ranges: what is read holds no number that a relay would have to doubt. A body is a byte, the `tag`, and postcard of a
//! tuple, whose order is the format. `parts` has what several kinds have in common.

mod claim;
mod fence;
mod hearing;
mod hello;
#[cfg(feature = "upload")]
mod level;
#[cfg(feature = "upload")]
mod offer;
mod parts;
mod pulse;
mod roster;
mod sweep;
mod tag;
mod turn;
mod view;

pub use self::claim::Claim;
pub use self::hearing::Heard;
pub use self::hello::Hello;
pub use self::parts::MessageError;
pub use self::pulse::{Pulse, Pulsed};
pub use self::roster::{MOST_NAMED, OwnSeat, OwnSeats, Roster};
pub use self::sweep::{Answer, Sweep};
pub use self::turn::{AdjustStep, Moved, Token};
pub use self::view::{Decision, Poll, Proposal, Successor};

use self::parts::{Word, read, write};
#[cfg(feature = "upload")]
use super::upload::Upload;
use crate::guard::Fence;

/// The longest body of a sweep: sixteen targets with what was measured, or from aside of the line.
const SWEEP: usize = 88;

/// The longest body but an offer: what relays hear, or without the feature `sensing` a sweep.
const LONG: usize = if cfg!(feature = "sensing") {
    hearing::LENGTH
} else {
    SWEEP
};

/// Bytes of an upload, as a body and as it is stored: those of an offer but its last two.
#[cfg(feature = "upload")]
pub use self::offer::UPLOAD;

/// The longest body: an offer, or without the feature `upload` what relays hear, or a sweep.
#[cfg(feature = "upload")]
pub const MAX_BODY: usize = if offer::LENGTH > LONG {
    offer::LENGTH
} else {
    LONG
};
/// The longest body: an offer, or without the feature `upload` what relays hear, or a sweep.
#[cfg(not(feature = "upload"))]
pub const MAX_BODY: usize = LONG;

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
    /// Either way: a question whether the other one is there, an answer to one, or both.
    Heartbeat {
        /// The sender's mission digest, so that a wrong configuration shows before take-off.
        mission: u16,
        /// The number of the sender's question, 0 for none.
        ask: u16,
        /// The number of the question that it answers, 0 for none.
        answer: u16,
    },
    /// Onward: what the relays up to the sender bring along.
    Gather(Roster),
    /// Back: what those along the whole chain do.
    Gathered(Roster),
    /// Onward: what is believed of the interference, and what the relays up to the sender hear.
    Sense(Heard),
    /// Back: what the relays from the sender on hear.
    Sensed(Heard),
    /// Onward: whose turn it is to move.
    Token(Token),
    /// Back: who has moved where.
    Moved(Moved),
    /// Onward: the leader of the view still holds it.
    Pulse(Pulse),
    /// Back: so do all that the pulse has come to.
    Pulsed(Pulsed),
    /// Either way, also to nodes that are no neighbours: who the sender takes for its neighbour, and which view it holds.
    Hello(Hello),
    /// Onward: who is there, for a new view of the chain.
    Proposal(Proposal),
    /// Back: how many there are.
    Decision(Decision),
    /// Either way: the fence between two neighbours.
    Fence {
        /// [`digest`](super::digest::digest) of the sender's mission, as it was loaded; with the sites of an upload that it flies, where
        /// that has any.
        mission: u16,
        /// What the sender says of it.
        fence: Fence,
    },
    /// Either way, also from the ground: a mission that is newer than the one that the receiver holds.
    #[cfg(feature = "upload")]
    Offer {
        /// The mission.
        upload: Upload,
        /// The number of the receiver's hello that it answers, 0 for none.
        answer: u16,
    },
    /// From the ground: how strong the interference is at that end of the chain.
    #[cfg(feature = "upload")]
    Level {
        /// Digest of the mission that the relays were loaded with.
        mission: u16,
        /// Mean received power, W: 1e-30 to 1e6, with the noise of the end's receiver.
        power_w: f32,
    },
    /// Either way: a claim to the sender's node number, or the echo of one.
    Claim(Claim),
}

impl Message {
    /// The digest of the sender's mission; a [`Message::Busy`] and a [`Message::Claim`] bear none.
    pub const fn mission(&self) -> Option<u16> {
        match self {
            Self::Sweep(sweep) => Some(sweep.mission),
            Self::Verdict(answer) => Some(answer.mission),
            Self::Busy { .. } | Self::Claim(_) => None,
            Self::Heartbeat { mission, .. } | Self::Fence { mission, .. } => Some(*mission),
            Self::Pulse(pulse) => Some(pulse.mission),
            Self::Pulsed(pulsed) => Some(pulsed.mission),
            Self::Gather(roster) | Self::Gathered(roster) => Some(roster.mission),
            Self::Sense(hearing) | Self::Sensed(hearing) => Some(hearing.mission),
            Self::Token(token) => Some(token.mission),
            Self::Moved(moved) => Some(moved.mission),
            Self::Hello(hello) => Some(hello.mission),
            Self::Proposal(proposal) => Some(proposal.mission_id.digest),
            Self::Decision(count) => Some(count.mission_id.digest),
            #[cfg(feature = "upload")]
            Self::Offer { upload, .. } => Some(upload.base()),
            #[cfg(feature = "upload")]
            Self::Level { mission, .. } => Some(*mission),
        }
    }

    /// Whether it is said of a pass that places come of: then its digest is that of a view of the chain.
    pub(crate) const fn is_of_a_view(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_)
                | Self::Verdict(_)
                | Self::Gather(_)
                | Self::Gathered(_)
                | Self::Sense(_)
                | Self::Sensed(_)
                | Self::Token(_)
                | Self::Moved(_)
                | Self::Pulse(_)
                | Self::Pulsed(_)
        )
    }

    /// Whether it is said of a proposal: then its digest is that of the mission to be flown in it.
    pub(crate) const fn is_of_a_proposal(&self) -> bool {
        matches!(self, Self::Proposal(_) | Self::Decision(_))
    }

    /// Whether it is a pass, which goes onward.
    pub const fn is_onward(&self) -> bool {
        matches!(
            self,
            Self::Sweep(_)
                | Self::Gather(_)
                | Self::Sense(_)
                | Self::Token(_)
                | Self::Proposal(_)
                | Self::Pulse(_)
        )
    }
}

impl Message {
    /// Writes the body into `buffer` and returns how many bytes it takes, at most [`MAX_BODY`]; `None` if it does not fit, or is of a method
    /// that this relay was built without.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        match self {
            // What it was built without it never says.
            Self::Gather(_) | Self::Gathered(_) if !cfg!(feature = "altitude") => None,
            Self::Sense(_) | Self::Sensed(_) if !cfg!(feature = "sensing") => None,
            #[cfg(feature = "upload")]
            Self::Level { .. } if !cfg!(feature = "sensing") => None,
            Self::Token(_) | Self::Moved(_) if !cfg!(feature = "adjust") => None,
            Self::Fence { .. } if !cfg!(feature = "guard") => None,
            Self::Sweep(sweep) => sweep.encode(buffer),
            Self::Verdict(answer) => answer.encode(buffer),
            Self::Busy { sweep } => write(&(tag::BUSY, Word::new(*sweep)), buffer),
            Self::Heartbeat {
                mission,
                ask,
                answer,
            } => {
                let numbers = [*mission, *ask, *answer].map(Word::new);
                write(&(tag::HEARTBEAT, numbers), buffer)
            }
            Self::Pulse(pulse) => pulse.encode(buffer),
            Self::Pulsed(pulsed) => pulsed.encode(buffer),
            Self::Gather(roster) => roster.encode(tag::GATHER, buffer),
            Self::Gathered(roster) => roster.encode(tag::GATHERED, buffer),
            Self::Sense(hearing) => hearing.encode(tag::SENSE, buffer),
            Self::Sensed(hearing) => hearing.encode(tag::SENSED, buffer),
            Self::Token(token) => token.encode(buffer),
            Self::Moved(moved) => moved.encode(buffer),
            Self::Hello(hello) => hello.encode(buffer),
            Self::Proposal(proposal) => proposal.encode(buffer),
            Self::Decision(decision) => decision.encode(buffer),
            Self::Fence { mission, fence } => fence::encode(*mission, fence, buffer),
            #[cfg(feature = "upload")]
            Self::Offer { upload, answer } => offer::encode(upload, *answer, buffer),
            #[cfg(feature = "upload")]
            Self::Level { mission, power_w } => level::encode(*mission, *power_w, buffer),
            Self::Claim(claim) => claim.encode(buffer),
        }
    }

    /// The message in `bytes`, with every number in its range. Work linear in their number, at most [`MAX_BODY`] of use.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if it is not one message in its shortest form and nothing else, [`MessageError::Value`] for
    /// a number that is not finite or outside its range, and for a message of a method that this relay was built without.
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (tag, body) = bytes.split_first().ok_or(MessageError::Encoding)?;
        match *tag {
            tag::MEASURED if !cfg!(feature = "field") => Err(MessageError::Value),
            tag::ASIDE | tag::GATHER | tag::GATHERED if !cfg!(feature = "altitude") => {
                Err(MessageError::Value)
            }
            tag::SENSE | tag::SENSED if !cfg!(feature = "sensing") => Err(MessageError::Value),
            #[cfg(feature = "upload")]
            tag::LEVEL if !cfg!(feature = "sensing") => Err(MessageError::Value),
            tag::TOKEN | tag::MOVED if !cfg!(feature = "adjust") => Err(MessageError::Value),
            tag::FENCE if !cfg!(feature = "guard") => Err(MessageError::Value),
            tag @ (tag::SWEEP | tag::MEASURED | tag::ASIDE) => {
                Sweep::decode(tag, body).map(Self::Sweep)
            }
            tag::VERDICT => Answer::decode(body).map(Self::Verdict),
            tag::BUSY => Ok(Self::Busy {
                sweep: read::<Word>(body)?.number(),
            }),
            tag::HEARTBEAT => {
                let [mission, ask, answer]: [Word; 3] = read(body)?;
                Ok(Self::Heartbeat {
                    mission: mission.number(),
                    ask: ask.number(),
                    answer: answer.number(),
                })
            }
            tag::PULSE => Pulse::decode(body).map(Self::Pulse),
            tag::PULSED => Pulsed::decode(body).map(Self::Pulsed),
            tag::GATHER => Roster::decode(body).map(Self::Gather),
            tag::GATHERED => Roster::decode(body).map(Self::Gathered),
            tag::SENSE => Heard::decode(body).map(Self::Sense),
            tag::SENSED => Heard::decode(body).map(Self::Sensed),
            tag::TOKEN => Token::decode(body).map(Self::Token),
            tag::MOVED => Moved::decode(body).map(Self::Moved),
            tag::HELLO => Hello::decode(body).map(Self::Hello),
            tag::PROPOSAL => Proposal::decode(body).map(Self::Proposal),
            tag::DECISION => Decision::decode(body).map(Self::Decision),
            tag::FENCE => {
                let (mission, fence) = fence::decode(body)?;
                Ok(Self::Fence { mission, fence })
            }
            #[cfg(feature = "upload")]
            tag::OFFER => {
                let (upload, answer) = offer::decode(body)?;
                Ok(Self::Offer { upload, answer })
            }
            #[cfg(feature = "upload")]
            tag::LEVEL => {
                let (mission, power_w) = level::decode(body)?;
                Ok(Self::Level { mission, power_w })
            }
            tag::CLAIM => Claim::decode(body).map(Self::Claim),
            _ => Err(MessageError::Encoding),
        }
    }
}
