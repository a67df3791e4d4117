//! A relay's share of a sweep (Algorithms 1 and 4), and of its verdict.

use super::computation::{ADJUST, ALTITUDE, Computation, PassKind};
use super::state::Action;
use super::sweeping::{Sweeping, fingerprint};
use super::task::LeaderTask;
use crate::node::context::Context;
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Behind;
use crate::settings::Method;
use crate::wire::message::{Answer, Sweep};

impl Computation {
    /// A sweep from the relay before.
    pub(crate) fn on_sweep(&mut self, context: &Context<'_>, sweep: &Sweep) -> Action {
        let behind = Behind {
            relay: sweep.relay,
            measured_per_w: sweep.measured_per_w,
        };
        let print = fingerprint(Some(behind), &sweep.reaches);
        let same = matches!(&self.pass, PassKind::Sweep(sweeping)
            if sweeping.ladder == sweep.ladder
                && sweeping.chosen == sweep.chosen
                && sweeping.fingerprint == print);
        let arrival = self.state.arrival(sweep.number, same);
        if let Some(next) = arrival.refused(self.state) {
            return next;
        }
        if sweep.chosen && context.mission().interferer().is_none() {
            return Action::Stale;
        }
        if sweep.chosen && self.seats.is_partial(context.mission().relays()) {
            // It was not there when the rest was told.
            return Action::Foreign;
        }
        self.state.take(sweep.number);
        self.sweep_on(
            context,
            sweep.ladder,
            sweep.chosen,
            Some(behind),
            &sweep.reaches,
        )
    }

    /// Works out this relay's share of a sweep.
    pub(super) fn sweep_on(
        &mut self,
        context: &Context<'_>,
        ladder: Ladder,
        chosen: bool,
        behind: Option<Behind>,
        from: &PerTarget,
    ) -> Action {
        if !matches!(self.pass, PassKind::Sweep(_)) {
            self.pass = PassKind::Sweep(Sweeping::new(ladder));
        }
        let PassKind::Sweep(sweeping) = &mut self.pass else {
            return Action::Stale;
        };
        sweeping.ladder = ladder;
        sweeping.chosen = chosen;
        sweeping.begin(behind, from);
        self.state.wait();
        self.go_on_with_sweep(context)
    }

    /// Goes on with this relay's share of a sweep, as far as one call may.
    pub(super) fn go_on_with_sweep(&mut self, context: &Context<'_>) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweeping) if sweeping.chosen);
        if ALTITUDE && is_chosen && self.chosen.is_none() {
            // First it has to find out where it is to be.
            return Action::Work;
        }
        let link = self.link(context, is_chosen);
        let PassKind::Sweep(sweeping) = &mut self.pass else {
            return Action::Stale;
        };
        if !sweeping.go_on(link) {
            return Action::Work;
        }
        if context.is_last() {
            self.conclude_sweep(context)
        } else {
            Action::Forward
        }
    }

    /// A verdict from the relay after.
    pub(crate) fn on_verdict(&mut self, context: &Context<'_>, answer: &Answer) -> Action {
        let is_chosen = matches!(&self.pass, PassKind::Sweep(sweeping) if sweeping.chosen);
        let link = self.link(context, is_chosen);
        if let PassKind::Sweep(sweeping) = &mut self.pass
            && self.state.awaits(answer.number)
            && sweeping.take(link, answer)
        {
            return self.conclude_sweep(context);
        }
        Action::Stale
    }

    /// The verdict on the current sweep is known.
    pub(super) fn conclude_sweep(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Sweep(sweeping) = &self.pass else {
            return Action::Stale;
        };
        if let Some((x_m, target)) = sweeping.agreed() {
            let chosen = sweeping.chosen;
            if let LeaderTask::Searching { search, given, .. } = &self.task {
                // Of places that may be chosen otherwise it says nothing.
                let most = search.most(&sweeping.verdict.slacks);
                self.bound = most.filter(|_| !chosen && !given);
            }
            let at = self.station_for(chosen).at;
            self.stand_at(at.at(x_m), at);
            self.target = Some(target);
            if let LeaderTask::Searching { search, .. } = &mut self.task
                && !search.accept(target)
            {
                self.state.answer();
                return Action::Work;
            }
            return self.agree(context);
        }
        self.state.answer();
        if self.gathers(context) {
            return Action::Work;
        }
        let LeaderTask::Searching { search, .. } = &mut self.task else {
            return Action::Answer { agreed: false };
        };
        let verdict = &sweeping.verdict;
        let next = match search.refused(context.mission(), verdict) {
            Some(target) => {
                let most = search.most(&verdict.slacks);
                search.refuse(context.mission(), self.profile, target, most)
            }
            None => search.advance(&verdict.slacks),
        };
        if next.is_err() {
            let chosen = matches!(&self.pass, PassKind::Sweep(sweeping) if sweeping.chosen);
            if !chosen || self.search_given(context).is_err() {
                return self.give_up();
            }
        }
        Action::Work
    }

    /// The chain has agreed on a target. The leader may have more in mind.
    pub(super) fn agree(&mut self, context: &Context<'_>) -> Action {
        self.state.hold();
        if let LeaderTask::Searching { last: false, .. } = self.task {
            match context.settings().method {
                Method::Adjust(adjust) if ADJUST => {
                    self.task.adjust(adjust);
                    self.state.answer();
                    return Action::Work;
                }
                Method::Joint if self.gathers(context) => {
                    self.state.answer();
                    return Action::Work;
                }
                _ => {}
            }
        }
        self.task.rest();
        Action::Answer { agreed: true }
    }
}
