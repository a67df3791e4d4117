//! A relay's share of the joint method: where it is to be by its own solution of the chain, and of a course where relays hold what
//! the mission does not say.

use core::task::Poll;

use super::core::{Chosen, Own, Pass, Share};
use super::state::Next;
use super::task::{Chain, Lead, MOST_SOLVED};
use crate::optimiser::joint::ascent::{Ascent, AscentStep as Turn};
use crate::optimiser::joint::course::{Courser, Coursing};
use crate::optimiser::joint::trial::{Bar, Trials};
use crate::optimiser::joint::{Outlook, Seat};
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Link;
use crate::optimiser::search::Infeasible;
use crate::wire::message::{Course, Worth};

impl Share {
    /// Whether this relay differs from what the mission says of all.
    pub(super) fn differs(&self, own: Own<'_>) -> bool {
        let common = own.mission.config().common;
        self.profile != common || own.settings.hold_altitude
    }

    /// Whether the leader has to go on by messages: a relay differs, or nobody could solve the whole chain.
    pub(super) fn is_mixed(&self, own: Own<'_>) -> bool {
        let told = matches!(&self.pass, Pass::Sweep(sweeping) if sweeping.own);
        told || self.differs(own) || usize::from(own.mission.relays()) > MOST_SOLVED
    }

    /// What this relay brings along.
    fn seat(&self, own: Own<'_>) -> Seat {
        Seat::of(own.mission, self.profile, own.settings.hold_altitude)
    }

    /// Whether it has still to find out where it is to be.
    pub(super) fn is_solving(&self, own: Own<'_>) -> bool {
        own.joins() && self.chosen.is_none()
    }

    /// Goes on with the chain's solution while there is nothing else to do.
    pub(super) fn think(&mut self, own: Own<'_>) -> Next {
        if self.is_solving(own) {
            _ = self.solve(own);
            return Next::Think;
        }
        Next::Nothing
    }

    /// What this relay is on a sweep.
    pub(super) fn link<'a>(&self, own: Own<'a>, chosen: bool) -> Link<'a> {
        Link {
            mission: own.mission,
            behind: None,
            index: own.index,
            own: self.station_for(chosen),
            measured_per_w: own.measured_per_w,
            plain: false,
            end_m: self.chosen.filter(|_| chosen).map(|chosen| chosen.end_m),
        }
    }

    /// Solves some more of the chain as if all relays were alike; the target, linear SIR, once this relay knows where it is to be.
    ///
    /// Where that is not to be had, it stays where it was given to be, and the target says nothing.
    pub(super) fn solve(&mut self, own: Own<'_>) -> Option<f32> {
        let seat = Seat::common(own.mission);
        if !matches!(self.lead, Lead::Solving(_)) {
            let Some(chain) = Chain::new(own.mission) else {
                self.choose_given(own);
                return Some(0.0);
            };
            self.lead = Lead::Solving(chain);
        }
        let Lead::Solving(chain) = &mut self.lead else {
            return None;
        };
        let Poll::Ready(solved) = chain.step(own.mission, |_| seat) else {
            return None;
        };
        let target = if let Ok(target) = solved {
            let end_m = chain.end_m(own.mission, &|_| seat, own.index);
            let at = chain.at(own.index, seat);
            let at = self.seat(own).room.nearest(at);
            self.chosen = Some(Chosen { at, end_m });
            target
        } else {
            self.choose_given(own);
            0.0
        };
        self.lead = Lead::No;
        Some(target)
    }

    fn choose_given(&mut self, own: Own<'_>) {
        self.chosen = Some(Chosen {
            at: self.seat(own).room.nearest(self.profile.on_line().at),
            end_m: own.mission.end_for(own.index, 0.0),
        });
    }

    /// The leader goes over to sweeps at the places chosen, about `target` if that is known.
    pub(super) fn search_chosen(&mut self, own: Own<'_>, target: f32) -> Result<(), Infeasible> {
        let ladder = (target > 0.0 && own.settings.predict).then(|| {
            let gap = own.mission.config().tolerance / 4.0;
            Ladder::around(target * 1.000_001, gap, target * 0.5, target * 2.0)
        });
        self.search_with(own, ladder, false)
    }

    /// The leader begins the joint method by messages, from the chain that was agreed on for `target`.
    pub(super) fn begin_ascent(&mut self, own: Own<'_>, target: f32) {
        let distance_m = own.mission.config().distance_m;
        let sigma = libm::logf(target);
        self.lead = Lead::Ascending(Ascent::new(distance_m, sigma, 0.0, f32::NEG_INFINITY));
        self.pass = Pass::Course(Coursing::new(Bar::FIRST));
    }

    fn courser<'a>(&self, own: Own<'a>, power_in_w: Option<f32>) -> Courser<'a> {
        Courser {
            mission: own.mission,
            power_w: self.profile.power_w,
            gain_in: power_in_w.map_or(own.mission.tx_gain(), |power_w| {
                own.mission.relay_gain(power_w)
            }),
            first: power_in_w.is_none(),
            room: self.seat(own).room,
        }
    }

    /// The leader sends the trials of `ascent`.
    pub(super) fn set_course(&mut self, own: Own<'_>, ascent: Ascent) -> Next {
        let (bar, told) = ascent.course();
        self.take_course(own, None, bar, &told)
    }

    /// A course from the relay before.
    pub(crate) fn on_course(&mut self, own: Own<'_>, course: &Course) -> Next {
        let same = matches!(&self.pass, Pass::Course(coursing) if coursing.told == course.trials);
        let arrival = self.exchange.arrival(course.number, same);
        if let Some(next) = arrival.refused(self.exchange) {
            return next;
        }
        if own.mission.interferer().is_none() {
            return Next::Stale;
        }
        if self.chosen.is_none() {
            // It was not there when the places to begin with were agreed on.
            return Next::Foreign;
        }
        self.exchange.take(course.number);
        self.take_course(own, Some(course.power_w), course.bar, &course.trials)
    }

    fn take_course(
        &mut self,
        own: Own<'_>,
        power_in_w: Option<f32>,
        bar: Bar,
        told: &Trials,
    ) -> Next {
        let begins = bar.begins();
        if begins || !matches!(self.pass, Pass::Course(_)) {
            self.pass = Pass::Course(Coursing::new(bar));
        }
        let relay = self.courser(own, power_in_w);
        let wanted = self.station_for(true).at;
        let Pass::Course(coursing) = &mut self.pass else {
            return Next::Stale;
        };
        self.exchange.wait();
        coursing.power_in_w = power_in_w;
        coursing.take(relay, bar, told, wanted);
        if own.is_last() {
            let (trial, slack_m, outlook) = coursing.close(relay);
            return self.conclude_course(own, trial, slack_m, &outlook);
        }
        Next::Forward { moved: false }
    }

    /// What came of the course, from the relay after.
    pub(crate) fn on_worth(&mut self, own: Own<'_>, worth: &Worth) -> Next {
        if let Pass::Course(coursing) = &self.pass
            && self.exchange.awaits(worth.number)
            && coursing.has(worth.trial)
        {
            return self.conclude_course(own, worth.trial, worth.slack_m, &worth.outlook);
        }
        Next::Stale
    }

    fn conclude_course(
        &mut self,
        own: Own<'_>,
        trial: Option<u8>,
        slack_m: f32,
        after: &Outlook,
    ) -> Next {
        let Pass::Course(coursing) = &self.pass else {
            return Next::Stale;
        };
        let relay = self.courser(own, coursing.power_in_w);
        let Pass::Course(coursing) = &mut self.pass else {
            return Next::Stale;
        };
        let outlook = coursing.conclude(relay, trial, after);
        if let (Some(at), Some(chosen)) = (coursing.at(), &mut self.chosen) {
            chosen.at = at;
        }
        self.worth = Some((trial, slack_m, outlook));
        self.exchange.answer();
        let Lead::Ascending(ascent) = &mut self.lead else {
            return Next::Answer {
                moved: false,
                agreed: false,
            };
        };
        match ascent.heard(trial, slack_m, &outlook) {
            Turn::Over => {
                let target = libm::expf(ascent.estimate());
                if self.search_last(own, target).is_err() {
                    return self.give_up();
                }
            }
            Turn::Try { .. } | Turn::Raise | Turn::Again => {}
        }
        Next::Work { moved: false }
    }

    /// The leader has the chain agree on what the ascent came to.
    fn search_last(&mut self, own: Own<'_>, target: f32) -> Result<(), Infeasible> {
        let gap = own.mission.config().tolerance / 4.0;
        let ladder = Ladder::around(target, gap, target * 0.5, target * 2.0);
        self.search_with(own, Some(ladder), true)
    }
}
