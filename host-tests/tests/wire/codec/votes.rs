//! Votes on a view: proposal and decision.

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use uav_relay::wire::digest::MissionId;
use uav_relay::wire::message::{Decision, Message, Poll, Proposal, Successor as Accepted};
use uav_relay::{View, ViewId};

use super::fields;
use super::hello::mission_id;

/// View and its number of relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct SizedView {
    #[serde(rename = "view")]
    pub(crate) id: u32,
    pub(crate) relays: u16,
}

impl SizedView {
    pub(super) fn view(self) -> View {
        View {
            id: ViewId::from_bits(self.id),
            relays: self.relays,
        }
    }
}

/// Common content of proposals and decisions: mission, view, and the sender's place.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Call {
    /// Digest and version of the mission.
    #[serde(flatten, with = "fields::mission")]
    pub(crate) of: (u16, u16),
    #[serde(rename = "proposed_view")]
    pub(crate) view: u32,
    pub(crate) place: u16,
}

impl Call {
    pub(super) fn mission_id(self) -> MissionId {
        mission_id(self.of)
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Proposed {
    #[serde(flatten)]
    pub(crate) call: Call,
    #[serde(flatten, with = "fields::agreed")]
    pub(crate) agreed: SizedView,
    pub(crate) votes: u16,
    #[serde(rename = "lease_left_ds")]
    pub(crate) lease_left: u16,
    #[serde(rename = "earlier_lease_left_ds")]
    pub(crate) rest: u16,
    pub(crate) proposer: bool,
    /// Accepted successor: the proposal by which it was decided, and the view.
    #[serde(serialize_with = "named", deserialize_with = "unnamed")]
    pub(crate) successor: Option<(u32, SizedView)>,
}

impl Proposed {
    pub(super) fn message(self) -> Message {
        Message::Proposal(Proposal {
            mission_id: self.call.mission_id(),
            proposed_view: ViewId::from_bits(self.call.view),
            place: self.call.place,
            poll: Poll {
                agreed: self.agreed.view(),
                votes: self.votes,
                proposer: self.proposer,
                lease_left: self.lease_left,
                earlier_lease_left: self.rest,
                successor: self.successor.map(|(proposal, view)| Accepted {
                    proposal: ViewId::from_bits(proposal),
                    view: view.view(),
                }),
            },
        })
    }
}

/// Content of a decision.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(crate) struct Decided {
    #[serde(flatten)]
    pub(crate) call: Call,
    /// View that the decision follows.
    #[serde(flatten, with = "fields::base")]
    pub(crate) base: SizedView,
    #[serde(rename = "accepted")]
    pub(crate) view: Option<SizedView>,
    pub(crate) reached: u16,
    #[serde(rename = "usable_in_ds")]
    pub(crate) usable_in: u16,
}

impl Decided {
    pub(super) fn message(self) -> Message {
        Message::Decision(Decision {
            mission_id: self.call.mission_id(),
            proposed_view: ViewId::from_bits(self.call.view),
            place: self.call.place,
            reached: self.reached,
            base: self.base.view(),
            accepted: self.view.map(SizedView::view),
            usable_in: self.usable_in,
        })
    }
}

#[derive(Serialize, Deserialize)]
struct Successor {
    proposal: u32,
    #[serde(flatten)]
    view: SizedView,
}

#[expect(clippy::ref_option, reason = "serde hands it over so")]
fn named<S: Serializer>(successor: &Option<(u32, SizedView)>, to: S) -> Result<S::Ok, S::Error> {
    let named = successor.map(|(proposal, view)| Successor { proposal, view });
    named.serialize(to)
}

fn unnamed<'d, D: Deserializer<'d>>(from: D) -> Result<Option<(u32, SizedView)>, D::Error> {
    let successor = Option::<Successor>::deserialize(from)?;
    Ok(successor.map(|Successor { proposal, view }| (proposal, view)))
}
