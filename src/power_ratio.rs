//! Power ratio with twice the precision of an f32.

/// Power or path-loss ratio as the sum of two f32, so that its difference to a nearby target is exact.
///
/// A target gamma is compared with a gain A through gamma - A. With A rounded to one f32 this difference has an error of up to
/// 6e-8 A, which is why the closed forms as printed lose digits near gamma = A.
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
    pub const fn value(&self) -> f32 {
        self.hi
    }

    pub(crate) fn wide(self) -> f64 {
        f64::from(self.hi) + f64::from(self.lo)
    }

    /// Returns `target` / A, rounded to f32, for a target SIR and this ratio as the gain A of a hop.
    pub const fn ratio(&self, target: f32) -> f32 {
        target / self.hi
    }

    /// Returns `target` / A - 1 for a target SIR and this ratio as the gain A of a hop. The relative error is below
    /// 2e-7, even if the target is nearly A.
    pub const fn excess(&self, target: f32) -> f32 {
        ((target - self.hi) - self.lo) / self.hi
    }
}

#[cfg(test)]
mod tests {
    use super::PowerRatio;

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
