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
//! At least three relays are required, consistent and more than the unknowns. A faulty end stays so until it fits or
//! the other does not.

use super::fit::Fit;
use super::sums::Place;
use super::sums::{EndsOff, Level, Levels, MEASURED_W, Sums, Terms, UNIT_W, terms};
use crate::mission::Mission;
use crate::place::Placement;

/// Measured / expected variance that starts the search.
const OUT_OF_LINE: f64 = 4.0;

/// Minimum drop of the residual without the faulty relay, in variances.
const DEVIATIONS: f64 = 49.0;

/// Minimum residual and drop that show a faulty relay.
const LEAST: f64 = 0.02;

/// Minimum ratio of second smallest to smallest variance.
const DECISIVE: f64 = 6.0;

/// Maximum variance of consistent relative differences: 0.32^2, some 1.5 dB.
const CONSISTENT: f64 = 0.1;

/// Number of collections between a failed search and the next.
const REST: u8 = 4;

/// Limits within which an excluded relay fits again; the larger counts. A multiple of the variance, and a squared
/// relative difference.
const AGAIN: (f64, f64) = (25.0, 0.1);

/// Minimum number of relays to identify a faulty one. With four, the other three always fit.
const FEWEST: u16 = 5;

/// Minimum number of measured positions; older ones count less ([`Sums::count`]).
const ENOUGH: f32 = 3.5;

/// Maximum mean weight / weight of one position; above it rounding dominates.
const LOST: f32 = 3e3;

#[derive(Clone, Copy, Debug)]
enum Stage {
    Normal,
    /// Trial: a collection without this node. If the others fit far better, it is faulty.
    Trying(u16),
    /// Notice: a collection that tells this node that it is excluded. The flag is false in the first: measurements are
    /// discarded. It is true in the second: they give the estimate.
    Announcing(u16, bool),
}

/// Leader's search for a relay with faulty measurements.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    stage: Stage,
    /// Number of collections before the next search.
    cooldown: u8,
    /// Node whose exclusion gave the smallest variance.
    best: u16,
    /// Residual with all relays: sum of squared relative errors.
    seen: f32,
    /// Residual without `best`: sum of squared relative errors.
    seen_best: f32,
    /// Smallest variance of a fit without one node, `best`.
    least: f32,
    /// Second smallest variance of a fit without one node.
    second: f32,
}

/// Action after a collection of measurements.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    /// Use the measurements for the estimate.
    Review,
    /// Use the measurements: which relay is faulty is unknown.
    Unknown,
    /// Discard the measurements, and collect again soon.
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

    /// Node left out of the next collection; 0 for none.
    pub(crate) const fn left_out(&self) -> u16 {
        match self.stage {
            Stage::Normal => 0,
            Stage::Trying(node) | Stage::Announcing(node, _) => node,
        }
    }

    /// Evaluates a collection; node numbers are 1 to `nodes`.
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

/// Factor between measurement and estimate that a relay doubts.
const ABSURD: f32 = 300.0;

/// Returns true if a measurement is absurd, far from `expected`.
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

/// Returns true if an excluded relay still does not fit `others`. Compared is `(v / e - e / v) / 2`, measured v = 1e-12
/// W / I, fitted e. `expected` sets the weight.
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

/// Returns true if a relay that measures nothing is faulty. It should measure several times `noise_w`, W.
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

/// Returns true if a power ratio differs from 1 beyond errors. `((ratio - 1 / ratio) / 2)^2` must exceed
/// `deviations * unsure` and `least`.
pub(super) fn is_apart(ratio: f64, unsure: f64, (deviations, least): (f64, f64)) -> bool {
    if !(ratio > 0.0) {
        return true;
    }
    let off = 0.5 * (ratio - 1.0 / ratio);
    off * off > least.max(deviations * unsure)
}

/// Limits above which a level at Tx or Rx does not fit; the larger counts. A multiple of the variance, a squared
/// relative difference.
const APART: (f64, f64) = (49.0, 0.174);

/// Minimum number of relays to check the levels at Tx and Rx.
const FEWEST_FOR_ENDS: u16 = 3;

/// Measured / expected level, and its relative variance.
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

/// Converts a `level` at Tx or Rx to v = 1e-12 W / I.
pub(super) fn v_at_end(mission: &Mission, level: Level) -> f64 {
    let channel = mission.config().channel;
    f64::from(UNIT_W) * (channel.eta() / channel.mu_nlos()) / f64::from(level.power_w)
}

/// Returns which levels at Tx and Rx do not fit.
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
