//! A relay's share of a sweep (Algorithms 1 and 4), and of its verdict.

use super::core::{ADJUST, ALTITUDE, Own, Pass, Share};
use super::state::Next;
use super::sweeping::{Sweeping, fingerprint};
use super::task::{Lead, Rounds};
use crate::optimiser::PerTarget;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Behind;
use crate::settings::Method;
use crate::wire::message::{Answer, Sweep};

impl Share {
    /// A sweep from the relay before.
    pub(crate) fn on_sweep(&mut self, own: Own<'_>, sweep: &Sweep) -> Next {
        let behind = Behind {
            relay: sweep.relay,
            measured_per_w: sweep.measured_per_w,
        };
        let print = fingerprint(Some(behind), &sweep.reaches);
        let same = matches!(&self.pass, Pass::Sweep(sweeping)
            if sweeping.ladder == sweep.ladder
                && sweeping.chosen == sweep.chosen
                && sweeping.fingerprint == print);
        let arrival = self.exchange.arrival(sweep.number, same);
        if let Some(next) = arrival.refused(self.exchange) {
            return next;
        }
        if sweep.chosen && own.mission.interferer().is_none() {
            return Next::Stale;
        }
        self.exchange.take(sweep.number);
        self.sweep_on(
            own,
            sweep.ladder,
            sweep.chosen,
            Some(behind),
            &sweep.reaches,
        )
    }

    /// Works out this relay's share of a sweep.
    pub(super) fn sweep_on(
        &mut self,
        own: Own<'_>,
        ladder: Ladder,
        chosen: bool,
        behind: Option<Behind>,
        from: &PerTarget,
    ) -> Next {
        if !matches!(self.pass, Pass::Sweep(_)) {
            self.pass = Pass::Sweep(Sweeping::new(ladder));
        }
        let Pass::Sweep(sweeping) = &mut self.pass else {
            return Next::Stale;
        };
        sweeping.ladder = ladder;
        sweeping.chosen = chosen;
        sweeping.begin(behind, from);
        // Of places chosen, a plain pass is of those that courses came to.
        if chosen && !ladder.is_plain() {
            self.begin_again();
        }
        self.exchange.wait();
        self.go_on_with_sweep(own)
    }

    /// Goes on with this relay's share of a sweep, as far as one call may.
    pub(super) fn go_on_with_sweep(&mut self, own: Own<'_>) -> Next {
        let is_chosen = matches!(&self.pass, Pass::Sweep(sweeping) if sweeping.chosen);
        if ALTITUDE && is_chosen && self.chosen.is_none() {
            // First it has to find out where it is to be.
            return Next::Work { moved: false };
        }
        let link = self.link(own, is_chosen);
        let Pass::Sweep(sweeping) = &mut self.pass else {
            return Next::Stale;
        };
        if !sweeping.go_on(link) {
            return Next::Work { moved: false };
        }
        if own.is_last() {
            self.conclude_sweep(own)
        } else {
            Next::Forward { moved: false }
        }
    }

    /// A verdict from the relay after.
    pub(crate) fn on_verdict(&mut self, own: Own<'_>, answer: &Answer) -> Next {
        let is_chosen = matches!(&self.pass, Pass::Sweep(sweeping) if sweeping.chosen);
        let link = self.link(own, is_chosen);
        if let Pass::Sweep(sweeping) = &mut self.pass
            && self.exchange.awaits(answer.number)
            && sweeping.take(link, answer)
        {
            return self.conclude_sweep(own);
        }
        Next::Stale
    }

    /// The verdict on the current sweep is known.
    pub(super) fn conclude_sweep(&mut self, own: Own<'_>) -> Next {
        let Pass::Sweep(sweeping) = &self.pass else {
            return Next::Stale;
        };
        if let Some((x_m, target)) = sweeping.agreed() {
            let chosen = sweeping.chosen;
            if let Lead::Searching { search, given, .. } = &self.lead {
                // Of places that may be chosen otherwise it says nothing.
                let most = search.most(&sweeping.verdict.slacks);
                self.bound = most.filter(|_| !chosen && !given);
            }
            self.at = self.station_for(chosen).at;
            self.setpoint = Some(self.at.at(x_m));
            self.target = Some(target);
            if let Lead::Searching { search, .. } = &mut self.lead
                && !search.accept(target)
            {
                self.exchange.answer();
                return Next::Work { moved: true };
            }
            return self.agree(own);
        }
        self.exchange.answer();
        let Lead::Searching { search, .. } = &mut self.lead else {
            return Next::Answer {
                moved: false,
                agreed: false,
            };
        };
        let verdict = &sweeping.verdict;
        let next = match search.refused(own.mission, verdict) {
            Some(target) => {
                let most = search.most(&verdict.slacks);
                search.refuse(own.mission, self.profile, target, most)
            }
            None => search.advance(&verdict.slacks),
        };
        if next.is_err() {
            let chosen = matches!(&self.pass, Pass::Sweep(sweeping) if sweeping.chosen);
            if !chosen || self.search_given(own).is_err() {
                return self.give_up();
            }
        }
        Next::Work { moved: false }
    }

    /// The chain has agreed on a target. The leader may have more in mind.
    pub(super) fn agree(&mut self, own: Own<'_>) -> Next {
        self.exchange.hold();
        if let Lead::Searching { last: false, .. } = self.lead
            && let Some(target) = self.target
        {
            match own.settings.method {
                Method::Adjust(adjust) if ADJUST => {
                    self.lead = Lead::Adjusting(Rounds::new(adjust));
                    self.exchange.answer();
                    return Next::Work { moved: true };
                }
                Method::Joint if own.joins() && self.is_mixed(own) => {
                    self.begin_ascent(own, target);
                    self.exchange.answer();
                    return Next::Work { moved: true };
                }
                _ => {}
            }
        }
        self.lead = Lead::No;
        Next::Answer {
            moved: true,
            agreed: true,
        }
    }
}
