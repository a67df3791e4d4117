//! Messages of a view: its proposal and decision, and the renewals of its lease.

use serde::{Deserialize, Serialize};

use crate::mission::MAX_RELAYS;
use crate::view::{View, ViewId};
use crate::wire::digest::MissionId;
use crate::wire::message::parts::{MessageError, PassId, Word, read, require, tag, take, write};

/// Proposal of a new view, an agreement on the chain's members. The message travels from relay to relay and collects
/// votes.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Proposal {
    /// Identifier of the new view's mission. Every relay up to the sender has stored this mission.
    pub mission_id: MissionId,
    /// Identifier of the proposed view, later than every view known to its proposer.
    pub proposed_view: ViewId,
    /// Number of relays that the proposal has reached on its way: 1 to 1000. The sender is included.
    pub place: u16,
    /// Votes of the relays up to the sender, and their remaining leases.
    pub poll: Poll,
}

/// Votes on a view proposal so far, and remaining leases of earlier views. Every relay that the proposal reaches adds
/// its vote.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Poll {
    /// Newest agreed view (set of members) that any polled relay knows. Only members of this view have a vote.
    pub agreed: View,
    /// Number of votes for the proposal so far: one for each polled relay that is a member of `agreed`. 0 to 1000.
    pub votes: u16,
    /// True if the relay that proposed `agreed` was polled; for the initial view, if the leader was. Exactly half of
    /// the members' votes are then enough for a quorum.
    pub proposer: bool,
    /// Upper bound of the remaining leases of members of `agreed` that were not polled, tenths of a second.
    pub lease_left: u16,
    /// Time until all leases of views older than `agreed` have expired, in tenths of a second. 65535 if unknown. During
    /// this time, relays must not use positions of the proposed view.
    pub earlier_lease_left: u16,
    /// Latest view newer than `agreed` that a polled member has accepted; `None` if there is no such view. The chain
    /// may have agreed on this view already.
    pub successor: Option<Successor>,
}

impl Poll {
    /// Returns an empty poll: no relay has voted. `agreed` is the view whose members vote.
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

/// View that a polled relay accepted when an earlier proposal was decided. The chain may have agreed on this view
/// already.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Successor {
    /// Identifier of the proposal on which the view was decided.
    pub proposal: ViewId,
    /// View that the decision on the proposal `proposal` adopted. This is the view of that proposal, or an older view
    /// that the vote found to be decided already.
    pub view: View,
}

/// Decision on the proposal of a view; sent back from relay to relay to the proposer.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Decision {
    /// Identifier of the mission that the members of the proposed view fly.
    pub mission_id: MissionId,
    /// Identifier of the proposed view.
    pub proposed_view: ViewId,
    /// Number of relays on the proposal's path from the proposer to the sender, both included: 1 to 1000.
    pub place: u16,
    /// Number of relays that the proposal has reached: 1 to 1000.
    pub reached: u16,
    /// Newest agreed view that any polled relay knows. The relays replace it by the view in `accepted`.
    pub base: View,
    /// View that the relays must accept; `None` without a quorum. This is the proposed view, or an older view that the
    /// vote found to be decided already.
    pub accepted: Option<View>,
    /// Time until relays may use positions of the accepted view, in tenths of a second. During this time, members of an
    /// older view that did not vote can still have a lease.
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

/// Returns true if the identifier and the number of relays of `view` are in their valid ranges.
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

    /// Decodes a proposal. Rejects it unless the views in its poll (`agreed` and `successor`) are earlier than the
    /// proposed view.
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

/// Lease renewal, which the leader of a view sends and each relay forwards toward the last relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulse {
    /// Number of the renewal, wrapping. The leader sends it only after all members have taken part in the previous
    /// renewal.
    pub number: u16,
    /// Digest of the mission and the view to which the lease belongs.
    pub view_digest: u16,
    /// Duration of the lease, in tenths of a second: 1 to 65535. The lease of each member starts when that member
    /// takes part in the renewal.
    pub lease: u16,
    /// Orders of the leader to the relays that leave or join.
    pub orders: Orders,
}

/// Orders of the leader: to a relay that is allowed to leave, and to a relay that joins. Each lease renewal contains
/// these orders.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Orders {
    /// Node that is allowed to leave the chain, 0 for none. The two neighbours of this node then select each other as
    /// neighbours.
    pub leaver: u16,
    /// Node outside of the chain that is called to join it, 0 for none.
    pub joiner: u16,
    /// True if all relays of the view were at their positions when the previous renewal completed.
    pub in_place: bool,
}

impl Orders {
    pub(crate) const NONE: Self = Self {
        leaver: 0,
        joiner: 0,
        in_place: false,
    };
}

/// Requests to the leader by relays that need to leave the chain or are ready to join it. They come from all relays
/// from the chain's last relay up to the sender of this message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Requests {
    /// Node that needs to leave the chain most urgently, 0 for none.
    pub leaver: u16,
    /// Remaining endurance of the node `leaver`, s; 65535 if unknown, 0 if it has the order to leave.
    pub endurance_s: u16,
    /// Spare that is ready to join the chain: the number of a node outside of the chain, 0 for none.
    pub spare: u16,
    /// True if the chain's last relay, the sender, and all relays between them are at their positions.
    pub in_place: bool,
}

impl Requests {
    pub(crate) const NONE: Self = Self {
        leaver: 0,
        endurance_s: 0,
        spare: 0,
        in_place: false,
    };

    /// Merges the requests of two parts of the chain. The more urgent departure is kept.
    ///
    /// If both parts have a spare, the one that is `called` is kept, or else that of the part with the more urgent
    /// departure. If no part has a departure, the spare with the lower number is kept.
    pub(crate) fn merge(self, other: Self, called: u16) -> Self {
        let urgency = |part: &Self| (part.leaver == 0, part.endurance_s, part.leaver);
        let urgent = if urgency(&other) < urgency(&self) {
            other
        } else {
            self
        };
        let spare = match (self.spare, other.spare) {
            (0, spare) | (spare, 0) => spare,
            (one, other) if [one, other].contains(&called) => called,
            _ if urgent.leaver != 0 => urgent.spare,
            (one, other) => one.min(other),
        };
        Self {
            spare,
            in_place: self.in_place && other.in_place,
            ..urgent
        }
    }
}

/// Acknowledgement of a lease renewal; sent back from relay to relay to the leader.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pulsed {
    /// Number of the lease renewal that this reply acknowledges.
    pub number: u16,
    /// Digest of the mission and the view to which the lease belongs.
    pub view_digest: u16,
    /// True if the renewal has reached the last relay of the chain. False if the renewal is still on its way.
    pub done: bool,
    /// Requests of all relays from the chain's last relay up to the sender. They have no meaning while `done` is false.
    pub requests: Requests,
}

/// Common part of a lease renewal and of its acknowledgement. One decoder for both keeps the image small.
#[derive(Clone, Copy, Serialize, Deserialize)]
struct RenewalBody {
    pass: PassId,
    number: Word,
    in_place: bool,
    /// Numbers of two nodes: leaving node in the lower half, joining node in the upper half of a u32. `None` if both
    /// numbers are 0.
    nodes: Option<[u8; 4]>,
}

impl RenewalBody {
    fn new(pass: PassId, number: u16, in_place: bool, [leaver, joiner]: [u16; 2]) -> Self {
        let nodes = u32::from(joiner) << 16 | u32::from(leaver);
        Self {
            pass,
            number: Word::new(number),
            in_place,
            nodes: (nodes != 0).then(|| nodes.to_le_bytes()),
        }
    }

    /// Returns the numbers of the leaving node and the joining node, 0 for none.
    ///
    /// # Errors
    /// [`MessageError::Value`] if a number is above 1000, or if both numbers are 0 but `nodes` is not `None`.
    fn nodes(&self) -> Result<[u16; 2], MessageError> {
        let Some([a, b, c, d]) = self.nodes else {
            return Ok([0; 2]);
        };
        let nodes = [u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d])];
        require(nodes != [0; 2] && nodes.iter().all(|node| *node <= MAX_RELAYS))?;
        Ok(nodes)
    }
}

impl Pulse {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let Orders {
            leaver,
            joiner,
            in_place,
        } = self.orders;
        let common = RenewalBody::new(pass, self.lease, in_place, [leaver, joiner]);
        write(&(tag::PULSE, common), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (common, []) = take::<RenewalBody>(body)? else {
            return Err(MessageError::Encoding);
        };
        let [leaver, joiner] = common.nodes()?;
        let lease = common.number.number();
        require(lease != 0)?;
        Ok(Self {
            number: common.pass.number(),
            view_digest: common.pass.digest(),
            lease,
            orders: Orders {
                leaver,
                joiner,
                in_place: common.in_place,
            },
        })
    }
}

impl Pulsed {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let Requests {
            leaver,
            endurance_s,
            spare,
            in_place,
        } = self.requests;
        let common = RenewalBody::new(pass, endurance_s, in_place, [leaver, spare]);
        write(&(tag::PULSED, common, self.done), buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let (common, done) = take::<RenewalBody>(body)?;
        let done = match done {
            [0] => false,
            [1] => true,
            _ => return Err(MessageError::Encoding),
        };
        let [leaver, spare] = common.nodes()?;
        Ok(Self {
            number: common.pass.number(),
            view_digest: common.pass.digest(),
            done,
            requests: Requests {
                leaver,
                endurance_s: common.number.number(),
                spare,
                in_place: common.in_place,
            },
        })
    }
}
