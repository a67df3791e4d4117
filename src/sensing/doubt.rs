//! Search for a relay, or an end of the chain, whose measurements do not fit the others.
//!
//! # Relay
//!
//! A relay's measurements do not fit those of the others because its receiver is faulty or it reports false values.
//!
//! If the measurements do not fit a single source, the leader repeats the sensing pass (the collection of measurements)
//! without one relay after the other. Without the faulty relay the others are consistent; without any other relay they
//! are not.
//!
//! | pass | excluded | result | next |
//! | --- | --- | --- | --- |
//! | usual | none | fits, or the last trial failed less than [`REST`] passes ago | usual |
//! | usual | none | does not fit, with four relays or fewer | usual; the measurements are used |
//! | usual | none | does not fit | trial of relay 1 |
//! | trial of n | n | variance of the others | trial of n + 1 |
//! | trial of the last | last | without one relay the others fit far better than without any other | first notice |
//! | trial of the last | last | no such relay: the faulty one is unknown | usual; the measurements are used |
//! | first notice | faulty relay | | second notice |
//! | second notice | faulty relay | measurements of the others | usual; the measurements are used |
//!
//! A relay excludes itself at once if its measurement is absurd: a factor of 300 off the estimate, and inconsistent
//! with the others. It reports that in the reply of the pass.
//!
//! A relay that is excluded from two successive passes excludes itself from then on, until it fits the others again. No
//! new estimate is adopted from the first pass of a trial to its last.
//!
//! # Transmitter and ground receiver
//!
//! Their measurements do not fit those of the relays if their receiver is faulty. The expected level at an end follows
//! from the source of the relays' fit and from the mission's path loss over the ground. The two ends:
//!
//! | transmitter | receiver | conclusion |
//! | --- | --- | --- |
//! | fits | does not fit | the receiver's sensor is faulty: its level is ignored, and the mission's path loss is used |
//! | does not fit | fits | the transmitter's sensor is faulty |
//! | does not fit | does not fit, by the same factor | the path loss over the ground differs from the mission's: the receiver's level is used |
//! | does not fit, or no level | does not fit, or another factor | a sensor is faulty or a hill is in the way: the receiver's level is used |
//!
//! At least three relays are required, consistent and more than the unknowns. A faulty end stays so until it fits or the other
//! does not.

use super::fit::Fit;
use super::sums::Place;
use super::sums::{EndsOff, Level, Levels, MEASURED_W, Sums, Terms, UNIT_W, terms};
use crate::mission::Mission;
use crate::place::Placement;

/// Maximum variance of the measurements about their fit, in units of the operator's expected variance. With a larger
/// variance, the leader searches for a faulty relay.
const OUT_OF_LINE: f64 = 4.0;

/// Minimum drop of the fit's residual that shows a relay as faulty, when the fit leaves out this relay. The unit is the
/// variance of the fit without this relay.
const DEVIATIONS: f64 = 49.0;

/// Minimum residual of the fit at which a relay can be found faulty. The residual is the sum of squared relative
/// errors. When the fit leaves out the faulty relay, the residual must also drop by at least this value. A single
/// measurement with an error of some 15 % causes this residual.
const LEAST: f64 = 0.02;

/// Minimum ratio of the second smallest variance to the smallest that identifies a faulty relay. Each variance belongs
/// to a fit that leaves out one relay.
const DECISIVE: f64 = 6.0;

/// Maximum variance of the relative differences between consistent measurements and their fit. The standard deviation
/// is 0.32, or some 1.5 dB.
const CONSISTENT: f64 = 0.1;

/// Number of sensing passes between a failed search for a faulty relay and the next one. A sensing pass collects
/// measurements.
const REST: u8 = 4;

/// Limits up to which the measurement of an excluded relay is accepted again. They apply to the squared relative
/// difference between this measurement and the fit to the other relays' measurements. The first limit is a multiple of
/// the variance, the second the squared difference itself. The larger limit applies.
const AGAIN: (f64, f64) = (25.0, 0.1);

/// Minimum number of relays to identify a faulty relay. With four relays only three measurements are left, which always
/// fit the three unknowns.
const FEWEST: u16 = 5;

/// Minimum number of measured positions for a search for a faulty relay. Older positions count less, see
/// [`Sums::count`].
const ENOUGH: f32 = 3.5;

/// Maximum ratio of the mean weight of all positions to the weight of one relay's position. With a larger ratio, the
/// rounding errors of the sums exceed the contribution of this relay to the sums.
const LOST: f32 = 3e3;

#[derive(Clone, Copy, Debug)]
enum Stage {
    Normal,
    /// Trial: a sensing pass that leaves out the measurements of the node with this number. If the measurements of the
    /// remaining nodes fit far better, the node left out is faulty.
    Trying(u16),
    /// Notice: a sensing pass that tells the faulty node, which has this number, that it is excluded.
    ///
    /// There are two such passes. The second value is false in the first pass, whose measurements are discarded. It is
    /// true in the second pass, whose measurements are used for the estimate.
    Announcing(u16, bool),
}

/// State of the leader's search for the relay with faulty measurements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    stage: Stage,
    /// Number of sensing passes (collections of measurements) before the next search is allowed to start.
    cooldown: u8,
    /// Node whose omission from the fit has given the smallest variance so far.
    best: u16,
    /// Residual of the fit to the measurements of all relays, the sum of squared relative errors.
    seen: f32,
    /// Residual of the fit without the node `best`: sum of the squared relative errors.
    seen_best: f32,
    /// Smallest variance of relative errors among the fits that each leave out one node. The node left out is `best`.
    least: f32,
    /// Second smallest variance of relative errors among the fits that each leave out one node.
    second: f32,
}

/// Action after a sensing pass, as decided by the search for a faulty relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    /// Use the measurements of this sensing pass for the interference estimate.
    Review,
    /// Use the measurements although they are inconsistent, because it is unknown which relay is faulty.
    Unknown,
    /// Discard the measurements of this sensing pass, and start another sensing pass soon.
    Again,
}

impl Trial {
    pub(crate) const NONE: Self = Self {
        stage: Stage::Normal,
        cooldown: 0,
        best: 0,
        seen: 0.0,
        seen_best: 0.0,
        least: f32::MAX,
        second: f32::MAX,
    };

    /// Node whose measurements the next sensing pass leaves out; 0 for none.
    pub(crate) const fn left_out(&self) -> u16 {
        match self.stage {
            Stage::Normal => 0,
            Stage::Trying(node) | Stage::Announcing(node, _) => node,
        }
    }

    /// Processes the `sums` of a sensing pass in the search for a faulty relay; returns the next action. The chain has
    /// `relays` members, whose node numbers are within 1 to `nodes`.
    pub(crate) fn update(
        &mut self,
        sums: &Sums,
        relative_error: f32,
        relays: u16,
        nodes: u16,
    ) -> Next {
        let fit = Fit::of(sums, relative_error);
        match self.stage {
            Stage::Normal => {
                self.cooldown = self.cooldown.saturating_sub(1);
                // A relay that measures far more than all others dominates the sums, so that nothing fits.
                let (odd, seen) = match fit {
                    Ok(fit) => {
                        let odd = fit.variance() > OUT_OF_LINE * fit.expected();
                        (odd && fit.seen() > LEAST, narrow(fit.seen()))
                    }
                    Err(_) => (sums.count() > ENOUGH, f32::MAX),
                };
                if !odd || self.cooldown > 0 {
                    return Next::Review;
                }
                if relays < FEWEST {
                    self.cooldown = REST;
                    return Next::Unknown;
                }
                *self = Self {
                    stage: Stage::Trying(1),
                    seen,
                    ..Self::NONE
                };
                Next::Again
            }
            Stage::Trying(node) => {
                let (variance, seen) = match fit {
                    Ok(fit) => (narrow(fit.variance()), narrow(fit.seen())),
                    Err(_) if sums.count() > ENOUGH => (f32::MAX, f32::MAX),
                    // This relay may be the faulty one.
                    Err(_) => (0.0, 0.0),
                };
                if variance < self.least {
                    self.second = self.least;
                    (self.best, self.least, self.seen_best) = (node, variance, seen);
                } else {
                    self.second = self.second.min(variance);
                }
                self.stage = Stage::Trying(node.saturating_add(1));
                if node < nodes {
                    return Next::Again;
                }
                if self.is_decided() {
                    self.stage = Stage::Announcing(self.best, false);
                    return Next::Again;
                }
                self.stage = Stage::Normal;
                self.cooldown = REST;
                Next::Unknown
            }
            Stage::Announcing(node, false) => {
                self.stage = Stage::Announcing(node, true);
                Next::Again
            }
            Stage::Announcing(_, true) => {
                self.stage = Stage::Normal;
                Next::Review
            }
        }
    }

    fn is_decided(&self) -> bool {
        let [least, second] = [self.least, self.second].map(f64::from);
        let taken = f64::from(self.seen) - f64::from(self.seen_best);
        least > 0.0
            && least < CONSISTENT
            && second > DECISIVE * least
            && taken > LEAST.max(DEVIATIONS * least)
    }
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "what is too large is compared as infinite"
)]
fn narrow(number: f64) -> f32 {
    number as f32
}

/// Factor between measurement and estimate above which a relay doubts its measurement. The same holds for a factor
/// below 1 / 300.
const ABSURD: f32 = 300.0;

/// Returns true if a relay must exclude its own measurement at `place`, because it is absurd. An absurd measurement is
/// far from `expected`, the value that the current estimate gives for this place. It also does not fit the measurements
/// of the remaining relays, whose sums are `others`.
pub(crate) fn is_absurd(
    others: &Sums,
    place: &Place,
    expected: Option<f32>,
    relative_error: f32,
) -> bool {
    let known = |expected: f32| {
        let ratio = place.v / expected;
        !(1.0 / ABSURD..=ABSURD).contains(&ratio)
    };
    let of_one_mind = |fit: Fit| {
        let ratio = f64::from(place.v) / fit.value(&place.terms);
        fit.variance() < CONSISTENT && is_apart(ratio, fit.variance(), (DEVIATIONS, 1e4))
    };
    others.count() > ENOUGH
        && expected.is_some_and(known)
        && Fit::of(others, relative_error).is_ok_and(of_one_mind)
}

/// Returns true if an excluded relay's measurement still does not fit those of the remaining relays.
///
/// A source is fitted to the remaining relays' measurements, whose sums are `others`, and gives the value e for
/// `place`. The measurement there is v = 1e-12 W / I. The difference is (v / e - e / v) / 2, which is symmetric in v
/// and e. `expected` is the value that the current estimate gives; it sets the measurement's weight.
pub(crate) fn is_off(
    others: &Sums,
    place: &Place,
    expected: Option<f32>,
    relative_error: f32,
) -> bool {
    if others.count() < ENOUGH {
        return false;
    }
    let weight = 1.0 / expected.unwrap_or(place.v);
    if others.weight() > LOST * weight * weight * others.count() {
        return true;
    }
    let Ok(fit) = Fit::of(others, relative_error) else {
        return false;
    };
    let ratio = f64::from(place.v) / fit.value(&place.terms);
    let unsure = fit.variance() + fit.relative_variance(&place.terms);
    is_apart(ratio, unsure, AGAIN)
}

/// Returns true if the receiver of a relay that measures no interference is faulty.
///
/// This is so if the other relays' repeated measurements, whose sums are `others`, predict several times the relay's
/// noise `noise_w`, W. `there` has the terms of the relay's position.
pub(crate) fn is_deaf(others: &Sums, there: &Terms, noise_w: f32, relative_error: f32) -> bool {
    let Ok(fit) = Fit::of(others, relative_error) else {
        return false;
    };
    let v = fit.value(there);
    let heard_w = f64::from(UNIT_W) / v;
    others.count() > ENOUGH
        && others.measured() > 3.0
        && fit.variance() < CONSISTENT
        && v > 0.0
        && DEVIATIONS * fit.relative_variance(there) < 1.0
        && heard_w > 4.0 * f64::from(noise_w.max(MEASURED_W.0))
}

/// Returns true if a ratio of powers differs from 1 by more than measurement errors can explain. This is so if ((ratio
/// - 1 / ratio) / 2)^2 exceeds `least`, and also exceeds `deviations` times `unsure`, the variance of the ratio.
pub(super) fn is_apart(ratio: f64, unsure: f64, (deviations, least): (f64, f64)) -> bool {
    if !(ratio > 0.0) {
        return true;
    }
    let off = 0.5 * (ratio - 1.0 / ratio);
    off * off > least.max(deviations * unsure)
}

/// Limits above which the level measured at Tx or Rx does not fit the relays' measurements. Both limit the squared
/// relative difference. The first is a multiple of its variance; the second corresponds to a factor of 1.5. The larger
/// limit applies.
const APART: (f64, f64) = (49.0, 0.174);

/// Minimum number of relays to check the levels measured at Tx and Rx. With fewer relays it is unknown which
/// measurement is faulty.
const FEWEST_FOR_ENDS: u16 = 3;

/// Level measured at Tx or Rx divided by the expected level, and the relative variance of this ratio.
#[derive(Clone, Copy, Debug)]
struct EndLevel {
    ratio: f64,
    unsure: f64,
}

impl EndLevel {
    fn fits(&self) -> bool {
        !is_apart(self.ratio, self.unsure, APART)
    }
}

/// Converts the `level` measured at Tx or Rx to v = 1e-12 W / I, as a drone there would measure it. The conversion uses
/// the mission's path loss over the ground.
pub(super) fn v_at_end(mission: &Mission, level: Level) -> f64 {
    let channel = mission.config().channel;
    f64::from(UNIT_W) * (channel.eta() / channel.mu_nlos()) / f64::from(level.power_w)
}

/// Compares the levels measured at Tx and Rx with the relays' measurements. Returns which of them do not fit.
///
/// `fit` is the source that was fitted to the relays' measurements.
pub(super) fn judge_ends(
    mission: &Mission,
    fit: &Fit,
    levels: &Levels,
    relative_error: f32,
) -> EndsOff {
    let before = levels.off;
    if mission.relays() < FEWEST_FOR_ENDS || !fit.is_consistent() {
        return before;
    }
    let distance_m = mission.config().distance_m;
    let end_level = |x_m, level: Level| {
        let there = terms(distance_m, Placement::on_line(x_m, 0.0));
        let expected = fit.value(&there);
        let own = f64::from(relative_error) * f64::from(relative_error);
        let ratio = v_at_end(mission, level) / expected;
        // The difference is relative to the smaller of the two, and so is the error of the expected level.
        let unsure = fit.relative_variance(&there) * (1.0 / (ratio * ratio)).max(1.0);
        let end_level = EndLevel {
            ratio,
            unsure: fit.variance() + own / f64::from(level.count) + unsure,
        };
        (level.is_heard() && expected > 0.0).then_some(end_level)
    };
    let transmitter = end_level(0.0, levels.transmitter);
    let receiver = end_level(distance_m, levels.receiver);
    let off = |transmitter, receiver, unknown| EndsOff {
        transmitter,
        receiver,
        unknown,
    };
    match (transmitter, receiver) {
        (Some(tx), Some(rx)) if tx.fits() != rx.fits() => off(!tx.fits(), !rx.fits(), false),
        (Some(tx), Some(rx)) if !tx.fits() => {
            let alike = !is_apart(tx.ratio / rx.ratio, tx.unsure + rx.unsure, APART);
            off(false, false, !alike)
        }
        // A faulty end stays faulty; nothing new is known about the other end.
        (None, Some(rx)) if before.receiver && !rx.fits() => before,
        (Some(tx), None) if before.transmitter && !tx.fits() => before,
        (None, Some(end)) | (Some(end), None) => off(false, false, !end.fits()),
        (None, None) => before,
        (Some(_), Some(_)) => EndsOff::NONE,
    }
}
