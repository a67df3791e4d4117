//! Interference estimate of the chain, and the rules for its replacement.
//!
//! | result of the fit | current estimate | action |
//! | --- | --- | --- |
//! | a source | none | adopt the source |
//! | a source | another source, and the SIR differs by more than 1 % | adopt it if the difference is significant, or the information has grown by 10 % |
//! | a source | nearly the same source | keep the estimate |
//! | too few positions | none | take the next spread, so that the relays measure elsewhere |
//! | too few positions, or no source | a source that contradicts the measurements | spread evenly |
//! | too few positions, or no source | a source | keep the estimate |
//!
//! # Track of a moving interferer
//!
//! The track has the interferer's velocity, and predicts its position. Each axis has a Kalman filter of position and
//! velocity; the velocity is a random walk. A fit refers to the mean time of its measurements. Two successive fits
//! share measurements that have not faded between them. So a fit counts in proportion to the time since the previous
//! one, divided by the half-life.

use super::doubt::{judge_ends, v_at_end};
use super::fit::{Fit, FoundSource, Unfit, misfit};
use super::sums::{EndsOff, Level, Levels, Sums, coefficients, expected_v, is_level, terms};
use crate::mission::{Interference, Interferer, Mission, MissionError};
use crate::place::Placement;
use crate::sensing::Listen;
use crate::time::{Duration, Instant};

/// Estimate of the interference that all relays of the chain use.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum InterferenceEstimate {
    /// Interference as the mission configures it; measurements have not changed it.
    #[default]
    Mission,
    /// Unknown interference. The relays take this spacing along the line Tx to Rx in order to measure the interference.
    Unknown(Spread),
    /// Single interfering transmitter on the ground.
    Source {
        /// Estimated position and power of the interfering transmitter.
        source: Interferer,
        /// Interference power measured at the ground receiver, W. 0 if the receiver has not measured. The interference
        /// at the receiver is then computed from the estimated source and the path loss along the ground.
        receiver_w: f32,
    },
}

impl InterferenceEstimate {
    /// Returns `mission` with its interference replaced by this estimate.
    ///
    /// `own` is the interference that the mission configures; the estimate [`Mission`](Self::Mission) uses it.
    ///
    /// # Errors
    /// [`MissionError`] if the estimated interference is out of range.
    pub(crate) fn mission(
        &self,
        mission: &Mission,
        own: Interference,
    ) -> Result<Mission, MissionError> {
        let (interference, spread, receiver_w) = match *self {
            Self::Mission => (own, Spread::Even, 0.0),
            Self::Unknown(spread) => (Interference::Unknown, spread, 0.0),
            Self::Source { source, receiver_w } => {
                (Interference::Source(source), Spread::Even, receiver_w)
            }
        };
        let halved = [Spread::TowardTx, Spread::TowardRx].map(|toward| toward == spread);
        mission.with_interference(interference, receiver_w, halved)
    }
}

/// Spacing of the relays while the interferer is unknown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Spread {
    /// Spacing with all hops of the same length.
    #[default]
    Even,
    /// Spacing with the first hop, from Tx, half as long as all other hops.
    TowardTx,
    /// Spacing with the last hop, to Rx, half as long as all other hops.
    TowardRx,
}

impl Spread {
    const fn next(self) -> Self {
        match self {
            Self::Even => Self::TowardTx,
            Self::TowardTx => Self::TowardRx,
            Self::TowardRx => Self::Even,
        }
    }
}

/// Interference estimate with its sequence number. The leader increments the number, which wraps.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct NumberedEstimate {
    /// Sequence number of the estimate; 0 for the estimate before any change.
    pub number: u16,
    /// Interference estimate to which the sequence number belongs.
    pub estimate: InterferenceEstimate,
}

/// Minimum mean square relative change of the interference for which a refined estimate is adopted. The mean is over
/// the measured positions.
const WORTH: f64 = 1e-5;

/// Maximum mean square relative change of the interference in a refinement of the estimate. The mean is over the
/// measured positions. A larger change can mean that the interference itself has changed.
const CHANGE: f64 = 1e-4;

/// Minimum ratio, for a stationary source, of an estimate's mean square change to the expected one. The expected change
/// is the change due to measurement errors. With a smaller ratio, the new estimate is only a refinement.
const BEYOND_CHANCE: f64 = 8.0;
/// Minimum ratio, for a moving source, of an estimate's mean square change to the expected one. The expected change is
/// the change due to measurement errors. With a smaller ratio, the new estimate is only a refinement.
const FOLLOWED: f64 = 1.5;

/// Minimum ratio of an estimate's mean square change to the expected one that shows a new interferer. It applies to a
/// stationary source whose estimate has been refined [`REFINED`] times. The expected change is the change due to
/// measurement errors.
const ANOTHER: f64 = 64.0;

/// Minimum squared relative change of the level measured at Rx that counts as changed interference.
const LOUDER: f64 = 0.025;

/// Maximum mean square difference between the interference by the track and by the fit. The unit is the error variance
/// of the fit. With a larger difference the position is not predicted from the track.
const ASTRAY: f64 = 4.0;

/// Minimum factor by which the information must have grown before a refined estimate is adopted. Information is the
/// number of measured positions divided by the error variance of one position.
const LEARNED: f64 = 1.1;
/// Number of times that the estimate of a stationary interferer is refined. Then the estimate stays until the
/// interference changes.
const REFINED: u8 = 4;

/// Time in which drones are assumed to fly the few metres to their new positions. The position of a moving interferer
/// is predicted for this time from now, plus half the interval between two sensing passes.
const FLIGHT: Duration = Duration::from_millis(1_000);

/// Mean square relative error of measurements above which they contradict the estimated source. The relays then treat
/// the interference as unknown.
const CONTRADICTED: f64 = 0.25;

/// Maximum mean square relative error of measurements that agree with the mission's interference. The unit is the
/// variance that the operator expects. With a larger error the relays treat the interference as unknown.
const GUESSED: f64 = 16.0;

/// Quality that the current estimate had when it was adopted, and the track of the interferer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Knowledge {
    /// Information in the measurements: number of positions divided by the error variance of one position.
    information: f64,
    /// Expected mean square of the relative error of the current estimate's interference.
    chance: f64,
    /// Number of times that the estimate of the same interferer has been replaced, up to [`REFINED`].
    refined: u8,
    track: Track,
}

impl Knowledge {
    pub(crate) const NOTHING: Self = Self {
        information: 0.0,
        chance: 0.0,
        refined: 0,
        track: Track::NONE,
    };
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Review {
    pub(crate) adopt: Option<InterferenceEstimate>,
    pub(crate) known: Knowledge,
    pub(crate) unfit: Option<Unfit>,
    /// Result of a check: the levels measured at Tx and Rx that do not fit the relays' measurements.
    pub(crate) ends: EndsOff,
}

/// Compares the measurements with the current `estimate`, and returns the estimate to adopt, if any.
///
/// `mission` is based on the current estimate. `sums` has the measurements of all relays, and `levels` the
/// interference measured at Tx and at Rx. `before` is the quality that the current estimate had when it was adopted.
pub(crate) fn review(
    mission: &Mission,
    estimate: &InterferenceEstimate,
    sums: &Sums,
    levels: &Levels,
    listen: &Listen,
    before: Knowledge,
    now: Instant,
) -> Review {
    let known = mission.known_source();
    let mut levels = *levels;
    let (fit, found) = match fitted(mission, sums, &mut levels, listen) {
        Ok(found) => found,
        Err(unfit) => {
            return Review {
                ends: levels.off,
                ..without_fit(mission, estimate, sums, listen, before, unfit)
            };
        }
    };
    let ends = levels.off;
    let unfit = if found.is_one {
        ends.unknown.then_some(Unfit::Contradiction)
    } else {
        Some(Unfit::NoSource)
    };
    let still = listen.is_source_fixed();
    let mut track = before.track;
    let heard = Instant::from_micros(now.as_micros().saturating_sub(sums.age_us()));
    let ahead = (found.is_one && !still)
        .then(|| followed(mission, &fit, &found, &mut track, [heard, now], listen))
        .flatten();
    let (source, moves) = (ahead.unwrap_or(found.source), ahead.is_some());
    let receiver_w = at_receiver(
        mission,
        &fit,
        &source,
        levels.receiver,
        listen.relative_error,
    );
    let information = fit.information();
    let before = Knowledge { track, ..before };
    let keep = |unfit| Review {
        adopt: None,
        known: before,
        unfit,
        ends,
    };
    let adopt = |refined| Review {
        adopt: Some(InterferenceEstimate::Source { source, receiver_w }),
        known: Knowledge {
            information,
            chance: fit.chance(),
            refined,
            track,
        },
        unfit,
        ends,
    };
    let Some(known) = known else { return adopt(0) };
    let chance = fit.chance();
    let off = fit.mean_square_difference(
        &coefficients(mission, &source),
        &coefficients(mission, &known),
    );
    let receiver = match estimate {
        InterferenceEstimate::Source {
            receiver_w: before, ..
        } if receiver_w > 0.0 || *before > 0.0 => {
            // If only one of the two has a measurement, the whole difference is new.
            let ratio = f64::from(before - receiver_w) / f64::from(receiver_w);
            ratio * ratio
        }
        _ => 0.0,
    };
    let by_chance = chance + before.chance;
    let settled = before.refined >= REFINED;
    let again = if settled { 0 } else { before.refined + 1 };
    let times = match (moves, still && settled) {
        (true, _) => FOLLOWED,
        (false, false) => BEYOND_CHANCE,
        (false, true) => ANOTHER,
    };
    if off > CHANGE && off > times * by_chance || receiver > LOUDER {
        adopt(if still { again } else { 0 })
    } else if (off > WORTH || receiver > 4.0 * WORTH)
        && information > LEARNED * before.information
        && !settled
    {
        adopt(again)
    } else {
        keep(unfit)
    }
}

/// Returns the fit to all measurements, and the source of interference that this fit gives. A level measured at Tx or
/// Rx is cleared in `levels` if it does not fit the relays' measurements.
fn fitted(
    mission: &Mission,
    sums: &Sums,
    levels: &mut Levels,
    listen: &Listen,
) -> Result<(Fit, FoundSource), Unfit> {
    let mut fit = Fit::of(sums, listen.relative_error)?;
    levels.off = judge_ends(mission, &fit, levels, listen.relative_error);
    if levels.off.transmitter {
        levels.transmitter = Level::default();
    }
    if levels.off.receiver {
        levels.receiver = Level::default();
    }
    let mut sums = *sums;
    let ends = [
        (0.0, levels.transmitter),
        (mission.config().distance_m, levels.receiver),
    ];
    for (x_m, level) in ends {
        fit = with_end(mission, fit, &mut sums, x_m, level, listen.relative_error);
    }
    let side_m = mission.known_source().map_or(1.0, |source| source.y_m);
    Ok((fit, fit.source(mission, side_m)?))
}

/// Returns a moving interferer at the position predicted for the arrival of the drones. The drones then have reached
/// the positions that they compute from it. `None` if the interferer does not move, or if its track deviates too much
/// from the fit. `heard` is the mean time of the measurements.
fn followed(
    mission: &Mission,
    fit: &Fit,
    found: &FoundSource,
    track: &mut Track,
    [heard, now]: [Instant; 2],
    listen: &Listen,
) -> Option<Interferer> {
    track.update(found, heard, listen.half_life);
    // The agreement is used until the next review, and the drones have to fly to the new positions.
    let ahead = Duration::from_micros(listen.every.as_micros() / 2);
    let [was, will] = track.ahead(now + ahead + FLIGHT)?;
    let power_w = fit.power_w(mission, was)?;
    let at = |[x_m, y_m]: [f32; 2]| Interferer { power_w, x_m, y_m };
    if fit.mean_square_from_fit(&coefficients(mission, &at(was))) <= ASTRAY * fit.chance() {
        return Some(at(will));
    }
    *track = Track::NONE;
    track.update(found, heard, listen.half_life);
    None
}

/// Returns `fit` extended by `level`, the interference level measured at Tx or Rx. The x of this ground station is
/// `x_m`. Returns `fit` unchanged if the level does not agree with the relays' measurements: the path loss over the
/// ground then differs from the mission's.
#[expect(
    clippy::large_types_passed_by_value,
    reason = "it is what comes of it, too"
)]
fn with_end(
    mission: &Mission,
    fit: Fit,
    sums: &mut Sums,
    x_m: f32,
    level: Level,
    relative_error: f32,
) -> Fit {
    if !level.is_heard() {
        return fit;
    }
    let config = mission.config();
    let there = terms(config.distance_m, Placement::on_line(x_m, 0.0));
    let v = v_at_end(mission, level);
    let expected = fit.value(&there);
    let off = v / expected - 1.0;
    let chance = 25.0 * (fit.variance() + fit.relative_variance(&there));
    let (Some(v), Some(expected)) = (expected_v(v), expected_v(expected)) else {
        return fit;
    };
    if !(off * off < chance) {
        return fit;
    }
    sums.add(&there, v, expected, 1.0, level.count);
    Fit::of(sums, relative_error).unwrap_or(fit)
}

/// Returns the interference power at the ground receiver Rx, W; 0 if Rx has not measured it.
///
/// It is the mean of the power measured at Rx and the power computed from `source` and the path loss, each weighted by
/// the inverse of its variance. If the two powers differ too much, it is the measured power.
#[expect(clippy::cast_possible_truncation, reason = "checked")]
fn at_receiver(
    mission: &Mission,
    fit: &Fit,
    source: &Interferer,
    receiver: Level,
    relative_error: f32,
) -> f32 {
    if !receiver.is_heard() {
        return 0.0;
    }
    let heard = f64::from(receiver.power_w);
    let chance = f64::from(relative_error) * f64::from(relative_error) / f64::from(receiver.count);
    let config = mission.config();
    let (beyond, aside) = (source.x_m - config.distance_m, source.y_m);
    let (beyond, aside) = (f64::from(beyond), f64::from(aside));
    let squared = beyond * beyond + aside * aside;
    let made = f64::from(source.power_w) / (config.channel.mu_nlos() * squared);
    let unsure = fit.relative_variance(&terms(
        config.distance_m,
        Placement::on_line(config.distance_m, 0.0),
    ));
    let off = made / heard - 1.0;
    if !(off * off < 25.0 * (chance + unsure)) {
        return receiver.power_w;
    }
    let both_w = (heard * (1.0 + off * chance / (chance + unsure))) as f32;
    if is_level(both_w) {
        both_w
    } else {
        receiver.power_w
    }
}

fn without_fit(
    mission: &Mission,
    estimate: &InterferenceEstimate,
    sums: &Sums,
    listen: &Listen,
    before: Knowledge,
    unfit: Unfit,
) -> Review {
    let known = mission.known_source();
    let expected = f64::from(listen.relative_error) * f64::from(listen.relative_error);
    let allowed = match estimate {
        // The mission's interference was not measured, so its limit is stricter.
        InterferenceEstimate::Mission => GUESSED * expected,
        _ => CONTRADICTED,
    };
    let contradicted =
        known.is_none_or(|known| misfit(sums, &coefficients(mission, &known)) > allowed);
    let spread = match estimate {
        InterferenceEstimate::Unknown(spread) => spread.next(),
        InterferenceEstimate::Mission if known.is_none() => Spread::Even.next(),
        _ => Spread::Even,
    };
    let heard = sums.count() > 0.0;
    Review {
        adopt: (heard && contradicted).then_some(InterferenceEstimate::Unknown(spread)),
        known: if contradicted {
            Knowledge::NOTHING
        } else {
            before
        },
        unfit: Some(unfit),
        ends: EndsOff::NONE,
    }
}

/// Initial standard deviation of the interferer's velocity along one axis, m/s.
const SPEED: f32 = 10.0;

/// Minimum squared velocity, relative to its variance, of an interferer that counts as moving.
const CERTAIN: f32 = 16.0;

/// Minimum squared deviation of a found position from the track that shows a new interferer. The unit is the variance
/// of the deviation. The track then starts again at the found position.
const ELSEWHERE: f32 = 49.0;

/// Kalman filter of the interferer along one axis: position, m, velocity, m/s, and their covariance.
#[derive(Clone, Copy, Debug)]
struct Axis {
    at: f32,
    speed: f32,
    variance: [f32; 3],
}

impl Axis {
    const fn new(at: f32, variance: f32) -> Self {
        Self {
            at,
            speed: 0.0,
            variance: [variance, 0.0, SPEED * SPEED],
        }
    }

    /// Predicts position and velocity for a time `seconds` later. The variance of the velocity grows by `walk` per
    /// second; the unit of `walk` is m^2/s^3.
    fn later(&mut self, seconds: f32, walk: f32) {
        self.at += seconds * self.speed;
        let [at, both, speed] = &mut self.variance;
        *at += seconds * (2.0 * *both + seconds * (*speed + walk * seconds / 3.0));
        *both += seconds * (*speed + 0.5 * walk * seconds);
        *speed += walk * seconds;
    }

    /// Updates position and velocity with the measured position `found`, m, of variance `variance`, m^2.
    fn take(&mut self, found: f32, variance: f32) {
        let [at, both, speed] = self.variance;
        let sum = at + variance;
        if !(sum > 0.0) {
            return;
        }
        if !sum.is_finite() {
            // The last fit is too old to be of use.
            *self = Self::new(found, variance);
            return;
        }
        let off = found - self.at;
        if off * off > ELSEWHERE * sum {
            *self = Self::new(found, variance);
            return;
        }
        self.at += off * at / sum;
        self.speed += off * both / sum;
        self.variance = [
            at * variance / sum,
            both * variance / sum,
            speed - both * both / sum,
        ];
    }

    fn is_moving(&self) -> bool {
        let [_, _, speed] = self.variance;
        self.speed * self.speed > CERTAIN * speed
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Track {
    axes: [Axis; 2],
    /// Time to which the track's position and velocity refer; `None` before the first source is found.
    at: Option<Instant>,
}

impl Track {
    pub(crate) const NONE: Self = Self {
        axes: [Axis::new(0.0, 0.0); 2],
        at: None,
    };

    /// Updates the interferer's track with a position found from measurements with the mean time `at`. `half_life` is
    /// the half-life of the measurements' weight.
    pub(crate) fn update(&mut self, found: &FoundSource, at: Instant, half_life: Duration) {
        let half_life = half_life.as_micros() as f32 * 1e-6;
        let fits = [found.source.x_m, found.source.y_m]
            .into_iter()
            .zip(found.variance_m2);
        let Some(before) = self.at else {
            for (axis, (place, variance)) in self.axes.iter_mut().zip(fits) {
                *axis = Axis::new(place, variance);
            }
            self.at = Some(at);
            return;
        };
        let seconds = at.since(before).as_micros() as f32 * 1e-6;
        if !(seconds > 0.0) {
            return;
        }
        // The velocity may change by 1 m/s in three half-lives.
        let walk = 1.0 / (3.0 * half_life);
        let shared = (1.44 * half_life / seconds).max(1.0);
        for (axis, (place, variance)) in self.axes.iter_mut().zip(fits) {
            axis.later(seconds, walk);
            axis.take(place, variance * shared);
        }
        self.at = Some(at);
    }

    /// Returns the interferer's last position and the position predicted for `then`, each as (x, y), m. `None` if the
    /// interferer does not move.
    pub(crate) fn ahead(&self, then: Instant) -> Option<[[f32; 2]; 2]> {
        let seconds = then.since(self.at?).as_micros() as f32 * 1e-6;
        let [x, y] = self.axes;
        let along = |axis: Axis, seconds: f32| {
            let speed = if axis.is_moving() { axis.speed } else { 0.0 };
            axis.at + seconds * speed
        };
        (x.is_moving() || y.is_moving())
            .then(|| [[x.at, y.at], [along(x, seconds), along(y, seconds)]])
    }
}
