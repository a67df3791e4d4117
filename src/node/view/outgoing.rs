//! What is sent of a view change: the proposal onward, the decision back.

use super::change::{ViewChange, ViewState};
use crate::node::context::Context;
use crate::wire::message::{Decision, Message, Proposal};

impl ViewChange {
    /// What could not be said to the neighbour after can be now.
    pub(crate) fn resend(&mut self) {
        self.due.proposal |= self.state == ViewState::Proposed;
    }

    /// Whether the proposal is to be sent onward, to node `to`; it is taken for sent then.
    pub(crate) fn take_onward(&mut self, context: &Context<'_>, to: u16) -> Option<Message> {
        let proposal = self.awaited()?.view;
        if !core::mem::take(&mut self.due.proposal) {
            return None;
        }
        let proposed = self.proposed.as_mut()?;
        if *proposed.handed_to.get_or_insert(to) != to {
            self.abandon(context, proposal);
            return None;
        }
        let proposed = *proposed;
        let way = context.way(context.member.all);
        self.retransmit.sent(context.now, way);
        Some(Message::Proposal(Proposal {
            mission_id: proposed.mission_id,
            view: proposed.view,
            place: proposed.place,
            poll: proposed.poll,
        }))
    }

    /// What is to be sent back; it is taken for sent then.
    pub(crate) fn take_back(&mut self) -> Option<Message> {
        let proposed = self.proposed?;
        if core::mem::take(&mut self.due.decision) && self.state != ViewState::Proposed {
            return Some(Message::Decision(Decision {
                mission_id: proposed.mission_id,
                proposal: proposed.view,
                place: proposed.place,
                there: proposed.there,
                base: proposed.base,
                view: proposed.decided,
                lease_left: proposed.lease_left,
            }));
        }
        core::mem::take(&mut self.due.busy).then_some(Message::Busy {
            sweep: proposed.view.mark(),
        })
    }

    /// A message is said to have arrived: whether it is the proposal.
    pub(crate) fn on_busy(&mut self, context: &Context<'_>, number: u16) -> bool {
        let known = self
            .awaited()
            .is_some_and(|proposed| proposed.view.mark() == number);
        if known {
            let way = context.way(context.member.all);
            self.retransmit.arrived(context.now, way);
        }
        known
    }
}
