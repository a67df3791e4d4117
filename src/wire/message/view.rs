//! Messages of a view: its proposal and decision, and the renewals of its lease.

use serde::{Deserialize, Serialize};

use crate::mission::MAX_RELAYS;
use crate::view::{View, ViewId};
use crate::wire::CANDIDATES;
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

/// Maximum number of relays that are ordered to leave, or called to join, at the same time.
pub const AT_ONCE: usize = 4;

/// Node numbers in one message. Unused places are 0, and at the end.
pub type Nodes = [u16; AT_ONCE];

/// Orders of the leader: to relays that are allowed to leave, and to relays that join. Each lease renewal contains
/// these orders.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Orders {
    /// Nodes that are allowed to leave the chain. The two neighbours of each node then select each other as
    /// neighbours. Between two of these nodes are at least two relays that stay.
    pub leavers: Nodes,
    /// Nodes outside of the chain that are called to join it, at most one for each gap between two relays.
    pub joiners: Nodes,
    /// True if all relays of the view were at their positions when the previous renewal completed.
    pub in_place: bool,
}

impl Orders {
    pub(crate) const NONE: Self = Self {
        leavers: [0; AT_ONCE],
        joiners: [0; AT_ONCE],
        in_place: false,
    };
}

/// Request of a relay to leave the chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leave {
    /// Node that needs to leave the chain, 0 for none.
    pub node: u16,
    /// Remaining endurance of the node, s; 65535 if unknown, 0 if the node has the order to leave.
    pub endurance_s: u16,
}

impl Leave {
    pub(crate) const NONE: Self = Self {
        node: 0,
        endurance_s: 0,
    };

    /// Returns a number that is lower for a more urgent request.
    const fn rank(self) -> u32 {
        match self.node {
            0 => u32::MAX,
            node => (self.endurance_s as u32) << 16 | node as u32,
        }
    }
}

/// Requests of one relay to the leader.
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnRequests {
    /// Number of the relay.
    pub(crate) node: u16,
    /// Difference between the numbers of this relay and of the next one away from the leader. At most
    /// the largest difference of neighbours if the next relay is unknown.
    pub(crate) gap: u16,
    pub(crate) leave: Leave,
    /// Spare that is ready to join the chain, 0 for none.
    pub(crate) spare: u16,
    pub(crate) in_place: bool,
}

/// Requests to the leader by relays that need to leave the chain or are ready to join it. They come from all relays
/// from the chain's last relay up to the sender of this message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Requests {
    /// Requests to leave, the most urgent one first. Between two of the nodes are at least two other relays.
    pub leaves: [Leave; AT_ONCE],
    /// Spares that are ready to join the chain: at most one for each gap between two relays.
    pub spares: Nodes,
    /// True if the chain's last relay, the sender, and all relays between them are at their positions.
    pub in_place: bool,
}

impl Requests {
    pub(crate) const NONE: Self = Self {
        leaves: [Leave::NONE; AT_ONCE],
        spares: [0; AT_ONCE],
        in_place: false,
    };

    /// Returns these requests of the relays farther from the leader, with those of the next relay, `own`.
    ///
    /// The more urgent one of two requests to leave is kept if their relays are too near to each other. The spares that
    /// are `called` come first, then that of the relay with the most urgent request. Without a request the spare of
    /// `own` comes first if its number is lower. The first one of two spares in a gap is kept.
    pub(crate) fn with(&self, own: &OwnRequests, called: Nodes) -> Self {
        let mut all = Self {
            in_place: self.in_place && own.in_place,
            ..Self::NONE
        };
        let apart = |node: u16| node.abs_diff(own.node);
        // The second relay from here is no farther away.
        let near = own.gap + CANDIDATES;
        let is_near = |it: &Leave| it.node != 0 && apart(it.node) <= near;
        let rank = own.leave.rank();
        let mut rivals = self.leaves.iter().filter(|it| is_near(it));
        let wins = rivals.all(|it| rank < it.rank());
        let mut insert = |mut leave: Leave| {
            for place in &mut all.leaves {
                if leave.rank() < place.rank() {
                    core::mem::swap(place, &mut leave);
                }
            }
        };
        if wins {
            insert(own.leave);
        }
        for it in &self.leaves {
            if !(wins && is_near(it)) {
                insert(*it);
            }
        }
        let [leave, ..] = self.leaves;
        let [spare, ..] = self.spares;
        let first = match rank.min(leave.rank()) {
            u32::MAX => own.spare < spare,
            least => rank == least,
        };
        let own_spare = [own.spare];
        let (one, other) = if first {
            (&own_spare[..], &self.spares[..])
        } else {
            (&self.spares[..], &own_spare[..])
        };
        for is_called in [true, false] {
            for spare in one.iter().chain(other) {
                let is_beside = |it: &u16| {
                    let same = (*it > own.node) == (*spare > own.node);
                    *it == *spare || same && apart(*it).max(apart(*spare)) < own.gap
                };
                let mut known = all.spares.iter().take_while(|it| **it != 0);
                if *spare != 0 && called.contains(spare) == is_called && !known.any(is_beside) {
                    push(&mut all.spares, *spare);
                }
            }
        }
        all
    }
}

/// Writes `node` to the first unused place of `nodes`, if there is one.
pub(crate) fn push(nodes: &mut Nodes, node: u16) {
    if let Some(place) = nodes.iter_mut().find(|place| **place == 0) {
        *place = node;
    }
}

/// Returns the node numbers of `nodes` without unused places.
pub(crate) fn used(nodes: &Nodes) -> impl Iterator<Item = u16> {
    nodes.iter().copied().take_while(|node| *node != 0)
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

/// Encodes `list` at the index `at` of `buffer`: the number of elements, and the elements. Returns the index of the end.
///
/// An element is a node number and further numbers. The first unused place, with the node number 0, ends the list.
fn append<const W: usize>(
    list: &[[u16; W]; AT_ONCE],
    at: usize,
    buffer: &mut [u8],
) -> Option<usize> {
    let (count, mut rest) = buffer.get_mut(at..)?.split_first_mut()?;
    let mut end = at + 1;
    *count = 0;
    for item in list.iter().take_while(|item| item.first() != Some(&0)) {
        for number in item {
            let (to, after) = rest.split_first_chunk_mut()?;
            *to = number.to_le_bytes();
            rest = after;
            end += 2;
        }
        *count += 1;
    }
    Some(end)
}

/// Decodes a list that [`append`] has encoded; returns the list and the remaining bytes. A node number of 0 becomes an
/// invalid one, because it would end the list.
///
/// # Errors
/// [`MessageError::Encoding`] if there are too many elements or too few bytes.
fn take_list<const W: usize>(bytes: &[u8]) -> Result<([[u16; W]; AT_ONCE], &[u8]), MessageError> {
    let (count, mut rest) = bytes.split_first().ok_or(MessageError::Encoding)?;
    let mut list = [[0; W]; AT_ONCE];
    let places = list.get_mut(..usize::from(*count));
    for item in places.ok_or(MessageError::Encoding)? {
        for number in &mut *item {
            let (word, after) = rest.split_first_chunk().ok_or(MessageError::Encoding)?;
            *number = u16::from_le_bytes(*word);
            rest = after;
        }
        if let Some(node @ 0) = item.first_mut() {
            *node = u16::MAX;
        }
    }
    Ok((list, rest))
}

/// Returns true if the list contains only valid node numbers.
fn is_valid<const W: usize>(list: &[[u16; W]; AT_ONCE]) -> bool {
    let mut nodes = list.iter().filter_map(|item| item.first());
    nodes.all(|node| *node <= MAX_RELAYS)
}

impl Pulse {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let Orders {
            leavers,
            joiners,
            in_place,
        } = self.orders;
        let body = (tag::PULSE, pass, Word::new(self.lease), in_place);
        let end = write(&body, buffer)?;
        let end = append(&leavers.map(|node| [node]), end, buffer)?;
        append(&joiners.map(|node| [node]), end, buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ((pass, lease, in_place), rest): ((PassId, Word, bool), _) = take(body)?;
        let (leavers, rest) = take_list(rest)?;
        let (joiners, []) = take_list(rest)? else {
            return Err(MessageError::Encoding);
        };
        let lease = lease.number();
        require(lease != 0 && is_valid(&leavers) && is_valid(&joiners))?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            lease,
            orders: Orders {
                leavers: leavers.map(|[node]| node),
                joiners: joiners.map(|[node]| node),
                in_place,
            },
        })
    }
}

impl Pulsed {
    pub(super) fn encode(self, buffer: &mut [u8]) -> Option<usize> {
        let pass = PassId::new(self.number, self.view_digest);
        let Requests {
            leaves,
            spares,
            in_place,
        } = self.requests;
        let end = write(&(tag::PULSED, pass, in_place, self.done), buffer)?;
        let leaves = leaves.map(|leave| [leave.node, leave.endurance_s]);
        let end = append(&leaves, end, buffer)?;
        append(&spares.map(|node| [node]), end, buffer)
    }

    pub(super) fn decode(body: &[u8]) -> Result<Self, MessageError> {
        let ((pass, in_place, done), rest): ((PassId, bool, bool), _) = take(body)?;
        let (leaves, rest) = take_list(rest)?;
        let (spares, []) = take_list(rest)? else {
            return Err(MessageError::Encoding);
        };
        require(is_valid(&leaves) && is_valid(&spares))?;
        Ok(Self {
            number: pass.number(),
            view_digest: pass.digest(),
            done,
            requests: Requests {
                leaves: leaves.map(|[node, endurance_s]| Leave { node, endurance_s }),
                spares: spares.map(|[node]| node),
                in_place,
            },
        })
    }
}
