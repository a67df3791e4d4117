//! Collection of the relays' profiles for the joint method.
//!
//! A profile is a relay's altitude and power. A roster has room for a few profiles. A relay whose profile differs from
//! the mission's common one appends it while there is room. The result of the pass informs all relays. After a full
//! roster the next pass continues with the relay after the roster's last one.
//!
//! Then each relay solves the whole chain without further messages, and uses its position in the solution.

use super::computation::{Computation, JointPlace, LeaderTask, PassKind, Seats};
use super::state::Action;
use crate::node::context::Context;
use crate::optimiser::joint::Seat;
use crate::optimiser::joint::fitted::SlotShares;
use crate::optimiser::ladder::Ladder;
use crate::optimiser::pass::Link;
use crate::optimiser::search::Infeasible;
use crate::wire::message::{OwnSeat, OwnSeats, Roster};
use core::task::Poll;

impl Computation {
    /// Returns this relay's profile: its power, and its possible lateral offsets and altitudes.
    pub(super) fn seat(&self, context: &Context<'_>) -> Seat {
        let holds = context.settings().hold_altitude;
        Seat::of(context.mission(), self.profile, holds)
    }

    /// Returns true if this relay's power or altitudes differ from the mission's common profile.
    pub(super) fn has_own_profile(&self, context: &Context<'_>) -> bool {
        self.seat(context) != Seat::common(context.mission())
    }

    /// Returns true if the leader must collect profiles (altitude and power) next. This is necessary if a relay's
    /// profile differs from the common one, and not all profiles are known.
    pub(super) fn must_gather(&self, context: &Context<'_>) -> bool {
        let told = matches!(&self.pass, PassKind::Sweep(sweep_pass) if sweep_pass.own);
        let leads = context.index() == context.mission().leader();
        leads
            && context.solves_jointly()
            && match self.seats.known {
                None => told || self.has_own_profile(context),
                Some(known) => known < context.mission().relays(),
            }
    }

    /// Starts a pass along the chain that collects the relays' profiles (altitude and power). Only a profile that
    /// differs from the mission's common one is added to the message.
    pub(super) fn begin_gathering(&mut self, context: &Context<'_>) -> Action {
        let after = self.seats.known.unwrap_or(0);
        self.gather(context, after, OwnSeats::new())
    }

    /// Handles a message from the previous relay that collects the relays' profiles.
    pub(crate) fn on_gather(&mut self, context: &Context<'_>, roster: &Roster) -> Action {
        let own = context.index();
        let same = matches!(&self.pass, PassKind::Gather(known) if known.after == roster.after
            && known.seats.iter().take_while(|seat| seat.index < own).eq(&roster.seats));
        let arrival = self.state.arrival(roster.number, same);
        if let Some(next) = arrival.refused() {
            return next;
        }
        let before = roster.seats.last().is_none_or(|seat| seat.index < own);
        if context.mission().interferer().is_none() || !before {
            return Action::Stale;
        }
        if roster.after > 0 && self.seats.known != Some(roster.after) {
            // This relay has missed the message that had the earlier profiles.
            return Action::Foreign;
        }
        self.state.accept(roster.number);
        self.gather(context, roster.after, roster.seats.clone())
    }

    fn gather(&mut self, context: &Context<'_>, after: u16, mut seats: OwnSeats) -> Action {
        let index = context.index();
        if after == 0 {
            // All profiles are unknown until the result arrives.
            self.seats = Seats::UNKNOWN;
            self.seats.known = Some(0);
        }
        if index > after && self.has_own_profile(context) {
            let holds = context.settings().hold_altitude;
            // If the roster is full, the next pass continues with this relay.
            _ = seats.push(OwnSeat {
                index,
                held_m: if holds { self.profile.altitude_m } else { 0.0 },
                power_w: self.profile.power_w,
            });
        }
        self.pass = PassKind::Gather(Roster {
            number: self.state.number(),
            view_digest: context.digest(),
            after,
            seats,
        });
        self.state.wait();
        if context.is_last_of_view() {
            return self.conclude_gathering(context);
        }
        Action::Forward
    }

    /// Handles the result of the collection of profiles, received from the next relay.
    pub(crate) fn on_gathered(&mut self, context: &Context<'_>, roster: &Roster) -> Action {
        let relays = context.mission().relays();
        if let PassKind::Gather(known) = &mut self.pass
            && self.state.is_awaited(roster.number)
            && roster.after == known.after
            && roster.seats.starts_with(&known.seats)
            && roster.seats.last().is_none_or(|seat| seat.index <= relays)
        {
            known.seats.clone_from(&roster.seats);
            return self.conclude_gathering(context);
        }
        Action::Stale
    }

    fn conclude_gathering(&mut self, context: &Context<'_>) -> Action {
        let PassKind::Gather(roster) = &self.pass else {
            return Action::Stale;
        };
        self.state.answer();
        if self.seats.adopt(roster, context.mission().relays()) {
            // The chain has to be solved again with the complete profiles.
            self.task.clear();
            self.joint_place = None;
        }
        if context.index() == context.mission().leader() {
            return Action::ContinueWithoutReply;
        }
        Action::Answer { agreed: false }
    }

    /// Returns true while this relay still has to compute the chain's positions by the joint method. The joint method
    /// optimises x, lateral offset and altitude of all relays together. False while the profiles of some relays are
    /// missing.
    pub(super) fn is_solving(&self, context: &Context<'_>) -> bool {
        let partial = self.seats.is_partial(context.mission().relays());
        context.solves_jointly() && self.joint_place.is_none() && !partial
    }

    /// Continues the joint solution (positions of all relays) until the leader's next message arrives.
    pub(super) fn solve_ahead(&mut self, context: &Context<'_>) -> Action {
        if self.is_solving(context) {
            _ = self.solve(context);
            return Action::Continue;
        }
        Action::Nothing
    }

    pub(super) fn link<'a>(&self, context: &Context<'a>, chosen: bool) -> Link<'a> {
        let there = self.joint_place.filter(|_| chosen);
        let fitted = self.fitted.first().filter(|_| there.is_some());
        let fixed_m = fitted.and_then(|fitted| fitted.solved);
        Link {
            mission: context.mission(),
            behind: None,
            index: context.index(),
            own: self.station_for(chosen),
            measured_per_w: self.meter.published(),
            plain: chosen && there.is_none_or(|there| there.plain),
            end_m: there.map(|there| there.end_m),
            fixed_m: fixed_m.map(|(x_m, _)| x_m),
        }
    }

    /// Continues this relay's computation of all relays' positions by the joint method. Returns the predicted target
    /// SIR of the chain, linear, once the computation is complete; `None` before.
    ///
    /// If the joint method finds no positions, this relay uses its configured lateral offset and altitude, and the
    /// function returns 0.
    #[inline(never)]
    pub(super) fn solve(&mut self, context: &Context<'_>) -> Option<f32> {
        let mission = context.mission();
        let is_new = !matches!(self.task, LeaderTask::Solving(_));
        if is_new {
            self.task.solve();
        }
        let LeaderTask::Solving(chain) = &mut self.task else {
            return None;
        };
        if is_new && !chain.begin(mission) {
            self.task.clear();
            self.choose_configured(context);
            return Some(0.0);
        }
        let seats = &self.seats;
        let seat_of = |index| seats.of(mission, index);
        let Poll::Ready(solved) = chain.step(mission, seat_of) else {
            return None;
        };
        let index = context.index();
        let target = if let Ok(target) = solved {
            let end_m = chain.end_m(mission, &seat_of, index);
            let fitted = chain.fitted(mission, &seat_of, index);
            let (solved, plain) = match fitted {
                Some((at, _)) => (at.cross_section(), true),
                None => (chain.at(index, seat_of(index)), !chain.holds_back()),
            };
            // The solver used the common profile if this relay's own profile has not been collected yet.
            let cross_section = self.seat(context).room.nearest(solved);
            let fitted = fitted.map(|(at, shares)| (at.x_m, shares));
            self.joint_place = Some(JointPlace {
                cross_section,
                end_m,
                plain,
            });
            self.set_fitted(fitted);
            target
        } else {
            self.choose_configured(context);
            0.0
        };
        self.task.clear();
        Some(target)
    }

    fn set_fitted(&mut self, solved: Option<(f32, SlotShares)>) {
        if let Some(fitted) = self.fitted.first_mut() {
            fitted.solved = solved;
        }
    }

    fn choose_configured(&mut self, context: &Context<'_>) {
        self.set_fitted(None);
        self.joint_place = Some(JointPlace {
            cross_section: self
                .seat(context)
                .room
                .nearest(self.profile.on_line().cross_section),
            end_m: context.mission().end_for(context.index(), 0.0),
            plain: true,
        });
    }

    /// Starts the leader's search for the highest target SIR after the joint solution. The relays use the lateral
    /// offsets and altitudes of this solution. The first targets are near `target` (linear) if `target` is above 0 and
    /// `Settings::predict` is true. Otherwise they are those of a search without a prediction.
    pub(super) fn search_joint_place(
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
}
