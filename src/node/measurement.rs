//! Measurements of a relay: the interference at its setpoint, and the search for an unknown interferer.
//!
//! The interference at the setpoint is estimated anew at each position, from the number of samples in
//! `Settings::measure`. Until these samples are taken, the estimate of the last position is used. So a relay reports
//! the same value during one agreement.

use crate::features::{FIELD, SENSING};
use crate::field::estimate::{Estimate, Estimator};
use crate::field::is_upsilon;
use crate::mission::Mission;
use crate::node::context::{Member, Sensed};
use crate::place::Placement;
use crate::sample::Sample;
use crate::sensing::Listen;
use crate::sensing::doubt::Trial;
use crate::sensing::estimate::{InterferenceEstimate, Knowledge, NumberedEstimate};
use crate::sensing::fit::{Unfit, expected_at};
use crate::sensing::sums::{Average, Listener, left};
use crate::sensing::sums::{EndsOff, Level, Sums, UNIT_W, is_level};
use crate::settings::Measure;
use crate::side::Side;
use crate::sir::square;
use crate::time::{Duration, Instant};
use crate::wire::message::Heard;

/// Average of the interference samples measured at the setpoint.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meter {
    estimator: Option<(Estimator, u32)>,
    published: Option<f32>,
}

impl Meter {
    pub(crate) const fn new(measure: Option<Measure>) -> Self {
        Self {
            estimator: match measure {
                Some(Measure { i_max_w, samples }) if FIELD => {
                    Some((Estimator::new(i_max_w), samples))
                }
                _ => None,
            },
            published: None,
        }
    }

    /// Adds a sample. Returns true if the sample was accepted. `at` is the setpoint of relay 1, from which the SIR of
    /// the first hop gives the interference; `None` at other relays.
    pub(crate) fn take(
        &mut self,
        mission: &Mission,
        at: Option<Placement>,
        sample: Sample,
    ) -> bool {
        let Some((estimator, wanted)) = self.estimator.as_mut().filter(|_| FIELD) else {
            return false;
        };
        let power_w = match (sample, at) {
            (Sample::Interference { power_w }, _) => power_w,
            (Sample::FirstHop { sir }, Some(at)) => {
                let squared = square(at.x_m) + square(at.y_m) + square(at.altitude_m);
                mission.first_hop_power_w(squared) / sir
            }
            _ => return false,
        };
        let before = estimator.accepted();
        estimator.push(power_w);
        let used = estimator.accepted() > before;
        if used && estimator.accepted() == *wanted {
            let upsilon = estimator.estimate().map(|estimate| estimate.upsilon_per_w);
            // Without a valid estimate the agreed interference is used, because the last estimate belongs to an earlier
            // position.
            self.published = upsilon.filter(|upsilon| is_upsilon(*upsilon));
        }
        used
    }

    /// Discards the samples averaged so far, because the setpoint moves.
    pub(crate) fn restart(&mut self) {
        if let Some((estimator, _)) = &mut self.estimator {
            estimator.clear();
        }
    }

    pub(crate) fn estimate(&self) -> Option<Estimate> {
        self.estimator.as_ref()?.0.estimate()
    }

    pub(crate) const fn published(&self) -> Option<f32> {
        if FIELD { self.published } else { None }
    }
}

/// Maximum distance of a measurement from Tx in each coordinate, in units of the distance Tx to Rx.
const FARTHEST: f32 = 100.0;

/// Sensing state of a relay. Empty without the feature `sensing`.
#[derive(Clone, Debug)]
pub(crate) struct Sensing([SensorState; SENSING as usize]);

/// A relay's measurements, its interference estimate, and its list of faulty sensors.
#[expect(clippy::struct_excessive_bools, reason = "each for itself")]
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorState {
    pub(super) listener: Listener,
    pub(super) estimate: NumberedEstimate,
    /// Average of the interference power measured at Tx on the ground.
    pub(super) transmitter: Average,
    /// Average of the interference power measured at Rx on the ground.
    pub(super) receiver: Average,
    /// True while this relay withholds its measurements because they contradict those of all other nodes.
    pub(super) off: bool,
    /// Node that the last collection of measurements excluded, for a possibly faulty sensor; 0 for none.
    pub(super) left_out: u16,
    /// Node whose sensor counts as faulty, according to the leader or the node itself; 0 for none.
    pub(super) named: u16,
    /// State of the leader's search for a faulty sensor. The search leaves out the measurements of one relay after the
    /// other.
    pub(super) trial: Trial,
    /// Ground stations (Tx, Rx) whose measurements contradict those of the relays. Only the leader knows them.
    pub(super) ends: EndsOff,
    /// True if the last collected measurements contradict each other and no faulty sensor was found.
    pub(super) contradicted: bool,
    /// True if this relay measures no interference where the other relays' measurements predict some.
    pub(super) deaf: bool,
    /// Number of this relay's last consecutive measurements at or below the receiver's noise.
    pub(super) silent: u8,
    /// Position of the last measurement at or below the receiver's noise.
    pub(super) silent_at: Placement,
    /// True once the view's relays have received the current estimate. Only the leader knows this.
    pub(super) is_distributed: bool,
    /// Quality of the current estimate when it was adopted, and the track (motion) of the interferer.
    pub(super) known: Knowledge,
    /// Reason why the last collected measurements gave no estimate; `None` if they gave an estimate.
    pub(super) unfit: Option<Unfit>,
    /// Interval between two collections of measurements along the chain, as a multiple of `Listen::every`.
    pub(super) wait: u32,
    /// Number of consecutive collections of measurements without a new estimate, modulo [`PATIENCE`].
    pub(super) kept: u8,
    /// Time of the next collection of measurements along the chain; `None` if none is scheduled.
    pub(super) at: Option<Instant>,
}

/// Estimate before any measurement: the interference configured in the mission.
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

    /// Resets the sensing for a new view. In a new view, the leader first distributes its estimate to all relays.
    pub(super) const fn renew(&mut self) {
        if let Some(sensor) = self.sensor_mut() {
            sensor.is_distributed = false;
            sensor.at = None;
            sensor.trial = Trial::NONE;
        }
    }

    /// Resets the sensing for a new mission. The mission's configured interference becomes the estimate.
    pub(super) const fn load(&mut self) {
        if let Some(sensor) = self.sensor_mut() {
            sensor.estimate.estimate = InterferenceEstimate::Mission;
            sensor.estimate.number = sensor.estimate.number.wrapping_add(1);
            // The ground stations of the new mission may be at different places.
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

    /// Returns true if the next collection of measurements is due, and stops its timer.
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

    /// Returns the reason why the last measurements gave no estimate. `None` if they gave an estimate, and at all
    /// relays except the leader.
    pub(crate) const fn unfit(&self) -> Option<Unfit> {
        match self.sensor() {
            Some(sensor) => sensor.unfit,
            None => None,
        }
    }

    /// Returns the mean interference power reported by the ground station at `side`, W. `None` without a report.
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
    /// have less weight.
    pub(super) fn level(&self, average: &Average, now: Instant) -> Level {
        let age = now.since(average.last);
        Level {
            power_w: average.mean,
            count: average.weight * left(age, self.listener.half_life()),
        }
    }

    fn add_sample(&mut self, now: Instant, member: &Member, sample: Sample) -> bool {
        let noise_w = member.mission.config().noise_w;
        // Subtracts the receiver's noise. `None` if the difference is out of range.
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

/// State of one relay in a sensing pass, which collects measurements along the chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sense {
    pub(super) hearing: Heard,
    /// Sums over the measurements of all relays before this one, as received from the previous relay. The leader
    /// computes the interference estimate from such sums.
    pub(super) from: Sums,
    pub(super) own: Sums,
    /// True if this relay's agreed position is based on the current estimate. No new agreement is then needed.
    pub(super) holds: bool,
}

/// Sensing results that are reported to the firmware when they change.
#[derive(Clone, Copy, Debug)]
pub(super) struct Findings {
    pub(super) estimate: NumberedEstimate,
    pub(super) unfit: Option<Unfit>,
    /// Number of the node with a faulty sensor, according to the last collection; 0 for none.
    pub(super) off: u16,
    pub(super) ends: EndsOff,
    pub(super) deaf: bool,
}

impl Findings {
    /// Returns the changes from the earlier findings `before`. A faulty ground station counts as node 0 (Tx) or node
    /// `all` + 1 (Rx), where `all` is the number of relays.
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

/// Adds a ground station's measured power to its `average`. Returns false if the power is not above the noise.
///
/// `heard_w` is the measured power minus the receiver noise, W; `None` if the difference is not positive.
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

/// Returns true if a measurement at `at` is near enough to Tx to be used. Each coordinate may differ by at most
/// [`FARTHEST`] times `distance_m`, the distance from Tx to Rx.
fn is_near(at: Placement, distance_m: f32) -> bool {
    let far_m = FARTHEST * distance_m;
    [at.x_m, at.y_m, at.altitude_m]
        .iter()
        .all(|metres| (-far_m..=far_m).contains(metres))
}
