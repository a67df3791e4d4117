//! What a pass adds up along the chain: all that a fit needs to know of what was heard, in eighteen numbers.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

use super::terms::Terms;
use crate::root::sqrt;

/// Numbers of [`Sums`]: the products of the terms, the terms with v, v squared, how many places, their measurements, their age.
pub const SUMS: usize = 18;

/// Weighted sums over places. Of each place: w a b for every two of the four terms, w a v, w v^2, how much it counts, how often it was
/// measured, and how much it counts times its age in seconds. w is 2 (v / e)^(1/2) / (v^2 + e^2) of what was heard, v, and what was expected, e:
/// 1 / e^2 where both agree, and such that errors which are alike in decibels weigh alike, and no place more than all the others.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sums {
    pub(crate) numbers: [f32; SUMS],
}

/// The largest sum: what would be larger stays there, and finite. Nothing that is measured within 2 D of the line comes near it.
const MOST: f32 = 1e38;

fn within(sum: f32) -> f32 {
    sum.clamp(-MOST, MOST)
}

impl Sums {
    /// Of no place.
    pub const NONE: Self = Self {
        numbers: [0.0; SUMS],
    };

    /// Adds a place with these `terms` where v was heard and `expected` was to be, above 0 both, which counts `share` and was `measured` so often. At most 60 instructions.
    pub(crate) fn add(&mut self, terms: &Terms, v: f32, expected: f32, share: f32, measured: f32) {
        let even = sqrt(v / expected);
        let weight = 2.0 * share * even / (v * v + expected * expected);
        let [a, b, c, d] = *terms;
        let row = [
            a * a,
            a * b,
            a * c,
            a * d,
            b * b,
            b * c,
            b * d,
            c * c,
            c * d,
            d * d,
            a * v,
            b * v,
            c * v,
            d * v,
            v * v,
        ];
        for (sum, number) in self.numbers.iter_mut().zip(row) {
            *sum = within(*sum + weight * number);
        }
        let [.., count, measurements, _] = &mut self.numbers;
        *count += share;
        *measurements += share * measured;
    }

    /// Adds those of others.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (sum, number) in self.numbers.iter_mut().zip(other.numbers) {
            *sum = within(*sum + number);
        }
    }

    /// They are `seconds` older, and count `share` of what they did.
    pub(crate) fn fade(&mut self, share: f32, seconds: f32) {
        let [.., count, _, age] = &mut self.numbers;
        *age += *count * seconds;
        for sum in &mut self.numbers {
            *sum *= share;
        }
    }

    /// How many places they are of; of what has faded, a part.
    pub fn count(&self) -> f32 {
        let [.., count, _, _] = self.numbers;
        count
    }

    /// How often each place was measured, on average.
    pub(crate) fn measured(&self) -> f32 {
        let [.., count, measured, _] = self.numbers;
        if count > 0.0 { measured / count } else { 0.0 }
    }

    /// The weights of all places.
    pub(crate) fn weight(&self) -> f32 {
        let [weight, ..] = self.numbers;
        weight
    }

    /// How old they are on average, s.
    pub fn age_s(&self) -> f32 {
        let [.., count, _, age] = self.numbers;
        if count > 0.0 { age / count } else { 0.0 }
    }

    /// The same in microseconds.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "what is too old, or no number, is cut"
    )]
    pub(crate) fn age_us(&self) -> u64 {
        (self.age_s() * 1e6) as u64
    }

    /// Whether all are finite, and those of squares not negative.
    pub(crate) fn is_sound(&self) -> bool {
        let [aa, .., vv, count, measurements, age] = self.numbers;
        self.numbers.iter().all(|number| number.is_finite())
            && [aa, vv, count, measurements, age]
                .iter()
                .all(|number| *number >= 0.0)
    }
}
