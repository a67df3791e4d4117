//! What has run out of a view change: something is to be said again, or a view to be asked for, which the leader proposes.

use super::change::{ViewChange, ViewState};
use crate::node::context::{Context, Effects, Member, Proposer};
use crate::node::retransmit::Again;
use crate::node::timing::earliest;
use crate::time::Instant;

impl ViewChange {
    /// `leads` tells whether nobody is before this relay, `fresh` whether nothing has come to it since it was switched on.
    pub(crate) fn handle_timeout(
        &mut self,
        context: &Context<'_>,
        leads: bool,
        fresh: bool,
    ) -> Effects {
        let mut resent = false;
        let hop_time = context.settings().hop_time;
        match self.retransmit.take_due(context.now, hop_time) {
            Some(Again::Onward) if self.state == ViewState::Proposed => {
                self.due.proposal = true;
                resent = true;
            }
            Some(Again::Back) => self.due.decision = true,
            _ => {}
        }
        let effects = if self.asking.is_due(context.now) {
            self.ask_again(context, leads, fresh)
        } else {
            Effects::NONE
        };
        Effects { resent, ..effects }
    }

    /// It has not come yet, or it is time to ask for a place in the chain.
    fn ask_again(&mut self, context: &Context<'_>, leads: bool, fresh: bool) -> Effects {
        let settings = &context.member.settings;
        if !self.asking.take_due(context.now, fresh, settings) {
            return Effects::NONE;
        }
        if !leads {
            return Effects {
                ask: true,
                ..Effects::NONE
            };
        }
        let under_way = self.awaited().is_some_and(|proposed| {
            proposed.view >= self.newest && proposed.mission_id == context.latest
        });
        let newest = self.newest.max(self.electorate.promised());
        let next = newest.next_by(context.member.node);
        let Some(view) = next.filter(|_| !under_way) else {
            return Effects::NONE;
        };
        // A number is spent where something may come of it.
        let Member { node, all, .. } = *context.member;
        let alone = self.refused && context.end && context.settings().quorum;
        if alone
            && self
                .electorate
                .is_refused_alone(node, view, all, context.held)
        {
            self.wait_after_refusal(context);
            return Effects::NONE;
        }
        self.heard_of(view);
        let Some(effects) = self.propose(context, view, context.latest, 0, None) else {
            return Effects::NONE;
        };
        Effects {
            began: true,
            proposed_by: Some(Proposer::Itself),
            ..effects
        }
    }

    pub(crate) fn next_timeout(&self) -> Option<Instant> {
        earliest(self.asking.next_timeout(), self.retransmit.next_timeout())
    }
}
