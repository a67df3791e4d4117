//! A relay's part in a sweep of target SIRs (Algorithms 1 and 4) and in its result.

use super::computation::{Computation, LeaderTask, PassKind, SweepPass, fingerprint};
use super::state::Action;
use crate::features::{ADJUST, ALTITUDE};
use crate::node::context::Context;
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Behind;
use crate::settings::Method;
use crate::wire::message::{Sweep, SweepVerdict};

impl Computation {
    /// Handles a sweep message, which tries several target SIRs, from the previous relay.
    pub(crate) fn on_sweep(&mut self, context: &Context<'_>, sweep: &Sweep) -> Action {
        let behind = Behind {
            relay: sweep.relay,
            measured_per_w: sweep.measured_per_w,
        };
        let print = fingerprint(Some(behind), &sweep.reaches);
        let same = matches!(&self.pass, PassKind::Sweep(sweep_pass)
            if sweep_pass.ladder == sweep.ladder
                && sweep_pass.chosen == sweep.chosen
                && sweep_pass.fingerprint == print);
        let arrival = self.state.arrival(sweep.number, same);
        if let Some(next) = arrival.refused() {
            return next;
        }
        if sweep.chosen && context.mission().interferer().is_none() {
            return Action::Stale;
        }
        if sweep.chosen && self.seats.is_partial(context.mission().relays()) {
            // This relay has missed the message that had the profiles.
            return Action::Foreign;
        }
        self.state.accept(sweep.number);
        self.sweep_on(
            context,
            sweep.ladder,
            sweep.chosen,
            Some(behind),
            &sweep.reaches,
        )
    }

    /// Starts this relay's computation for several target SIRs. `from` has the previous node's farthest possible x for
    /// each target, m. Farthest means farthest in the direction in which the sweep travels along the chain.
    pub(super) fn sweep_on(
        &mut self,
        context: &Context<'_>,
        ladder: Ladder,
        chosen: bool,
        behind: Option<Behind>,
        from: &PerTarget,
    ) -> Action {
        if !matches!(self.pass, PassKind::Sweep(_)) {
            self.pass = PassKind::Sweep(SweepPass::new(ladder));
        }
        let PassKind::Sweep(sweep_pass) = &mut self.pass else {
            return Action::Stale;
        };
        sweep_pass.ladder = ladder;
        sweep_pass.chosen = chosen;
        sweep_pass.begin(behind, from);
        self.state.wait();
        self.continue_sweep(context)
    }

    /// Continues this relay's computation for several target SIRs by one step.
    pub(super) fn continue_sweep(&mut self, context: &Context<'_>) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
        if ALTITUDE && is_chosen && self.joint_place.is_none() {
            // The relay first needs its joint solution.
            return Action::ContinueWithoutReply;
        }
        let link = self.link(context, is_chosen);
        let PassKind::Sweep(sweep_pass) = &mut self.pass else {
            return Action::Stale;
        };
        if !sweep_pass.advance(link) {
            return Action::ContinueWithoutReply;
        }
        if context.is_last_of_view() {
            self.conclude_sweep(context)
        } else {
            Action::Forward
        }
    }

    /// Handles the result of a sweep of target SIRs, received from the next relay.
    pub(crate) fn on_verdict(&mut self, context: &Context<'_>, answer: &SweepVerdict) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
        let link = self.link(context, is_chosen);
        if let PassKind::Sweep(sweep_pass) = &mut self.pass
            && self.state.is_awaited(answer.number)
            && sweep_pass.apply_sweep_verdict(link, answer)
        {
            return self.conclude_sweep(context);
        }
        Action::Stale
    }

    /// Handles the result of a sweep of target SIRs. If the result commits the chain to a target, this relay takes its
    /// position for that target. Otherwise the leader continues its search.
    pub(super) fn conclude_sweep(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Sweep(sweep_pass) = &self.pass else {
            return Action::Stale;
        };
        if let Some((x_m, target)) = sweep_pass.agreed() {
            let chosen = sweep_pass.chosen;
            if let LeaderTask::Searching { search, given, .. } = &self.task {
                // The result at some lateral offsets and altitudes is no bound for chains with different offsets and
                // altitudes.
                let most = search.most(&sweep_pass.verdict.slacks);
                self.bound = most.filter(|_| !chosen && !given);
            }
            let cross_section = self.station_for(chosen).cross_section;
            self.agree_on(cross_section.at(x_m), cross_section);
            self.target = Some(target);
            let fitted = self.fitted.first().filter(|_| chosen);
            let shares = fitted.and_then(|fitted| Some(fitted.solved?.1));
            self.set_slot_shares(shares);
            if let LeaderTask::Searching { search, .. } = &mut self.task
                && !search.accept(target)
            {
                self.state.answer();
                return Action::ContinueWithoutReply;
            }
            return self.agree(context);
        }
        self.state.answer();
        if self.must_gather(context) {
            return Action::ContinueWithoutReply;
        }
        let LeaderTask::Searching { search, .. } = &mut self.task else {
            return Action::Answer { agreed: false };
        };
        let verdict = &sweep_pass.verdict;
        let next = match search.refused(context.mission(), verdict) {
            Some(target) => {
                let most = search.most(&verdict.slacks);
                search.refuse(context.mission(), self.profile, target, most)
            }
            None => search.advance(&verdict.slacks),
        };
        if next.is_err() {
            let chosen = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.chosen);
            if !chosen || self.search_configured(context).is_err() {
                return self.give_up();
            }
        }
        Action::ContinueWithoutReply
    }

    /// Completes the agreement on positions, or starts the next algorithm of the configured method.
    pub(super) fn agree(&mut self, context: &Context<'_>) -> Action {
        self.state.hold();
        if let LeaderTask::Searching { last: false, .. } = self.task {
            match context.settings().method {
                Method::Adjust(adjust) if ADJUST => {
                    self.task.adjust(adjust);
                    self.state.answer();
                    return Action::ContinueWithoutReply;
                }
                Method::Joint if self.must_gather(context) => {
                    self.state.answer();
                    return Action::ContinueWithoutReply;
                }
                _ => {}
            }
        }
        self.task.clear();
        Action::Answer { agreed: true }
    }
}
