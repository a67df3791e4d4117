//! Ladder: the target SIRs of one pass along the chain (a sweep), encoded in six bytes.
//!
//! Sixteen targets rise by gaps that are smallest in the middle: target j + 1 is target j times 1 + gap x growth^|j -
//! 7|. So a ladder is dense near the expected optimum and still spans the whole bracket. It is computed from target 7
//! in both directions, so that rounding errors are largest at the ends. Every relay computes the targets from the six
//! bytes with the same f32 operations, hence to the same bits.

use super::PerTarget;
use crate::root::sqrt;

/// Number of targets in a full ladder.
pub const TARGETS: usize = 16;

/// Number of gaps in half a ladder.
const HALF: usize = TARGETS / 2;

/// Ladder: rising target SIRs, encoded in six bytes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ladder {
    /// Eighth of 16 targets, linear SIR, or the only one.
    anchor: f32,
    /// Code of the middle relative gap; 0 for one target. 5 exponent and 3 mantissa bits.
    gap: u8,
    /// Code of the gaps' growth outward, `1 + growth / 16`.
    growth: u8,
    /// True if every relay takes its farthest x; false if it may stop before.
    plain: bool,
}

impl Ladder {
    /// Returns a ladder with one target, above 0.
    pub const fn single(target: f32) -> Self {
        Self {
            anchor: target,
            gap: 0,
            growth: 0,
            plain: false,
        }
    }

    /// Returns the same targets with another `plain`.
    pub const fn plainly(self, plain: bool) -> Self {
        Self { plain, ..self }
    }

    /// Returns true if every relay takes its farthest x.
    pub const fn is_plain(&self) -> bool {
        self.plain
    }

    /// Returns 16 targets in equal ratios around `low` to `high`. 0 < `low` < `high`.
    pub fn spanning(low: f32, high: f32) -> Self {
        Self::centred(
            geometric_mean(low, high),
            gap_code(equal_gap(low, high, 15.0)).saturating_add(1),
            0,
        )
    }

    /// Returns 16 targets in equal ratios between `low` and `high`. 0 < `low` < `high`.
    pub fn between(low: f32, high: f32) -> Self {
        Self::centred(
            geometric_mean(low, high),
            gap_code(equal_gap(low, high, 17.0)),
            0,
        )
    }

    /// Returns 16 targets dense around `centre`, which span [`low`, `high`].
    pub fn around(centre: f32, gap: f32, low: f32, high: f32) -> Self {
        let code = gap_code(gap);
        let wanted = (centre / low).max(high / centre);
        let spans = |growth: u8| half_span(code, growth) >= wanted;
        // Bisection for the smallest growth that spans the bracket, or the maximum.
        let (mut below, mut growth) = (0_u8, u8::MAX);
        if spans(0) {
            growth = 0;
        }
        while growth - below > 1 {
            let middle = below + (growth - below) / 2;
            if spans(middle) {
                growth = middle;
            } else {
                below = middle;
            }
        }
        Self::centred(centre, code, growth)
    }

    fn centred(centre: f32, gap: u8, growth: u8) -> Self {
        Self {
            anchor: centre / sqrt(1.0 + gap_value(gap)),
            gap,
            growth,
            plain: false,
        }
    }

    /// Decodes a ladder; `None` if invalid. Targets are normal f32 above zero. With `gap` 0, `growth` is 0.
    pub fn from_parts(anchor: f32, gap: u8, growth: u8) -> Option<Self> {
        let ladder = Self {
            anchor,
            gap,
            growth,
            plain: false,
        };
        let targets = ladder.targets();
        // Subnormal targets would make a hop depend on the processor's handling of subnormals.
        let sound = targets.first()? >= &f32::MIN_POSITIVE && targets.last()?.is_finite();
        // A single target has no gaps that could grow.
        let unique = gap != 0 || growth == 0;
        (sound && unique).then_some(ladder)
    }

    /// Returns the encoding: `anchor`, `gap` and `growth`.
    pub const fn parts(&self) -> (f32, u8, u8) {
        (self.anchor, self.gap, self.growth)
    }

    /// Returns true for a single target.
    pub const fn is_single(&self) -> bool {
        self.gap == 0
    }

    /// Number of targets, 1 or [`TARGETS`].
    #[allow(clippy::len_without_is_empty, reason = "there is always a target")]
    pub const fn len(&self) -> usize {
        if self.is_single() { 1 } else { TARGETS }
    }

    /// Returns the target SIRs, linear and ascending.
    pub fn targets(&self) -> PerTarget {
        if self.is_single() {
            return PerTarget::from([self.anchor]);
        }
        let mut targets = [0.0; TARGETS];
        let gaps = gaps(self.gap, self.growth);
        let (lower, upper) = targets.split_at_mut(HALF);
        let mut target = self.anchor;
        for (slot, gap) in upper.iter_mut().zip(&gaps) {
            target += target * gap;
            *slot = target;
        }
        target = self.anchor;
        let [_, outward @ ..] = &gaps;
        for (slot, gap) in lower.iter_mut().rev().zip(outward.iter().chain(&[0.0])) {
            *slot = target;
            target /= 1.0 + gap;
        }
        PerTarget::from(targets)
    }
}

fn gaps(gap: u8, growth: u8) -> [f32; HALF] {
    let ratio = 1.0 + f32::from(growth) / 16.0;
    let mut next = gap_value(gap);
    core::array::from_fn(|_| {
        let this = next;
        next *= ratio;
        this
    })
}

/// Returns the highest target divided by the lower middle one.
fn half_span(gap: u8, growth: u8) -> f32 {
    gaps(gap, growth)
        .iter()
        .fold(1.0, |span, gap| span + span * gap)
}

fn geometric_mean(low: f32, high: f32) -> f32 {
    sqrt(low) * sqrt(high)
}

fn equal_gap(low: f32, high: f32, gaps: f32) -> f32 {
    libm::expm1f(libm::log1pf((high - low) / low) / gaps)
}

/// Returns the relative gap `(1 + m / 8) 2^(e - 25)` of a code. m is its low three bits.
const fn gap_value(code: u8) -> f32 {
    f32::from_bits(((code as u32) << 20) + (102 << 23))
}

/// Returns the nearest code, 1 to 254.
fn gap_code(gap: f32) -> u8 {
    let bits = gap.to_bits().saturating_sub(102 << 23);
    let rounded = bits.saturating_add(1 << 19) >> 20;
    u8::try_from(rounded)
        .unwrap_or(u8::MAX)
        .clamp(1, u8::MAX - 1)
}

#[cfg(test)]
mod tests {
    use super::{Ladder, TARGETS, gap_code, gap_value};

    #[test]
    fn a_gap_code_keeps_its_value_within_a_sixteenth() {
        let mut gap = 4e-8_f32;
        while gap < 100.0 {
            let kept = gap_value(gap_code(gap));
            assert!(
                (kept / gap - 1.0).abs() <= 1.0 / 16.0 + 1e-6,
                "{gap} became {kept}"
            );
            gap *= 1.07;
        }
        for code in 1..=254 {
            assert_eq!(gap_code(gap_value(code)), code);
        }
    }

    #[test]
    fn a_spanning_ladder_covers_both_ends() {
        for (low, high) in [(0.4, 1026.0), (1e-9, 1e6), (3.0, 3.1)] {
            let targets = Ladder::spanning(low, high).targets();
            assert_eq!(targets.len(), TARGETS);
            assert!(targets[0] <= low && targets[15] >= high, "{targets:?}");
            assert!(targets[14] < high, "two targets wasted: {targets:?}");
        }
    }

    #[test]
    fn a_ladder_between_stays_strictly_inside() {
        for (low, high) in [(0.4, 1026.0), (1.0, 1.001), (2.0, 200.0)] {
            let targets = Ladder::between(low, high).targets();
            assert!(targets[0] > low && targets[14] < high, "{targets:?}");
        }
    }

    #[test]
    fn a_ladder_around_a_centre_is_dense_there_and_spans_the_bracket() {
        for (centre, gap, low, high) in [
            (1.62, 2.5e-5, 0.41, 1026.0),
            (5.0, 2.5e-7, 4.9, 5.1),
            (5.0, 2.5e-5, 1e-3, 1e3),
            (7.0, 2.5e-5, 6.9999, 7.0001),
        ] {
            let targets = Ladder::around(centre, gap, low, high).targets();
            assert!(targets[7] < centre && targets[8] > centre, "{targets:?}");
            assert!((targets[8] / targets[7] - 1.0 - gap).abs() < 0.07 * gap + 2e-7);
            assert!(
                targets[0] <= low * 1.001 && targets[15] >= high * 0.999,
                "{targets:?}"
            );
            assert!(targets.windows(2).all(|pair| pair[0] <= pair[1]));
        }
    }
}
