//! A relay that hears something else than all the others: its receiver is broken, or it lies.
//!
//! A pass tells every relay the sums of those before it, and what comes back those of the ones after it. Each fits a source to both, and
//! holds what it hears against that. Where one relay is wrong, it alone finds the others of one mind; all the others find the wrong one among the rest.

use super::fit::Fit;
use super::listener::Place;
use super::sums::Sums;

/// A relay doubts itself only beyond a factor of four (6 dB): that much a place of its own does not make,
const FACTOR: f64 = 2.0;

/// and only beyond seven standard deviations of what the others are apart.
const DEVIATIONS: f64 = 49.0;

/// The others are of one mind up to this variance of their relative errors (some 1.5 dB).
const OF_ONE_MIND: f64 = 0.1;

/// A place that counts so many times less than the others' on average is lost in the rounding of their sums, and one of them may be what is
/// wrong: nothing is said then. Where something is believed all places count alike.
const LOST: f32 = 3e3;

/// Whether a relay that hears `place`, where what is believed makes `expected`, is off all the others, whose sums are `others`.
///
/// The difference of v and what the others make of it, e, is (v / e - e / v) / 2, which grows alike in both directions.
pub(crate) fn is_off(
    others: &Sums,
    place: &Place,
    expected: Option<f32>,
    relative_error: f32,
) -> bool {
    // With fewer the others could be as wrong.
    if others.count() < 3.5 {
        return false;
    }
    let weight = 1.0 / expected.unwrap_or(place.v);
    if others.weight() > LOST * weight * weight * others.count() {
        return false;
    }
    let Ok(fit) = Fit::of(others, relative_error) else {
        return false;
    };
    if fit.variance() > OF_ONE_MIND {
        return false;
    }
    let ratio = f64::from(place.v) / fit.value(&place.terms);
    if !(ratio > 0.0) {
        return false;
    }
    let off = 0.5 * (ratio - 1.0 / ratio);
    off * off
        > (FACTOR * FACTOR).max(DEVIATIONS * (fit.variance() + fit.relative_variance(&place.terms)))
}
