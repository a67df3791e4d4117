//! Sums that a pass collects along the chain: eighteen numbers that contain all a fit needs of the measurements.

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

/// Length of [`Sums`]: products of the terms, terms times v, v squared, number of positions, of measurements, and their age.
pub const SUMS: usize = 18;

/// Weighted sums over positions.
///
/// For each position: w a b for every two of the four terms, w a v, w v^2, its share, its number of measurements, and its share
/// times its age in seconds. w is 2 (v / e)^(1/2) / (v^2 + e^2) with v measured and e expected. It is 1 / e^2 if both agree, and
/// gives errors that are equal in decibels equal weights, and no position more than all the others.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sums {
    pub(crate) numbers: [f32; SUMS],
}

/// Limit of a sum, so that it stays finite. No measurement within 2 D of the line comes near it.
const MOST: f32 = 1e38;

fn within(sum: f32) -> f32 {
    sum.clamp(-MOST, MOST)
}

impl Sums {
    /// Sums without any position.
    pub const NONE: Self = Self {
        numbers: [0.0; SUMS],
    };

    /// Adds a position with its `terms`, measured v and `expected` v, both above 0. It counts `share`, with `measured`
    /// measurements. At most 60 instructions.
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

    pub(crate) fn merge(&mut self, other: &Self) {
        for (sum, number) in self.numbers.iter_mut().zip(other.numbers) {
            *sum = within(*sum + number);
        }
    }

    /// Ages the sums by `seconds` and multiplies their weight by `share`.
    pub(crate) fn fade(&mut self, share: f32, seconds: f32) {
        let [.., count, _, age] = &mut self.numbers;
        *age += *count * seconds;
        for sum in &mut self.numbers {
            *sum *= share;
        }
    }

    /// Number of positions, after fading.
    pub fn count(&self) -> f32 {
        let [.., count, _, _] = self.numbers;
        count
    }

    /// Mean number of measurements per position.
    pub(crate) fn measured(&self) -> f32 {
        let [.., count, measured, _] = self.numbers;
        if count > 0.0 { measured / count } else { 0.0 }
    }

    pub(crate) fn weight(&self) -> f32 {
        let [weight, ..] = self.numbers;
        weight
    }

    /// Mean age, s.
    pub fn age_s(&self) -> f32 {
        let [.., count, _, age] = self.numbers;
        if count > 0.0 { age / count } else { 0.0 }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "what is too old, or no number, is cut"
    )]
    pub(crate) fn age_us(&self) -> u64 {
        (self.age_s() * 1e6) as u64
    }

    /// Returns true if all numbers are finite, and those of squares not negative.
    pub(crate) fn is_sound(&self) -> bool {
        let [aa, .., vv, count, measurements, age] = self.numbers;
        self.numbers.iter().all(|number| number.is_finite())
            && [aa, vv, count, measurements, age]
                .iter()
                .all(|number| *number >= 0.0)
    }
}
