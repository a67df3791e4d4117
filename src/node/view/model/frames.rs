//! Conversion between messages of the protocol and sortable frames of the model.

use super::chain::Body;
use crate::view::View;
use crate::wire::digest::MissionId;
use crate::wire::message::{Decision, Message, Poll, Proposal, Successor};

impl Body {
    pub(super) fn message(self, mission_id: MissionId) -> Message {
        let view = |(id, relays)| View { id, relays };
        match self {
            Self::Proposal {
                view: id,
                place,
                agreed,
                votes,
                proposer,
                successor,
            } => Message::Proposal(Proposal {
                mission_id,
                view: id,
                place,
                poll: Poll {
                    agreed: view(agreed),
                    votes,
                    proposer,
                    lease_left: 0,
                    rest: 0,
                    successor: successor.map(|(proposal, of)| Successor {
                        proposal,
                        view: view(of),
                    }),
                },
            }),
            Self::Decision {
                proposal,
                place,
                there,
                base,
                view: of,
            } => Message::Decision(Decision {
                mission_id,
                proposal,
                place,
                there,
                base: view(base),
                view: of.map(view),
                lease_left: 0,
            }),
        }
    }

    pub(super) fn of(message: &Message) -> Option<Self> {
        let sized = |view: View| (view.id, view.relays);
        match message {
            Message::Proposal(proposal) => Some(Self::Proposal {
                view: proposal.view,
                place: proposal.place,
                agreed: sized(proposal.poll.agreed),
                votes: proposal.poll.votes,
                proposer: proposal.poll.proposer,
                successor: proposal
                    .poll
                    .successor
                    .map(|successor| (successor.proposal, sized(successor.view))),
            }),
            Message::Decision(decision) => Some(Self::Decision {
                proposal: decision.proposal,
                place: decision.place,
                there: decision.there,
                base: sized(decision.base),
                view: decision.view.map(sized),
            }),
            _ => None,
        }
    }
}
