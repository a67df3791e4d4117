//! Sensing pass: collects measurements along the chain, and distributes the interference estimate.
//!
//! | event at the leader | action |
//! | --- | --- |
//! | new view, or start | send the estimate in a pass; then agree on positions |
//! | positions agreed, and sensing timer expired | collect measurements in a pass; review the estimate |
//! | too few measurements, and all three spreads tried | start again with the even spread; double the period |
//! | better estimate found | increment its number; send it in a pass; then agree on new positions |
//! | inconsistent measurements | start passes that exclude one relay after the other, see [`doubt`](crate::sensing) |
//! | estimate unchanged in four passes | hold positions; double the period, up to 64 times [`Listen::every`](crate::sensing::Listen) |
//!
//! A relay that has missed a sensing pass cannot join the next pass, because the numbers are not consecutive. So all relays that
//! agree on positions have the same estimate.

use super::computation::{Computation, PassKind};
use super::state::{Action, Phase};
use crate::features::SENSING;
use crate::node::context::{Context, PAUSE};
use crate::node::measurement::Sense;
use crate::sensing::doubt::{Next, is_absurd, is_deaf, is_off};
use crate::sensing::estimate::{InterferenceEstimate, NumberedEstimate, Spread, review};
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::sums::{Level, Levels, Sums, terms};
use crate::time::Duration;
use crate::wire::message::Heard;

/// Maximum interval between two sensing passes, as a multiple of [`Listen::every`].
const RAREST: u32 = 64;

/// Number of sensing passes without a change of the estimate after which their interval doubles.
const PATIENCE: u8 = 4;

/// Number of sensing passes per interval `Listen::every` during the search for a faulty sensor.
const TRIALS_A_PERIOD: u64 = 8;

/// Number of consecutive measurements at or below the noise after which a sensor may be faulty.
const SILENT: u8 = 8;

impl Computation {
    /// Returns true if the relays estimate the interference from measurements.
    pub(super) fn is_sensing_enabled(context: &Context<'_>) -> bool {
        SENSING && context.settings().listen.is_some() && context.mission().field().is_none()
    }

    /// Returns true if the leader must distribute its interference estimate to all relays. Until all relays have the
    /// estimate, the leader starts no other pass (message along the chain).
    pub(super) fn must_distribute(&self, context: &Context<'_>) -> bool {
        Self::is_sensing_enabled(context)
            && context.leads_view()
            && self
                .sensing
                .sensor()
                .is_some_and(|sensor| !sensor.is_distributed)
    }

    /// Returns true at a leader that may start a collection of measurements along the chain. The chain must have agreed
    /// on positions, or have found no feasible target.
    pub(super) fn may_sense(&self, context: &Context<'_>) -> bool {
        let settled = matches!(self.state.phase(), Phase::Holding | Phase::Infeasible);
        Self::is_sensing_enabled(context) && context.leads_view() && settled
    }

    /// Starts the timer of the next collection of measurements, if this relay may start one.
    pub(super) fn schedule_sensing(&mut self, context: &Context<'_>) {
        if let Some(listen) = context.settings().listen
            && self.may_sense(context)
            && let Some(sensor) = self.sensing.sensor_mut()
            && sensor.at.is_none()
        {
            sensor.at = Some(context.now + listen.every.times(sensor.wait));
        }
    }

    /// Starts a sensing pass, which collects all measurements along the chain.
    pub(super) fn begin_sense(&mut self, context: &Context<'_>) -> Action {
        let Some(sensor) = self.sensing.sensor_mut() else {
            return Action::Nothing;
        };
        let is_distributed = core::mem::replace(&mut sensor.is_distributed, true);
        let left_out = sensor.trial.left_out();
        let holds = is_distributed && self.state.phase() == Phase::Holding;
        self.begin();
        let hearing = Heard {
            number: self.state.number(),
            view_digest: context.digest(),
            estimate: self.sensing.estimate(),
            sums: Sums::NONE,
            receiver: Level::default(),
            excluded: if holds { left_out } else { 0 },
        };
        self.sense(context, hearing, holds)
    }

    /// Handles a message of a sensing pass, which collects measurements, from the previous relay.
    pub(crate) fn on_sense(&mut self, context: &Context<'_>, hearing: &Heard) -> Action {
        let same = matches!(&self.pass, PassKind::Sense(known)
            if known.hearing.estimate == hearing.estimate && known.from == hearing.sums);
        let arrival = self.state.arrival(hearing.number, same);
        if let Some(next) = arrival.refused() {
            return next;
        }
        if !Self::is_sensing_enabled(context) {
            return Action::Stale;
        }
        let holds =
            self.state.phase() == Phase::Holding && hearing.estimate == self.sensing.estimate();
        self.state.accept(hearing.number);
        self.sense(context, *hearing, holds)
    }

    fn sense(&mut self, context: &Context<'_>, hearing: Heard, holds: bool) -> Action {
        let Some(sensor) = self.sensing.sensor_mut() else {
            return Action::Stale;
        };
        if hearing.estimate != sensor.estimate || !holds {
            // The estimate differs from the previous one, so the positions will change.
            sensor.estimate = hearing.estimate;
            self.task.clear();
            self.joint_place = None;
        }
        let mission = context.mission();
        // A node that is excluded twice in a row stays excluded.
        let twice = hearing.excluded == sensor.left_out;
        sensor.named = if twice { hearing.excluded } else { 0 };
        sensor.left_out = hearing.excluded;
        let is_out = hearing.excluded == context.member.node;
        sensor.off |= twice && is_out;
        let own = if sensor.off || is_out {
            Sums::NONE
        } else {
            let distance_m = mission.config().distance_m;
            sensor
                .listener
                .sums(context.now, distance_m, expected_at(mission))
        };
        let from = hearing.sums;
        let mut hearing = hearing;
        hearing.sums.merge(&own);
        if context.is_last_of_view() {
            hearing.receiver = sensor.level(&sensor.receiver, context.now);
        }
        self.pass = PassKind::Sense(Sense {
            hearing,
            from,
            own,
            holds,
        });
        self.state.wait();
        if context.is_last_of_view() {
            if let PassKind::Sense(sense) = &mut self.pass {
                sense.hearing.sums = Sums::NONE;
            }
            return self.conclude_sense(context);
        }
        Action::Forward
    }

    /// Handles the result of a sensing pass, which collects measurements, from the next relay.
    pub(crate) fn on_sensed(&mut self, context: &Context<'_>, hearing: &Heard) -> Action {
        if let (PassKind::Sense(known), Some(sensor)) = (&mut self.pass, self.sensing.sensor_mut())
            && self.state.is_awaited(hearing.number)
            && hearing.estimate == known.hearing.estimate
        {
            known.hearing.sums = hearing.sums;
            known.hearing.receiver = hearing.receiver;
            if hearing.excluded != known.hearing.excluded {
                known.hearing.excluded = hearing.excluded;
                sensor.named = hearing.excluded;
            }
            return self.conclude_sense(context);
        }
        Action::Stale
    }

    fn conclude_sense(&mut self, context: &Context<'_>) -> Action {
        self.check_receiver(context);
        let PassKind::Sense(Sense { hearing, holds, .. }) = self.pass else {
            return Action::Stale;
        };
        if holds {
            self.state.hold();
        } else {
            self.state.answer();
        }
        if !context.leads_view() {
            return Action::Answer { agreed: false };
        }
        if holds && self.continue_trial(context, &hearing) {
            return Action::EndTask;
        }
        if holds && !self.review_estimate(context, &hearing) {
            if let Some(sensor) = self.sensing.sensor_mut() {
                sensor.kept = (sensor.kept + 1) % PATIENCE;
                if sensor.kept == 0 {
                    sensor.wait = (2 * sensor.wait).min(RAREST);
                }
            }
            return Action::EndTask;
        }
        self.state.plan();
        Action::ContinueWithoutReply
    }

    /// Continues the leader's search for a faulty sensor with the collected measurements. Returns true if the search
    /// needs one more collection. In this case the estimate stays unchanged.
    fn continue_trial(&mut self, context: &Context<'_>, hearing: &Heard) -> bool {
        let (Some(listen), Some(sensor)) = (context.settings().listen, self.sensing.sensor_mut())
        else {
            return false;
        };
        let (relays, nodes) = (context.mission().relays(), context.member.all);
        let next = sensor
            .trial
            .update(&hearing.sums, listen.relative_error, relays, nodes);
        sensor.contradicted = next == Next::Unknown;
        if next == Next::Again {
            let pause = Duration::from_micros(listen.every.as_micros() / TRIALS_A_PERIOD);
            sensor.at = Some(context.now + PAUSE.max(pause));
        }
        next == Next::Again
    }

    /// Computes a new interference estimate from the collected measurements. Returns true if the estimate has changed
    /// and must be distributed.
    fn review_estimate(&mut self, context: &Context<'_>, hearing: &Heard) -> bool {
        let (Some(listen), Some(sensor)) = (context.settings().listen, self.sensing.sensor_mut())
        else {
            return false;
        };
        let levels = Levels {
            transmitter: sensor.level(&sensor.transmitter, context.now),
            receiver: hearing.receiver,
            off: sensor.ends,
        };
        let review = review(
            context.mission(),
            &sensor.estimate.estimate,
            &hearing.sums,
            &levels,
            &listen,
            sensor.known,
            context.now,
        );
        sensor.unfit = match review.unfit {
            None if sensor.contradicted => Some(Unfit::Contradiction),
            unfit => unfit,
        };
        sensor.ends = review.ends;
        sensor.known = review.known;
        let Some(estimate) = review.adopt else {
            return false;
        };
        sensor.estimate = NumberedEstimate {
            number: sensor.estimate.number.wrapping_add(1),
            estimate,
        };
        sensor.is_distributed = false;
        sensor.kept = 0;
        sensor.wait = match estimate {
            // All three spreads have failed. Relays that learn nothing should move less and less often.
            InterferenceEstimate::Unknown(Spread::Even) => (2 * sensor.wait).min(RAREST),
            InterferenceEstimate::Unknown(_) => sensor.wait,
            _ => 1,
        };
        self.task.clear();
        self.joint_place = None;
        true
    }

    /// Compares this relay's sensor with the measurements of all other relays.
    ///
    /// An absurd measurement is far from the estimate and contradicts the other relays' measurements. A relay with such
    /// a measurement excludes itself from the collection. A relay counts as deaf (faulty receiver) if it measures no
    /// interference where the other relays' measurements predict some. A relay that excluded itself earlier checks
    /// whether its measurements now agree with the others. Finally the relay adds the sums over its measurements to the
    /// sums that travel along the chain, unless it has just excluded itself.
    fn check_receiver(&mut self, context: &Context<'_>) {
        let (Some(listen), Some(sensor), PassKind::Sense(sense)) = (
            context.settings().listen,
            self.sensing.sensor_mut(),
            &mut self.pass,
        ) else {
            return;
        };
        let mission = context.mission();
        let distance_m = mission.config().distance_m;
        let mut others = sense.from;
        others.merge(&sense.hearing.sums);
        let place = sensor.listener.place(distance_m);
        let expected = place.and_then(|place| expected_at(mission)(&place.terms));
        let error = listen.relative_error;
        if sensor.off {
            // Measurements at earlier positions may be faulty too.
            sensor.listener.forget_past();
            sensor.off = place.is_some_and(|place| is_off(&others, &place, expected, error));
        } else if place.is_some_and(|place| is_absurd(&others, &place, expected, error)) {
            sensor.off = true;
            sensor.named = context.member.node;
            sense.hearing.excluded = context.member.node;
            return;
        } else if sensor.silent >= SILENT {
            let there = terms(distance_m, sensor.silent_at);
            if place.is_none()
                && is_deaf(
                    &others,
                    &there,
                    mission.config().noise_w,
                    listen.relative_error,
                )
            {
                sensor.deaf = true;
            }
        }
        sense.hearing.sums.merge(&sense.own);
    }
}
