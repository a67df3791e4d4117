//! Messages of a view: its proposal and decision, and the renewals of its lease.

use serde::{Deserialize, Serialize};

use crate::mission::MAX_RELAYS;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::parts::{MessageError, PassId, Word, read, tag, write};

/// Proposal of a new view, an agreement on the chain's members; relays forward it from one to the next.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proposal {
    /// Identifier of the new view's mission, which every relay up to the sender has.
    pub mission_id: MissionId,
    /// Identifier of the proposed view, later than every view known to its proposer.
    pub proposed_view: ViewId,
    /// Number of relays that the proposal has reached, including the sender: 1 to 1000.
    pub place: u16,
    /// Votes and leases of the relays up to the sender.
    pub poll: Poll,
}

/// Poll of the relays that a proposal has reached: votes and leases of an earlier view.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Poll {
    /// Newest view that any polled relay knows to be agreed on.
    pub agreed: View,
    /// Number of polled relays that are members of the view `agreed`: their votes, 0 to 1000.
    pub votes: u16,
    /// True if the proposer of the view `agreed` was polled. With half of the votes, its side then has the quorum.
    pub proposer: bool,
    /// Remaining lease of those members of the view `agreed` that were not polled, in tenths of a second.
    pub lease_left: u16,
    /// Time until leases of earlier views have expired, in tenths of a second; 65535 if unknown. Positions of the new
    /// view may be used only then.
    pub earlier_lease_left: u16,
    /// Latest view after `agreed` that a polled member has accepted; it may have been agreed on.
    pub successor: Option<Successor>,
}

impl Poll {
    /// Returns a poll without votes yet; `agreed` is the view whose members are polled.
    pub(crate) const fn of(agreed: View) -> Self {
        Self {
            agreed,
            votes: 0,
            proposer: false,
            lease_left: u16::MAX,
            earlier_lease_left: u16::MAX,
            successor: None,
        }
    }
}

/// View that a decision accepted, and that may have been agreed on.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Successor {
    /// Identifier of the proposal to which the decision belongs.
    pub proposal: ViewId,
    /// Decided view: the proposed one, or one that was found to be decided before.
    pub view: View,
}

/// Decision on the proposal of a view; sent back from relay to relay to the proposer.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decision {
    /// Identifier of the proposed view's mission.
    pub mission_id: MissionId,
    /// Identifier of the proposed view.
    pub proposed_view: ViewId,
    /// Position of the sender on the proposal's path, from 1 at the proposer: 1 to 1000.
    pub place: u16,
    /// Number of relays that the proposal has reached: 1 to 1000.
    pub reached: u16,
    /// Newest view that any polled relay knows to be agreed on, which the decision follows.
    pub base: View,
    /// View to accept: the proposed one, or one that was decided before; `None` without a quorum.
    pub accepted: Option<View>,
    /// Time until positions of the accepted view may be used, in tenths of a second. Members of the previous view
    /// that were not polled may have a lease until then.
    pub usable_in: u16,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct CallBody {
    digest: Word,
    version: Word,
    proposal: [u8; 4],
    place: Word,
}

impl CallBody {
    const fn new(mission_id: MissionId, proposal: ViewId, place: u16) -> Self {
        Self {
            digest: Word::new(mission_id.digest),
            version: Word::new(mission_id.version),
            proposal: proposal.bits().to_le_bytes(),
            place: Word::new(place),
        }
    }

    fn checked(self) -> Option<(MissionId, ViewId, u16)> {
        let mission_id = MissionId {
            version: self.version.number(),
            digest: self.digest.number(),
        };
        let proposal = ViewId::from_bits(u32::from_le_bytes(self.proposal));
        let place = self.place.number();
        let known = proposal.is_proposed() && is_size(place);
        known.then_some((mission_id, proposal, place))
    }
}

#[derive(Clone, Copy, Serialize, Deserialize)]
struct SizedBody {
    id: [u8; 4],
    relays: Word,
}

impl SizedBody {
    const fn of(view: View) -> Self {
        Self {
            id: view.id.bits().to_le_bytes(),
            relays: Word::new(view.relays),
        }
    }

    fn view(self) -> View {
        View {
            id: ViewId::from_bits(u32::from_le_bytes(self.id)),
            relays: self.relays.number(),
        }
    }
}

/// Returns true if a view with this identifier and number of relays can exist.
fn is_view(view: View) -> bool {
    (view.id == ViewId::LOADED || view.id.is_proposed()) && is_size(view.relays)
}

fn is_size(relays: u16) -> bool {
    (1..=MAX_RELAYS).contains(&relays)
}

impl Proposal {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let Poll {
            agreed,
            votes,
            proposer,
            lease_left,
            earlier_lease_left: rest,
            successor,
        } = self.poll;
        let successor = successor.map(|successor| {
            let proposal = successor.proposal.bits().to_le_bytes();
            (proposal, SizedBody::of(successor.view))
        });
        let call = CallBody::new(self.mission_id, self.proposed_view, self.place);
        let numbers = [votes, lease_left, rest].map(Word::new);
        let agreed = SizedBody::of(agreed);
        write(
            &(tag::PROPOSAL, call, agreed, numbers, proposer, successor),
            buffer,
        )
    }

    /// Decodes a proposal. An agreed or accepted view in it must be earlier than the proposed one.
    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (call, agreed, numbers, proposer, successor): ProposalBody = read(body)?;
        let [votes, lease_left, rest] = numbers.map(Word::number);
        let agreed: View = SizedBody::view(agreed);
        let successor = successor.map(|(proposal, view)| Successor {
            proposal: ViewId::from_bits(u32::from_le_bytes(proposal)),
            view: view.view(),
        });
        let poll = Poll {
            agreed,
            votes,
            proposer,
            lease_left,
            earlier_lease_left: rest,
            successor,
        };
        let known = is_view(agreed)
            && poll.votes <= agreed.relays
            && successor.is_none_or(|successor| {
                successor.proposal.is_proposed()
                    && successor.view.id.is_proposed()
                    && is_size(successor.view.relays)
            });
        let (mission_id, view, place) = call
            .checked()
            .filter(|_| known)
            .filter(|(_, view, _)| {
                agreed.id < *view
                    && successor.is_none_or(|successor| {
                        successor.proposal < *view && successor.view.id <= successor.proposal
                    })
            })
            .ok_or(MessageError::Value)?;
        Ok(Self {
            mission_id,
            proposed_view: view,
            place,
            poll,
        })
    }
}

type ProposalBody = (
    CallBody,
    SizedBody,
    [Word; 3],
    bool,
    Option<([u8; 4], SizedBody)>,
);

impl Decision {
    pub(super) fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        let call = CallBody::new(self.mission_id, self.proposed_view, self.place);
        let view = self.accepted.map(SizedBody::of);
        let base = SizedBody::of(self.base);
        let numbers = [self.reached, self.usable_in].map(Word::new);
        write(&(tag::DECISION, call, base, view, numbers), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (call, base, view, numbers): (CallBody, SizedBody, Option<SizedBody>, [Word; 2]) =
            read(body)?;
        let base = base.view();
        let [there, lease_left] = numbers.map(Word::number);
        let view = view.map(SizedBody::view);
        let known = is_view(base)
            && is_size(there)
            && view.is_none_or(|view| view.id.is_proposed() && is_size(view.relays));
        let (mission_id, proposal, place) = call
            .checked()
            .filter(|(_, proposal, _)| known && base.id < *proposal)
            .filter(|(_, proposal, _)| view.is_none_or(|view| view.id <= *proposal))
            .ok_or(MessageError::Value)?;
        Ok(Self {
            mission_id,
            proposed_view: proposal,
            place,
            reached: there,
            base,
            accepted: view,
            usable_in: lease_left,
        })
    }
}

/// Lease renewal, which the leader of a view sends and each relay forwards to the last one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulse {
    /// Number of the renewal, wrapping. When it is sent, all members have taken part in the previous one.
    pub number: u16,
    /// Digest of the mission and the view to which the lease belongs.
    pub view_digest: u16,
    /// Duration of the lease after a member has taken part in a renewal, in tenths of a second: 1 to 65535.
    pub lease: u16,
}

/// Acknowledgement of a lease renewal; sent back from relay to relay to the leader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulsed {
    /// Number of the acknowledged lease renewal.
    pub number: u16,
    /// Digest of the mission and the view to which the lease belongs.
    pub view_digest: u16,
    /// True if the last relay has received and acknowledged the renewal.
    pub done: bool,
}

impl Pulse {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        write(&(tag::PULSE, pass, Word::new(self.lease)), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, lease): (PassId, Word) = read(body)?;
        let lease = lease.number();
        if lease == 0 {
            return Err(MessageError::Value);
        }
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            lease,
        })
    }
}

impl Pulsed {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        write(&(tag::PULSED, pass, self.done), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (pass, done): (PassId, bool) = read(body)?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            done,
        })
    }
}
