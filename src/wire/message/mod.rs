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
pub use self::view::{
    AT_ONCE, Decision, Leave, Nodes, Orders, Poll, Proposal, Pulse, Pulsed, Requests, Successor,
};
pub(crate) use self::view::{OwnRequests, push, used};

use self::parts::{PassId, Word, read, tag, write};
use super::upload::Upload;
use crate::features::{ADJUST, ALTITUDE, FIELD, GUARD, SENSING, UPLOAD};
use crate::guard::Fence;

/// Maximum length of a sweep message's body, bytes. A sweep carries target SIRs along the chain.
const SWEEP: usize = 88;

/// Maximum length of all message bodies except mission offers, bytes.
const LONG: usize = if SENSING { round::HEARD } else { SWEEP };

/// Maximum length of a message body, bytes. The longest message is a mission offer; without the feature `upload` it is
/// a sensing message (with measurements) or a sweep.
pub const MAX_BODY: usize = if Upload::OFFER > LONG {
    Upload::OFFER
} else {
    LONG
};

#[cfg(not(feature = "upload"))]
impl Upload {
    /// Length of an offer's body if the crate is built without uploads, bytes: the message tag alone.
    const OFFER: usize = 1;

    const fn encode_offer(&self, _: u16, _: &mut [u8]) -> Option<usize> {
        match *self {}
    }

    const fn decode_offer(_: &[u8]) -> Result<(Self, u16), MessageError> {
        Err(MessageError::Encoding)
    }
}

/// Message between neighbours.
///
/// A *pass* is a message that travels once along the whole chain; its result travels back. *Onward* is the direction of
/// a pass: toward Rx, or toward Tx if the mission has an interference field.
#[derive(Clone, PartialEq, Debug)]
pub enum Message {
    /// Message to the next relay: target SIRs, and for each target the sender's farthest x that meets it.
    Sweep(Sweep),
    /// Reply to a sweep of target SIRs: the result for each target.
    Verdict(SweepVerdict),
    /// Reply to a duplicate pass message or view proposal: there is no result yet.
    Busy {
        /// Number of the pass in progress; for a view proposal, a 16-bit hash of the proposed view.
        number: u16,
    },
    /// Message toward Tx or toward Rx: heartbeat request, reply, or both.
    Heartbeat {
        /// Digest of the sender's mission as loaded before flight. By this digest, nodes detect different missions
        /// before take-off.
        mission: u16,
        /// Number of the sender's own heartbeat request, 0 for none.
        request: u16,
        /// Number of the destination's heartbeat request that is answered, 0 for none.
        reply: u16,
    },
    /// Message to the next relay: profiles (altitude and power) of the relays up to the sender.
    Gather(Roster),
    /// Reply to `Gather`: profiles (altitude and power) of the whole chain.
    Gathered(Roster),
    /// Message to the next relay: interference estimate, and measurements of the relays up to the sender.
    Sense(Heard),
    /// Reply to `Sense`: measurements of the sender and of all relays that the pass has reached after it.
    Sensed(Heard),
    /// Message to the next relay: token of Algorithm 2 (stepwise improvement of the positions). The relay that receives
    /// the token may move to a position with a better SIR.
    Token(Token),
    /// Reply to `Token`: position of the sender, and SIR of the worst hop after the sender in the pass.
    Moved(Moved),
    /// Message to the next relay: lease renewal, which the leader of the view (agreed members) sends.
    Pulse(Pulse),
    /// Reply to a lease renewal: its acknowledgement.
    Pulsed(Pulsed),
    /// Hello: state of the sender, sent toward Tx or toward Rx, also to nodes that are not neighbours.
    Hello(Hello),
    /// Message to the next relay: proposal of a new view (membership of the chain), with the votes so far.
    Proposal(Proposal),
    /// Reply to a proposal of a view: the decision on it.
    Decision(Decision),
    /// Message toward Tx or toward Rx: limit of x (fence) that keeps two neighbouring relays separated.
    Fence {
        /// Digest by which two neighbours detect that they use different x axes. The digest covers the mission loaded
        /// before flight, and the Tx and Rx positions of an uploaded mission.
        line_digest: u16,
        /// Content of the message: the sender's limit of x, the x of its agreed position, and flags.
        fence: Fence,
    },
    /// Message toward Tx or toward Rx, or from the ground: a mission that is newer than the destination's.
    Offer {
        /// Uploaded mission that the sender offers.
        upload: Upload,
        /// Nonce from the hello that the destination sent and that this offer answers; 0 for none.
        offer_number: u16,
    },
    /// Ground to relay: interference level measured at Tx or Rx.
    Level {
        /// Digest of the mission that the sender loaded before flight.
        mission: u16,
        /// Mean received interference power, W: 1e-30 to 1e6. It includes the noise of the measuring receiver.
        power_w: f32,
    },
    /// Message toward Tx or toward Rx: claim to the sender's node number, or the echo of such a claim.
    Claim(Claim),
    /// Request for reports of all relays; forwarded from relay to relay, away from the ground station.
    Watch {
        /// Number of the request, wrapping. The station raises it every five seconds.
        number: u16,
        /// Digest of the mission that the sender loaded before flight.
        mission: u16,
    },
    /// Reports on the states of relays; forwarded toward a ground station that requests them.
    Report(Reports),
}

impl Message {
    /// Returns the digest that is encoded in the message; `None` for a message without one. The receiver compares it
    /// with its own digest, to detect that its mission, view or x axis differs from the sender's.
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

    /// Returns true for lease renewals, messages that make a pass along the chain, and their replies. The digest in
    /// these messages identifies the mission and the view (agreed members of the chain).
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

    /// Returns true for messages that change the view (agreed members of the chain). The digest in these messages
    /// identifies the proposed mission.
    pub(crate) const fn is_view_change(&self) -> bool {
        matches!(self, Self::Proposal(_) | Self::Decision(_))
    }

    /// Returns true for messages that relays forward along the chain, and false for their replies. Relays forward the
    /// messages of passes, view proposals and lease renewals.
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
    /// Encodes the message body into `buffer`; returns its length, at most [`MAX_BODY`] bytes.
    ///
    /// `None` if it does not fit, or needs a feature that the crate was built without.
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

    /// Decodes a message and checks all ranges. Work linear in the length, at most [`MAX_BODY`].
    ///
    /// # Errors
    /// [`MessageError::Encoding`] if the bytes are not exactly one message in its shortest form, [`MessageError::Value`] for a
    /// number that is not finite or out of range, and for a message of a missing feature.
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
