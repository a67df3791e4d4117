//! Messages between neighbours; `FORMAT.md` has the byte tables.
//!
//! Each kind of message has its type, its encoder and its decoder beside each other: in `round` the messages of passes,
//! in `view` those of view changes and leases, in `link` those between two neighbours, in `offer` uploads, in `report`
//! telemetry. A decoder checks all ranges: a decoded message has no invalid number. A body is a byte, the tag, and a
//! tuple encoded by postcard; the order of its fields is the format. `parts` has the tags and shared parts.

mod link;
#[cfg(feature = "upload")]
mod offer;
mod parts;
mod report;
mod round;
mod view;

pub use self::link::{Claim, Hello};
pub use self::parts::MessageError;
pub use self::report::{Coarse, Detail, Entry, Reports};
pub use self::round::{
    AdjustStep, Heard, MOST_NAMED, Moved, OwnSeat, OwnSeats, Roster, Sweep, SweepVerdict, Token,
};
pub use self::view::{Decision, Orders, Poll, Proposal, Pulse, Pulsed, Requests, Successor};

use self::parts::{PassId, Word, read, tag, write};
use super::upload::Upload;
use crate::features::{ADJUST, ALTITUDE, FIELD, GUARD, SENSING, UPLOAD};
use crate::guard::Fence;

/// Maximum length of a sweep's body, bytes.
const SWEEP: usize = 88;

/// Maximum length of a body except a mission offer, bytes.
const LONG: usize = if SENSING { round::HEARD } else { SWEEP };

/// Maximum length of a body, bytes: a mission offer, if possible.
pub const MAX_BODY: usize = if Upload::OFFER > LONG {
    Upload::OFFER
} else {
    LONG
};

#[cfg(not(feature = "upload"))]
impl Upload {
    /// Length of an offer without the feature `upload`: its tag.
    const OFFER: usize = 1;

    const fn encode_offer(&self, _: u16, _: &mut [u8]) -> Option<usize> {
        match *self {}
    }

    const fn decode_offer(_: &[u8]) -> Result<(Self, u16), MessageError> {
        Err(MessageError::Encoding)
    }
}

/// Message between neighbours. A *pass* goes along the chain once; its result comes back. *Onward* is its direction.
#[derive(Clone, PartialEq, Debug)]
pub enum Message {
    /// Target SIRs and farthest x, for the next relay.
    Sweep(Sweep),
    /// Reply to target SIRs: the result for each.
    Verdict(SweepVerdict),
    /// Reply to a repeated message: there is no result yet.
    Busy {
        /// Number of the message in progress, or the view's hash.
        number: u16,
    },
    /// Heartbeat request, reply, or both, in either direction.
    Heartbeat {
        /// Digest of the mission loaded before flight.
        mission: u16,
        /// Number of the own request, 0 for none.
        request: u16,
        /// Number of the answered request, 0 for none.
        reply: u16,
    },
    /// Altitudes and powers so far, for the next relay.
    Gather(Roster),
    /// Reply to `Gather`: altitudes and powers of all relays.
    Gathered(Roster),
    /// Interference estimate and measurements so far, for the next relay.
    Sense(Heard),
    /// Reply to `Sense`: measurements of the sender and later relays.
    Sensed(Heard),
    /// Token of Algorithm 2, for the next relay.
    Token(Token),
    /// Reply to a token: position, and the worst later SIR.
    Moved(Moved),
    /// Lease renewal by the leader, for the next relay.
    Pulse(Pulse),
    /// Reply to a lease renewal.
    Pulsed(Pulsed),
    /// Neighbours and view of the sender, in either direction.
    Hello(Hello),
    /// Proposed view with votes, for the next relay.
    Proposal(Proposal),
    /// Reply to a proposed view: the decision.
    Decision(Decision),
    /// Limit of x (fence) between two neighbours, in either direction.
    Fence {
        /// Digest that is equal if the x axes are. It covers the loaded mission, and uploaded Tx and Rx positions.
        line_digest: u16,
        /// Limit of x, x of the agreed position, and flags.
        fence: Fence,
    },
    /// Newer mission than the destination's.
    Offer {
        /// Offered mission.
        upload: Upload,
        /// Nonce in the answered hello, 0 for none.
        offer_number: u16,
    },
    /// Interference level measured at Tx or Rx, from the ground.
    Level {
        /// Digest of the mission that the sender loaded before flight.
        mission: u16,
        /// Mean interference power with noise, W: 1e-30 to 1e6.
        power_w: f32,
    },
    /// Claim to the own node number, or another's echo.
    Claim(Claim),
    /// Request for all relays' reports, from the ground station.
    Watch {
        /// Number of the request, wrapping; it rises every five seconds.
        number: u16,
        /// Digest of the mission that the sender loaded before flight.
        mission: u16,
    },
    /// Reports of relays, forwarded toward the ground station.
    Report(Reports),
}

impl Message {
    /// Returns the digest of the mission, view or x axis.
    pub fn digest(&self) -> Option<u16> {
        match self {
            Self::Sweep(sweep) => Some(sweep.view_digest),
            Self::Verdict(answer) => Some(answer.view_digest),
            Self::Busy { .. } | Self::Claim(_) => None,
            Self::Heartbeat { mission, .. }
            | Self::Fence {
                line_digest: mission,
                ..
            }
            | Self::Level { mission, .. }
            | Self::Watch { mission, .. } => Some(*mission),
            Self::Report(report) => Some(report.mission()),
            Self::Pulse(pulse) => Some(pulse.view_digest),
            Self::Pulsed(pulsed) => Some(pulsed.view_digest),
            Self::Gather(roster) | Self::Gathered(roster) => Some(roster.view_digest),
            Self::Sense(hearing) | Self::Sensed(hearing) => Some(hearing.view_digest),
            Self::Token(token) => Some(token.view_digest),
            Self::Moved(moved) => Some(moved.view_digest),
            Self::Hello(hello) => Some(hello.mission),
            Self::Proposal(proposal) => Some(proposal.mission_id.digest),
            Self::Decision(decision) => Some(decision.mission_id.digest),
            Self::Offer { upload, .. } => Some(upload.base()),
        }
    }

    /// Returns true for the digest of mission and view.
    pub(crate) const fn belongs_to_view(&self) -> bool {
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

    /// Returns true for the digest of the proposed mission.
    pub(crate) const fn is_view_change(&self) -> bool {
        matches!(self, Self::Proposal(_) | Self::Decision(_))
    }

    /// Returns true for messages onward along the chain, not replies.
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
    /// Encodes into `buffer`; returns the length, at most [`MAX_BODY`]. `None` if it does not fit, or its feature is
    /// missing.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        match self {
            // Messages of a missing feature are never sent.
            Self::Gather(_) | Self::Gathered(_) if !ALTITUDE => None,
            Self::Sense(_) | Self::Sensed(_) if !SENSING => None,
            Self::Level { .. } if !(SENSING && UPLOAD) => None,
            Self::Token(_) | Self::Moved(_) if !ADJUST => None,
            Self::Fence { .. } if !GUARD => None,
            Self::Sweep(sweep) => sweep.encode(buffer),
            Self::Verdict(answer) => answer.encode(buffer),
            Self::Busy { number: sweep } => write(&(tag::BUSY, Word::new(*sweep)), buffer),
            Self::Heartbeat {
                mission,
                request: ask,
                reply: answer,
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
            Self::Fence { line_digest, fence } => link::encode_fence(*line_digest, fence, buffer),
            Self::Offer {
                upload,
                offer_number,
            } => upload.encode_offer(*offer_number, buffer),
            Self::Level { mission, power_w } => round::encode_level(*mission, *power_w, buffer),
            Self::Claim(claim) => claim.encode(buffer),
            Self::Watch { number, mission } => {
                write(&(tag::WATCH, PassId::new(*number, *mission)), buffer)
            }
            Self::Report(report) => report.encode(buffer),
        }
    }

    /// Decodes a message and checks all ranges.
    ///
    /// # Errors
    /// [`MessageError::Encoding`] unless it is one message in its shortest form. [`MessageError::Value`] for a number
    /// out of range, or a missing feature.
    #[inline(never)]
    pub fn decode(bytes: &[u8]) -> Result<Self, MessageError> {
        let (tag, body) = bytes.split_first().ok_or(MessageError::Encoding)?;
        match *tag {
            tag::MEASURED if !FIELD => Err(MessageError::Value),
            tag::ASIDE | tag::GATHER | tag::GATHERED if !ALTITUDE => Err(MessageError::Value),
            tag::SENSE | tag::SENSED if !SENSING => Err(MessageError::Value),
            tag::LEVEL if UPLOAD && !SENSING => Err(MessageError::Value),
            tag::TOKEN | tag::MOVED if !ADJUST => Err(MessageError::Value),
            tag::FENCE if !GUARD => Err(MessageError::Value),
            tag @ (tag::SWEEP | tag::MEASURED | tag::ASIDE) => {
                Sweep::decode(tag, body).map(Self::Sweep)
            }
            tag::VERDICT => SweepVerdict::decode(body).map(Self::Verdict),
            tag::BUSY => Ok(Self::Busy {
                number: read::<Word>(body)?.number(),
            }),
            tag::HEARTBEAT => {
                let [mission, request, reply]: [Word; 3] = read(body)?;
                Ok(Self::Heartbeat {
                    mission: mission.number(),
                    request: request.number(),
                    reply: reply.number(),
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
                let (line_digest, fence) = link::decode_fence(body)?;
                Ok(Self::Fence { line_digest, fence })
            }
            tag::OFFER => {
                let (upload, offer_number) = Upload::decode_offer(body)?;
                Ok(Self::Offer {
                    upload,
                    offer_number,
                })
            }
            tag::LEVEL if UPLOAD => {
                let (mission, power_w) = round::decode_level(body)?;
                Ok(Self::Level { mission, power_w })
            }
            tag::CLAIM => Claim::decode(body).map(Self::Claim),
            tag::WATCH => read::<PassId>(body).map(|pass| Self::Watch {
                number: pass.number(),
                mission: pass.digest(),
            }),
            tag::REPORT => Reports::decode(body).map(Self::Report),
            _ => Err(MessageError::Encoding),
        }
    }
}
