//! A relay's share of the joint method: where it is to be by its own solution of the chain, and of a course where relays hold what
//! the mission does not say.

use core::task::Poll;

use super::computation::{Chosen, Computation, PassKind};
use super::state::Action;
use super::task::{ChainSolver, LeaderTask, MOST_SOLVED};
use crate::mission::Mission;
use crate::node::context::Context;
use crate::optimiser::joint::ascent::{Ascent, AscentStep};
use crate::optimiser::joint::course::{Courser, Coursing};
use crate::optimiser::joint::trial::{Bar, Trials};
use crate::optimiser::joint::{Outlook, Seat};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Link;
use crate::optimiser::search::Infeasible;
use crate::wire::message::{Course, Worth};

impl Computation {
    /// Whether this relay differs from what the mission says of all.
    pub(super) fn differs(&self, context: &Context<'_>) -> bool {
        let common = context.mission().config().common;
        self.profile != common || context.settings().hold_altitude
    }

    /// Whether the leader has to go on by messages: a relay differs, or nobody could solve the whole chain.
    pub(super) fn is_mixed(&self, context: &Context<'_>) -> bool {
        let told = matches!(&self.pass, PassKind::Sweep(sweeping) if sweeping.own);
        told || self.differs(context) || usize::from(context.mission().relays()) > MOST_SOLVED
    }

    /// What this relay brings along.
    fn seat(&self, context: &Context<'_>) -> Seat {
        Seat::of(
            context.mission(),
            self.profile,
            context.settings().hold_altitude,
        )
    }

    /// Whether it has still to find out where it is to be.
    pub(super) fn is_solving(&self, context: &Context<'_>) -> bool {
        context.joins() && self.chosen.is_none()
    }

    /// Goes on with the chain's solution while there is nothing else to do.
    pub(super) fn think(&mut self, context: &Context<'_>) -> Action {
        if self.is_solving(context) {
            _ = self.solve(context);
            return Action::Think;
        }
        Action::Nothing
    }

    /// What this relay is on a sweep.
    pub(super) fn link<'a>(&self, context: &Context<'a>, chosen: bool) -> Link<'a> {
        let there = self.chosen.filter(|_| chosen);
        Link {
            mission: context.mission(),
            behind: None,
            index: context.index(),
            own: self.station_for(chosen),
            measured_per_w: context.measured_per_w,
            plain: chosen && there.is_none_or(|there| there.plain),
            end_m: there.map(|there| there.end_m),
        }
    }

    /// Solves some more of the chain as if all relays were alike; the target, linear SIR, once this relay knows where it is to be.
    ///
    /// Where that is not to be had, it stays where it was given to be, and the target says nothing.
    #[inline(never)]
    pub(super) fn solve(&mut self, context: &Context<'_>) -> Option<f32> {
        let seat = Seat::common(context.mission());
        if !matches!(self.task, LeaderTask::Solving(_)) && !self.begin_solving(context.mission()) {
            self.choose_given(context);
            return Some(0.0);
        }
        let LeaderTask::Solving(chain) = &mut self.task else {
            return None;
        };
        let Poll::Ready(solved) = chain.step(context.mission(), |_| seat) else {
            return None;
        };
        let target = if let Ok(target) = solved {
            let end_m = chain.end_m(context.mission(), &|_| seat, context.index());
            let (at, plain) = (chain.at(context.index(), seat), !chain.holds_back());
            let at = self.seat(context).room.nearest(at);
            self.chosen = Some(Chosen::new(at, end_m, plain));
            target
        } else {
            self.choose_given(context);
            0.0
        };
        self.task.rest();
        Some(target)
    }

    /// Whether the chain can be solved.
    #[inline(never)] // a solver is built here once
    fn begin_solving(&mut self, mission: &Mission) -> bool {
        let Some(chain) = ChainSolver::new(mission) else {
            return false;
        };
        self.task.solve(chain);
        true
    }

    fn choose_given(&mut self, context: &Context<'_>) {
        let at = self.seat(context).room.nearest(self.profile.on_line().at);
        let end_m = context.mission().end_for(context.index(), 0.0);
        self.chosen = Some(Chosen::new(at, end_m, true));
    }

    /// The leader goes over to sweeps at the places chosen, about `target` if that is known.
    pub(super) fn search_chosen(
        &mut self,
        context: &Context<'_>,
        target: f32,
    ) -> Result<(), Infeasible> {
        let ladder = (target > 0.0 && context.settings().predict).then(|| {
            let gap = context.mission().config().tolerance / 4.0;
            Ladder::around(target * 1.000_001, gap, target * 0.5, target * 2.0)
        });
        self.search_with(context, ladder, false)
    }

    /// A sweep of relays that have not been on a course, or a first course: where an earlier one, of a chain that was begun again
    /// since, has moved this one counts no more.
    pub(super) const fn begin_again(&mut self) {
        if let Some(chosen) = &mut self.chosen {
            chosen.begin_again();
        }
    }

    /// The leader begins the joint method by messages, from the chain that was agreed on for `target`.
    pub(super) fn begin_ascent(&mut self, context: &Context<'_>, target: f32) {
        let distance_m = context.mission().config().distance_m;
        let sigma = libm::logf(target);
        self.task
            .ascend(Ascent::new(distance_m, sigma, 0.0, f32::NEG_INFINITY));
        self.pass = PassKind::Course(Coursing::new(Bar::FIRST));
    }

    fn courser<'a>(&self, context: &Context<'a>, power_in_w: Option<f32>) -> Courser<'a> {
        Courser {
            mission: context.mission(),
            power_w: self.profile.power_w,
            gain_in: power_in_w.map_or(context.mission().tx_gain(), |power_w| {
                context.mission().relay_gain(power_w)
            }),
            first: power_in_w.is_none(),
            room: self.seat(context).room,
        }
    }

    /// The leader sends the trials of `ascent`.
    pub(super) fn set_course(&mut self, context: &Context<'_>, ascent: Ascent) -> Action {
        let (bar, told) = ascent.course();
        self.take_course(context, None, bar, &told)
    }

    /// A course from the relay before.
    pub(crate) fn on_course(&mut self, context: &Context<'_>, course: &Course) -> Action {
        let same =
            matches!(&self.pass, PassKind::Course(coursing) if coursing.told == course.trials);
        let arrival = self.state.arrival(course.number, same);
        if let Some(next) = arrival.refused(self.state) {
            return next;
        }
        if context.mission().interferer().is_none() {
            return Action::Stale;
        }
        if self.chosen.is_none() {
            // It was not there when the places to begin with were agreed on.
            return Action::Foreign;
        }
        self.state.take(course.number);
        self.take_course(context, Some(course.power_w), course.bar, &course.trials)
    }

    fn take_course(
        &mut self,
        context: &Context<'_>,
        power_in_w: Option<f32>,
        bar: Bar,
        told: &Trials,
    ) -> Action {
        let begins = bar.begins();
        if begins {
            self.begin_again();
        }
        if begins || !matches!(self.pass, PassKind::Course(_)) {
            self.pass = PassKind::Course(Coursing::new(bar));
        }
        let relay = self.courser(context, power_in_w);
        let wanted = self.station_for(true).at;
        let PassKind::Course(coursing) = &mut self.pass else {
            return Action::Stale;
        };
        self.state.wait();
        coursing.power_in_w = power_in_w;
        coursing.take(relay, bar, told, wanted);
        if context.is_last() {
            let (trial, slack_m, outlook) = coursing.close(relay);
            return self.conclude_course(context, trial, slack_m, &outlook);
        }
        Action::Forward { moved: false }
    }

    /// What came of the course, from the relay after.
    pub(crate) fn on_worth(&mut self, context: &Context<'_>, worth: &Worth) -> Action {
        if let PassKind::Course(coursing) = &self.pass
            && self.state.awaits(worth.number)
            && coursing.has(worth.trial)
        {
            return self.conclude_course(context, worth.trial, worth.slack_m, &worth.outlook);
        }
        Action::Stale
    }

    fn conclude_course(
        &mut self,
        context: &Context<'_>,
        trial: Option<u8>,
        slack_m: f32,
        after: &Outlook,
    ) -> Action {
        let PassKind::Course(coursing) = &self.pass else {
            return Action::Stale;
        };
        let relay = self.courser(context, coursing.power_in_w);
        let PassKind::Course(coursing) = &mut self.pass else {
            return Action::Stale;
        };
        let outlook = coursing.conclude(relay, trial, after);
        coursing.worth = Some((trial, slack_m, outlook));
        if let (Some(at), Some(chosen)) = (coursing.at(), &mut self.chosen) {
            chosen.at = at;
        }
        self.state.answer();
        let LeaderTask::Ascending(ascent) = &mut self.task else {
            return Action::Answer {
                moved: false,
                agreed: false,
            };
        };
        match ascent.heard(trial, slack_m, &outlook) {
            AscentStep::Over => {
                let target = libm::expf(ascent.estimate());
                if self.search_last(context, target).is_err() {
                    return self.give_up();
                }
            }
            AscentStep::Try { .. } | AscentStep::Raise | AscentStep::Again => {}
        }
        Action::Work { moved: false }
    }

    /// The leader has the chain agree on what the ascent came to.
    fn search_last(&mut self, context: &Context<'_>, target: f32) -> Result<(), Infeasible> {
        let gap = context.mission().config().tolerance / 4.0;
        let ladder = Ladder::around(target, gap, target * 0.5, target * 2.0);
        self.search_with(context, Some(ladder.plainly(true)), true)
    }
}
