//! Sensing pass: collects measurements, and distributes the leader's estimate of the interference.
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
use crate::node::context::PAUSE;
use crate::node::context::{Context, Member, Sensed};
use crate::node::sample::Sample;
use crate::place::Placement;
use crate::sensing::Listen;
use crate::sensing::doubt::{Next, Trial, is_absurd, is_deaf, is_off};
use crate::sensing::estimate::{InterferenceEstimate, Knowledge, NumberedEstimate, Spread, review};
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::sums::{Average, Listener, left};
use crate::sensing::sums::{EndsOff, Level, Levels, Sums, UNIT_W, is_level, terms};
use crate::side::Side;
use crate::time::{Duration, Instant};
use crate::wire::message::Heard;

/// Maximum interval between collections of measurements, as a multiple of [`Listen::every`].
const RAREST: u32 = 64;

/// Number of sensing passes without a change of the estimate after which their interval doubles. A sensing pass is a
/// message along the chain that collects measurements.
const PATIENCE: u8 = 4;

/// Number of sensing passes per `Listen::every` in the leader's search for a faulty sensor. A sensing pass is a
/// message along the chain that collects measurements.
const TRIALS_A_PERIOD: u64 = 8;

/// Number of consecutive measurements at or below the noise after which a sensor may be faulty.
const SILENT: u8 = 8;

impl Computation {
    /// Returns true if the relays estimate the interference by measurements.
    pub(super) fn is_sensing_enabled(context: &Context<'_>) -> bool {
        SENSING && context.settings().listen.is_some() && context.mission().field().is_none()
    }

    /// Returns true if the leader must distribute its interference estimate before any other pass.
    pub(super) fn must_distribute(&self, context: &Context<'_>) -> bool {
        Self::is_sensing_enabled(context)
            && context.leads()
            && self
                .sensing
                .sensor()
                .is_some_and(|sensor| !sensor.is_distributed)
    }

    /// Returns true at a leader that may start a sensing pass, which collects measurements. The chain must have
    /// agreed, or have no feasible target.
    pub(super) fn may_sense(&self, context: &Context<'_>) -> bool {
        let settled = matches!(self.state.phase(), Phase::Holding | Phase::Infeasible);
        Self::is_sensing_enabled(context) && context.leads() && settled
    }

    /// Starts the timer of the next pass that collects measurements, if this relay may start one.
    pub(super) fn schedule_sensing(&mut self, context: &Context<'_>) {
        if let Some(listen) = context.settings().listen
            && self.may_sense(context)
            && let Some(sensor) = self.sensing.sensor_mut()
            && sensor.at.is_none()
        {
            sensor.at = Some(context.now + listen.every.times(sensor.wait));
        }
    }

    /// Starts a sensing pass at the leader: a message along the chain that collects all measurements.
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

    /// Handles a pass that collects measurements (sensing pass), received from the previous relay.
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
            // Another estimate means other positions.
            sensor.estimate = hearing.estimate;
            self.task.clear();
            self.chosen = None;
        }
        let mission = context.mission();
        // The second exclusion in a row is final.
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
        if context.is_last() {
            hearing.receiver = sensor.level(&sensor.receiver, context.now);
        }
        self.pass = PassKind::Sense(Sense {
            hearing,
            from,
            own,
            holds,
        });
        self.state.wait();
        if context.is_last() {
            if let PassKind::Sense(sense) = &mut self.pass {
                sense.hearing.sums = Sums::NONE;
            }
            return self.conclude_sense(context);
        }
        Action::Forward
    }

    /// Handles the result of a pass that collects measurements (sensing pass), from the next relay.
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
        if !context.leads() {
            return Action::Answer { agreed: false };
        }
        if holds && self.continue_trial(context, &hearing) {
            return Action::Settled;
        }
        if holds && !self.review_estimate(context, &hearing) {
            if let Some(sensor) = self.sensing.sensor_mut() {
                sensor.kept = (sensor.kept + 1) % PATIENCE;
                if sensor.kept == 0 {
                    sensor.wait = (2 * sensor.wait).min(RAREST);
                }
            }
            return Action::Settled;
        }
        self.state.plan();
        Action::Work
    }

    /// Continues the leader's search for a faulty sensor with the measurements collected by a sensing pass. Returns
    /// true if the search needs another pass; the estimate then stays as it is.
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

    /// Computes a new interference estimate from the result of a sensing pass. Returns true if the estimate has
    /// changed and must be distributed.
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
            // All three spreads have failed; relays that learn nothing shall move less and less often.
            InterferenceEstimate::Unknown(Spread::Even) => (2 * sensor.wait).min(RAREST),
            InterferenceEstimate::Unknown(_) => sensor.wait,
            _ => 1,
        };
        self.task.clear();
        self.chosen = None;
        true
    }

    /// Checks this relay's sensor by comparison with the measurements of all other relays.
    ///
    /// A relay whose measurement is absurd excludes itself. A relay that measures nothing where the others expect
    /// interference is marked as deaf. A relay that excluded itself earlier checks if its measurements fit again.
    /// Unless it excludes itself now, it adds its own sums to the result.
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

/// Maximum distance of a measurement from Tx in each coordinate, in units of the distance Tx to Rx.
const FARTHEST: f32 = 100.0;

/// Sensing state of a relay; the array is empty without the feature `sensing`.
#[derive(Clone, Debug)]
pub(crate) struct Sensing([SensorState; SENSING as usize]);

/// Measurements of a relay, its interference estimate, and its knowledge of faulty sensors.
#[expect(clippy::struct_excessive_bools, reason = "each for itself")]
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorState {
    pub(super) listener: Listener,
    pub(super) estimate: NumberedEstimate,
    /// Average of the interference power that Tx, on the ground, has reported to this relay.
    pub(super) transmitter: Average,
    /// Average of the interference power that Rx, on the ground, has reported to this relay.
    pub(super) receiver: Average,
    /// True while this relay withholds its measurements, because they contradict those of the other nodes.
    pub(super) off: bool,
    /// Node whose measurements were left out of the last sensing pass; 0 for none. A sensing pass collects
    /// measurements.
    pub(super) left_out: u16,
    /// Node whose sensor was found faulty, by the leader or by the node itself; 0 for none.
    pub(super) named: u16,
    /// State of the leader's search for a faulty sensor. It leaves out one relay's measurements after the other.
    pub(super) trial: Trial,
    /// Ground stations (Tx, Rx) whose measurements contradict those of the relays. Known at the leader only.
    pub(super) ends: EndsOff,
    /// True if the last collected measurements contradict each other, and the faulty sensor was not found.
    pub(super) contradicted: bool,
    /// True if this relay measures nothing where the other relays' measurements predict interference.
    pub(super) deaf: bool,
    /// Number of consecutive measurements of this relay that were at or below the receiver's noise.
    pub(super) silent: u8,
    /// Position of the last measurement at or below the receiver's noise.
    pub(super) silent_at: Placement,
    /// True once the relays of the view have received the current estimate; at the leader only.
    pub(super) is_distributed: bool,
    /// Amount and expected error of the measurements from which the current estimate was made.
    pub(super) known: Knowledge,
    /// Reason why the last collected measurements gave no estimate; `None` if they gave one.
    pub(super) unfit: Option<Unfit>,
    /// Interval between two collections of measurements along the chain, as a multiple of `Listen::every`.
    pub(super) wait: u32,
    /// Number of consecutive sensing passes that did not change the estimate, modulo [`PATIENCE`]. A sensing pass
    /// collects measurements.
    pub(super) kept: u8,
    /// Time of the next sensing pass, which collects measurements; `None` if none is scheduled.
    pub(super) at: Option<Instant>,
}

/// Estimate before any measurement: the interference that the mission configures.
const AS_LOADED: NumberedEstimate = NumberedEstimate {
    number: 0,
    estimate: InterferenceEstimate::Mission,
};

impl Sensing {
    pub(super) const fn new(listen: Option<Listen>, now: Instant) -> Self {
        let half_life = match listen {
            Some(listen) => listen.half_life,
            None => Duration::from_micros(0),
        };
        let sensor = SensorState {
            listener: Listener::new(half_life, now),
            estimate: AS_LOADED,
            transmitter: Average::NONE,
            receiver: Average::NONE,
            off: false,
            left_out: 0,
            named: 0,
            trial: Trial::NONE,
            ends: EndsOff::NONE,
            contradicted: false,
            deaf: false,
            silent: 0,
            silent_at: Placement::on_line(0.0, 0.0),
            is_distributed: false,
            known: Knowledge::NOTHING,
            unfit: None,
            wait: 1,
            kept: 0,
            at: None,
        };
        Self([sensor; SENSING as usize])
    }

    pub(super) const fn sensor(&self) -> Option<&SensorState> {
        let sensors: &[SensorState] = &self.0;
        sensors.first()
    }

    pub(super) const fn sensor_mut(&mut self) -> Option<&mut SensorState> {
        let sensors: &mut [SensorState] = &mut self.0;
        sensors.first_mut()
    }

    /// Resets the sensing for a new view, in which the leader first distributes its estimate to all relays.
    pub(super) const fn renew(&mut self) {
        if let Some(sensor) = self.sensor_mut() {
            sensor.is_distributed = false;
            sensor.at = None;
            sensor.trial = Trial::NONE;
        }
    }

    /// Handles a new mission: the interference that it configures becomes the estimate.
    pub(super) const fn load(&mut self) {
        if let Some(sensor) = self.sensor_mut() {
            sensor.estimate.estimate = InterferenceEstimate::Mission;
            sensor.estimate.number = sensor.estimate.number.wrapping_add(1);
            // Its ground ends may be at other places.
            sensor.transmitter = Average::NONE;
            sensor.receiver = Average::NONE;
            sensor.known = Knowledge::NOTHING;
            sensor.ends = EndsOff::NONE;
            sensor.wait = 1;
        }
    }

    pub(super) fn next_timeout(&self) -> Option<Instant> {
        self.sensor()?.at
    }

    /// Returns true if the next sensing pass, which collects measurements, is due. Stops its timer.
    pub(super) fn poll_due(&mut self, now: Instant) -> bool {
        self.sensor_mut()
            .is_some_and(|sensor| sensor.at.take_if(|at| *at <= now).is_some())
    }

    pub(crate) const fn estimate(&self) -> NumberedEstimate {
        match self.sensor() {
            Some(sensor) => sensor.estimate,
            None => AS_LOADED,
        }
    }

    /// Returns the reason why the last measurements gave no estimate. `None` if they gave one, and at other relays
    /// than the leader.
    pub(crate) const fn unfit(&self) -> Option<Unfit> {
        match self.sensor() {
            Some(sensor) => sensor.unfit,
            None => None,
        }
    }

    /// Returns the mean interference power that the ground station at `side` has reported, W. `None` without a
    /// report.
    pub(crate) fn level_w(&self, side: Side) -> Option<f32> {
        let sensor = self.sensor()?;
        let level_w = match side {
            Side::Upstream => sensor.transmitter.mean,
            Side::Downstream => sensor.receiver.mean,
        };
        (level_w > 0.0).then_some(level_w)
    }

    pub(super) fn findings(&self) -> Findings {
        Findings {
            estimate: self.estimate(),
            unfit: self.unfit(),
            off: self.sensor().map_or(0, |sensor| sensor.named),
            ends: self.sensor().map_or(EndsOff::NONE, |sensor| sensor.ends),
            deaf: self.sensor().is_some_and(|sensor| sensor.deaf),
        }
    }

    pub(super) fn add_sample(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        self.sensor_mut()
            .is_some_and(|sensor| sensor.add_sample(now, member, sample))
    }
}

impl SensorState {
    /// Returns the interference level at a ground station at `now`, from the `average` of its reports. Older reports
    /// have less weight in an estimate.
    pub(super) fn level(&self, average: &Average, now: Instant) -> Level {
        let age = now.since(average.last);
        Level {
            power_w: average.mean,
            count: average.weight * left(age, self.listener.half_life()),
        }
    }

    fn add_sample(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        let noise_w = member.mission.config().noise_w;
        // Subtracts the receiver's noise; `None` if the rest is out of range.
        let heard = |power_w: f32| {
            let heard_w = power_w - noise_w;
            is_level(heard_w).then_some(heard_w)
        };
        let half_life = self.listener.half_life();
        match sample {
            Sample::Heard { at, power_w } if is_near(at, member.mission.config().distance_m) => {
                let Some(heard_w) = heard(power_w) else {
                    if power_w >= 0.0 && power_w <= noise_w {
                        self.silent = self.silent.saturating_add(1);
                        self.silent_at = at;
                    }
                    return false;
                };
                (self.silent, self.deaf) = (0, false);
                let distance_m = member.mission.config().distance_m;
                let expected = expected_at(&member.mission);
                self.listener
                    .add(now, distance_m, at, heard_w / UNIT_W, expected);
                true
            }
            Sample::Transmitter { power_w } => {
                take_level(&mut self.transmitter, now, half_life, heard(power_w))
            }
            Sample::Receiver { power_w } => {
                take_level(&mut self.receiver, now, half_life, heard(power_w))
            }
            _ => false,
        }
    }
}

/// State of one relay in a sensing pass, a message along the chain that collects measurements.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense {
    pub(super) hearing: Heard,
    /// Sums of measurements over all earlier relays of the pass, as received from the previous relay.
    pub(super) from: Sums,
    pub(super) own: Sums,
    /// True if the positions were agreed on with the current estimate. No new agreement is needed then.
    pub(super) holds: bool,
}

/// Sensing results whose changes are reported to the firmware.
#[derive(Clone, Copy, Debug)]
pub(super) struct Findings {
    pub(super) estimate: NumberedEstimate,
    pub(super) unfit: Option<Unfit>,
    /// Node with a faulty sensor, according to the last sensing pass; 0 for none.
    pub(super) off: u16,
    pub(super) ends: EndsOff,
    pub(super) deaf: bool,
}

impl Findings {
    /// Returns the changes from `before` to these findings. A faulty ground station is node 0 (Tx) or node `all` + 1
    /// (Rx), where `all` is the number of relays.
    #[inline(never)] // called from several places
    pub(super) fn since(&self, before: &Self, member: &Member) -> Sensed {
        let off = if self.off != before.off && self.off != 0 {
            Some(self.off)
        } else if self.deaf && !before.deaf {
            Some(member.node)
        } else if self.ends.receiver && !before.ends.receiver {
            Some(member.all.saturating_add(1))
        } else {
            (self.ends.transmitter && !before.ends.transmitter).then_some(0)
        };
        Sensed {
            new_estimate: self.estimate != before.estimate,
            unclear: self.unfit.is_some() && self.unfit != before.unfit,
            faulty_sensor: off,
        }
    }
}

/// Adds the power that a ground station (Tx or Rx) has measured to that station's `average`. Returns false if the
/// power is not above the noise.
///
/// `heard_w` is the measured power less the receiver noise, W; `None` if it is not above the noise.
fn take_level(
    average: &mut Average,
    now: Instant,
    half_life: Duration,
    heard_w: Option<f32>,
) -> bool {
    if let Some(heard_w) = heard_w {
        average.add(now, half_life, heard_w);
    }
    heard_w.is_some()
}

/// Returns true if a measurement at `at` is near enough to Tx to be used. Each coordinate is at most [`FARTHEST`]
/// times `distance_m`, the distance from Tx to Rx.
fn is_near(at: Placement, distance_m: f32) -> bool {
    let far_m = FARTHEST * distance_m;
    [at.x_m, at.y_m, at.altitude_m]
        .iter()
        .all(|metres| (-far_m..=far_m).contains(metres))
}
