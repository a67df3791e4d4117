//! Fast square root in safe Rust, bisection, and a power ratio with twice the precision of an f32.
//!
//! `libm::sqrtf` works bit by bit on integers, since stable Rust has no safe access to the VSQRT of a Cortex-M4F. It
//! takes 81 instructions. This one derives a first estimate from the exponent and improves it by Heron's rule on the
//! FPU. It uses additions, multiplications and divisions only, so every target gives the same bits.

/// Returns the square root of `x`, within one unit in the last place of an f32.
///
/// The result is 0 for `x` below the smallest normal f32. The function takes 18 instructions on a Cortex-M4F.
/// `roots_are_within_one_unit_in_the_last_place` asserts the accuracy for every mantissa. It tests all numbers from 1
/// to 4, because a factor of 4 changes only the exponent of the result.
#[inline(never)] // called from many places: 2.4 KB of flash otherwise
pub fn sqrt(x: f32) -> f32 {
    sqrt_in_place(x)
}

/// Returns the square root of `x` as [`sqrt`] does, but is always inlined, for inner loops.
#[expect(
    clippy::inline_always,
    reason = "a call would cost a sweep a hundred instructions"
)]
#[inline(always)]
pub(crate) fn sqrt_in_place(x: f32) -> f32 {
    if !(x >= f32::MIN_POSITIVE) {
        return 0.0;
    }
    // Half the biased exponent, and so half the logarithm: at most 6 % too large, never too small.
    let mut y = f32::from_bits((x.to_bits() >> 1) + (0x3F80_0000 >> 1));
    // Heron's rule squares and halves the error: 6e-2, 2e-3, 2e-6, and then only rounding.
    y = 0.5 * (y + x / y);
    y = 0.5 * (y + x / y);
    0.5 * (y + x / y)
}

/// Halves the interval from `low` to `high` `steps` times, and returns its ends.
///
/// `holds` must return true for `low` and false for `high`. There is then a limit up to which `holds` returns true; the
/// returned ends enclose this limit.
pub fn bisected(low: f32, high: f32, steps: u8, mut holds: impl FnMut(f32) -> bool) -> (f32, f32) {
    let (mut low, mut high) = (low, high);
    for _ in 0..steps {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    (low, high)
}

/// Power or path-loss ratio as the sum of two f32, so that its difference to a nearby target is exact.
///
/// The paper's closed forms use gamma - A, with a target gamma and a gain A. If A were a single f32, this difference
/// would have an error of up to 6e-8 A, and digits would be lost near gamma = A.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PowerRatio {
    hi: f32,
    lo: f32,
}

impl PowerRatio {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the remainder goes into `lo`"
    )]
    pub(crate) const fn new(value: f64) -> Self {
        let hi = value as f32;
        Self {
            hi,
            lo: (value - hi as f64) as f32,
        }
    }

    /// Returns this power ratio as a single f32, rounded.
    pub const fn value(self) -> f32 {
        self.hi
    }

    pub(crate) fn wide(self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }

    /// Returns `target` divided by this ratio, rounded to f32. The ratio is the gain A of a hop, `target` is a target
    /// SIR.
    pub const fn ratio(self, target: f32) -> f32 {
        target / self.hi
    }

    /// Returns `target` divided by this ratio, minus 1. The ratio is the gain A of a hop, `target` is a target SIR. The
    /// relative error is below 2e-7, even if `target` is nearly A.
    pub const fn excess(self, target: f32) -> f32 {
        ((target - self.hi) - self.lo) / self.hi
    }
}

#[cfg(test)]
mod tests {
    use super::{PowerRatio, sqrt};

    fn units_off(x: f32) -> u32 {
        sqrt(x).to_bits().abs_diff(libm::sqrtf(x).to_bits())
    }

    #[test]
    fn roots_are_within_one_unit_in_the_last_place() {
        let (first, last) = (1.0_f32.to_bits(), 4.0_f32.to_bits());
        let worst = (first..last)
            .map(|bits| units_off(f32::from_bits(bits)))
            .max();
        assert_eq!(worst, Some(1));
    }

    #[test]
    fn a_factor_of_four_changes_the_exponent_alone() {
        for bits in (1.0_f32.to_bits()..4.0_f32.to_bits()).step_by(4_099) {
            let (x, root) = (f32::from_bits(bits), sqrt(f32::from_bits(bits)));
            let (mut scale, mut factor) = (2.0_f32.powi(-126), 2.0_f32.powi(-63));
            while scale < 2.0_f32.powi(124) {
                assert_eq!(
                    sqrt(x * scale).to_bits(),
                    (root * factor).to_bits(),
                    "{x} x {scale}"
                );
                (scale, factor) = (scale * 4.0, factor * 2.0);
            }
        }
    }

    #[test]
    fn the_ends_of_the_domain() {
        for nothing in [
            0.0,
            -0.0,
            -1.0,
            f32::NEG_INFINITY,
            f32::NAN,
            f32::MIN_POSITIVE / 2.0,
        ] {
            assert_eq!(sqrt(nothing).to_bits(), 0, "{nothing}");
        }
        assert_eq!(units_off(f32::MIN_POSITIVE), 0);
        assert!(units_off(f32::MAX) <= 1);
    }

    #[test]
    fn excess_keeps_its_digits_next_to_the_gain() {
        // 1/3 is not an f32: a gain of one f32 would make half the digits of the excess wrong.
        let gain = PowerRatio::new(1.0 / 3.0);
        let mut target = 1.0_f32 / 3.0;
        for _ in 0..40 {
            let exact = f64::from(target) * 3.0 - 1.0;
            let error = (f64::from(gain.excess(target)) - exact).abs();
            assert!(error <= 2e-7 * exact.abs(), "{target}: {error}");
            target = target.next_up();
        }
    }
}
