//! The relay whose measurements do not fit those of the others: its receiver is broken, or it lies.
//!
//! Where what all hear is not of one source, the leader has one relay after the other leave its share out of a pass. Without the one that is
//! wrong the others are of one mind; without any other one they are not.
//!
//! | pass | left out | what comes back | next |
//! | --- | --- | --- | --- |
//! | usual | nobody | fits, or a trial was in vain less than [`REST`] passes ago | usual |
//! | usual | nobody | does not fit, of four relays or fewer | usual, and what comes back counts: nobody knows who is wrong |
//! | usual | nobody | does not fit | trial of relay 1 |
//! | trial of n | n | how well the others fit | trial of n + 1 |
//! | trial of the last | it | one without which the others fit far better than without any other | first word |
//! | trial of the last | it | no such one: nobody knows who is wrong | usual, and what comes back counts |
//! | first word | it | | second word |
//! | second word | it | what the others hear | usual, and what comes back counts |
//!
//! A relay that hears something absurd, a factor of 300 off what is believed and far off what the others hear, leaves itself out at once, and says so on the way back.
//!
//! A relay that is left out of two passes one after the other leaves itself out from then on, until it fits the others again. Nothing new is
//! believed from the first pass of a trial to its last.

use super::fit::Fit;
use super::level::MEASURED_W;
use super::listener::Place;
use super::sums::Sums;
use super::terms::{Terms, UNIT_W};

/// How many times the variance that is expected all may have and still fit.
const OUT_OF_LINE: f64 = 4.0;

/// Standard deviations, squared, that what leaving one out takes from the misfit must be above,
const DEVIATIONS: f64 = 49.0;

/// and the least that it must be: some 15 % of one place.
const LEAST: f64 = 0.02;

/// The variance without anybody else must be so many times that without the wrong one.
const DECISIVE: f64 = 6.0;

/// The others are of one mind up to this variance of their relative errors (some 1.5 dB).
const OF_ONE_MIND: f64 = 0.1;

/// Passes between a trial that was in vain and the next one.
const REST: u8 = 4;

/// Standard deviations, squared, and the least of a difference, squared, up to which a relay fits the others again.
const AGAIN: (f64, f64) = (25.0, 0.1);

/// Of fewer relays nobody can tell who is wrong: without one of them three are left, which any three unknowns fit.
const FEWEST: u16 = 5;

/// With fewer places than that, less what has faded, they could all be as wrong as any one.
const ENOUGH: f32 = 3.5;

/// A place that counts so many times less than the others' on average is lost in the rounding of their sums.
const LOST: f32 = 3e3;

/// What the leader is at.
#[derive(Clone, Copy, Debug)]
enum Stage {
    Usual,
    /// This node is left out.
    Trying(u16),
    /// It is told for the first or the second time that this node is left out.
    Telling(u16, bool),
}

/// The leader's search for who is wrong.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Trial {
    stage: Stage,
    /// Passes that are left until the next trial may begin.
    rest: u8,
    /// Without whom the others fit best.
    best: u16,
    /// What is left of all, of those without that one, and their variance; and the least variance without any other.
    seen: f32,
    seen_best: f32,
    least: f32,
    second: f32,
}

/// What follows a pass.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Next {
    /// What came back counts.
    Review,
    /// It counts, and does not fit together: nobody knows who is wrong.
    Unknown,
    /// Another pass, soon.
    Again,
}

impl Trial {
    pub(crate) const NONE: Self = Self {
        stage: Stage::Usual,
        rest: 0,
        best: 0,
        seen: 0.0,
        seen_best: 0.0,
        least: f32::MAX,
        second: f32::MAX,
    };

    /// The node that is left out of the next pass, 0 for none.
    pub(crate) const fn left_out(&self) -> u16 {
        match self.stage {
            Stage::Usual => 0,
            Stage::Trying(node) | Stage::Telling(node, _) => node,
        }
    }

    /// Takes what came back of a pass of `relays` relays, whose nodes are among 1 to `nodes`.
    pub(crate) fn take(
        &mut self,
        sums: &Sums,
        relative_error: f32,
        relays: u16,
        nodes: u16,
    ) -> Next {
        let fit = Fit::of(sums, relative_error);
        match self.stage {
            Stage::Usual => {
                self.rest = self.rest.saturating_sub(1);
                // One that hears far more than all the others drowns them, so that nothing fits.
                let (odd, seen) = match fit {
                    Ok(fit) => {
                        let odd = fit.variance() > OUT_OF_LINE * fit.expected();
                        (odd && fit.seen() > LEAST, narrow(fit.seen()))
                    }
                    Err(_) => (sums.count() > ENOUGH, f32::MAX),
                };
                if !odd || self.rest > 0 {
                    return Next::Review;
                }
                if relays < FEWEST {
                    self.rest = REST;
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
                    // It may be the one.
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
                    self.stage = Stage::Telling(self.best, false);
                    return Next::Again;
                }
                self.stage = Stage::Usual;
                self.rest = REST;
                Next::Unknown
            }
            Stage::Telling(node, false) => {
                self.stage = Stage::Telling(node, true);
                Next::Again
            }
            Stage::Telling(_, true) => {
                self.stage = Stage::Usual;
                Next::Review
            }
        }
    }

    fn is_decided(&self) -> bool {
        let [least, second] = [self.least, self.second].map(f64::from);
        let taken = f64::from(self.seen) - f64::from(self.seen_best);
        least > 0.0
            && least < OF_ONE_MIND
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

/// What a relay hears may be so many times more or less than what is believed before it looks for itself: its share counts so little then
/// that a trial would not find it, nor are the others any worse for it.
const ABSURD: f32 = 300.0;

/// Whether a relay hears at `place` something absurd by what is believed, `expected`, and by what all the others hear, whose sums are `others`.
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
        fit.variance() < OF_ONE_MIND && is_apart(ratio, fit.variance(), (DEVIATIONS, 1e4))
    };
    others.count() > ENOUGH
        && expected.is_some_and(known)
        && Fit::of(others, relative_error).is_ok_and(of_one_mind)
}

/// Whether a relay that has left itself out still hears something else at `place` than all the others, whose sums are `others`; what is believed makes it `expected`.
///
/// The difference of v and what the others make of it, e, is (v / e - e / v) / 2, which grows alike in both directions.
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

/// Whether a relay that hears nothing at these terms should hear several times the noise by what the others hear, all of them repeatedly.
pub(crate) fn is_deaf(others: &Sums, there: &Terms, noise_w: f32, relative_error: f32) -> bool {
    let Ok(fit) = Fit::of(others, relative_error) else {
        return false;
    };
    let v = fit.value(there);
    let heard_w = f64::from(UNIT_W) / v;
    others.count() > ENOUGH
        && others.measured() > 3.0
        && fit.variance() < OF_ONE_MIND
        && v > 0.0
        && DEVIATIONS * fit.relative_variance(there) < 1.0
        && heard_w > 4.0 * f64::from(noise_w.max(MEASURED_W.0))
}

/// Whether a ratio of two powers is not 1 beyond these standard deviations, squared, and this least difference, squared.
pub(super) fn is_apart(ratio: f64, unsure: f64, (deviations, least): (f64, f64)) -> bool {
    if !(ratio > 0.0) {
        return true;
    }
    let off = 0.5 * (ratio - 1.0 / ratio);
    off * off > least.max(deviations * unsure)
}
