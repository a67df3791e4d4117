//! Ladder: the target SIRs of one pass along the chain (a sweep), encoded in six bytes.
//!
//! Sixteen targets rise by gaps that are smallest in the middle: target j + 1 is target j times 1 + gap x growth^|j - 7|. So a
//! ladder is dense near the expected optimum and still spans the whole bracket. It is computed from target 7 in both directions,
//! so that rounding errors are largest at the ends. Every relay computes the targets from the six bytes with the same f32
//! operations, hence to the same bits.

use super::PerTarget;
use crate::root::sqrt;

/// Number of target SIRs in a full ladder, the list of targets of one sweep along the chain.
pub const TARGETS: usize = 16;

/// Number of gaps from target 7 to target 15. The 16 targets of a full ladder are numbered 0 to 15.
const HALF: usize = TARGETS / 2;

/// Ladder: rising list of target SIRs, linear, for one pass along the chain (a sweep). Encoded as one target and two
/// one-byte codes.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Ladder {
    /// Eighth of the 16 targets, linear SIR: the lower of the two middle targets. In a list of one target, `anchor` is
    /// this target.
    anchor: f32,
    /// Code of the relative gap between the two middle targets: their difference divided by the lower one. The code is
    /// a float of 5 exponent and 3 mantissa bits. With code 0, `anchor` is the only target.
    gap: u8,
    /// Code of the growth of the gaps from the middle of the list to its ends. Each gap is 1 + `growth` / 16 times the
    /// next gap toward the middle.
    growth: u8,
    /// True for a plain pass: every relay takes the farthest x that meets the target. False if a relay may stop before
    /// that x, so that the next relay of the pass gets farther.
    plain: bool,
}

impl Ladder {
    /// Returns a ladder (list of targets) with the single SIR `target`, above 0. If the chain meets `target`, the last
    /// relay commits the chain to it: the relays take their positions for `target`.
    pub const fn single(target: f32) -> Self {
        Self {
            anchor: target,
            gap: 0,
            growth: 0,
            plain: false,
        }
    }

    /// Returns a ladder with the same targets, for a plain pass if `plain` is true. In a plain pass every relay takes
    /// the farthest x that meets the target.
    pub const fn plainly(self, plain: bool) -> Self {
        Self { plain, ..self }
    }

    /// Returns true for a plain pass, in which every relay takes the farthest x that meets the target. Otherwise a
    /// relay may stop before this x, so that the next relay gets farther.
    pub const fn is_plain(&self) -> bool {
        self.plain
    }

    /// Returns 16 targets (a ladder) in equal ratios, from just below `low` to just above `high`. 0 < `low` < `high`.
    pub fn spanning(low: f32, high: f32) -> Self {
        Self::centred(
            geometric_mean(low, high),
            gap_code(equal_gap(low, high, 15.0)).saturating_add(1),
            0,
        )
    }

    /// Returns 16 targets (a ladder) in equal ratios, strictly between `low` and `high`. 0 < `low` < `high`.
    pub fn between(low: f32, high: f32) -> Self {
        Self::centred(
            geometric_mean(low, high),
            gap_code(equal_gap(low, high, 17.0)),
            0,
        )
    }

    /// Returns 16 targets (a ladder) that are dense around `centre` and span [`low`, `high`]. `centre` is in the middle
    /// of a gap between two targets. The width of this gap is `gap` times its lower target. All other gaps grow with
    /// their distance from it.
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

    /// Decodes a ladder (list of targets); `None` if it is invalid. A ladder is valid if all targets are normal f32s
    /// above zero, and the encoding is unique. A single target (`gap` 0) must have `growth` 0.
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

    /// Returns `anchor`, `gap` and `growth`, the encoding that [`Ladder::from_parts`] decodes.
    pub const fn parts(&self) -> (f32, u8, u8) {
        (self.anchor, self.gap, self.growth)
    }

    /// Returns true if the ladder has a single target. If the chain meets this target, the last relay commits the chain
    /// to it: the relays take their positions for it.
    pub const fn is_single(&self) -> bool {
        self.gap == 0
    }

    /// Number of target SIRs in the list, 1 or [`TARGETS`].
    #[allow(clippy::len_without_is_empty, reason = "there is always a target")]
    pub const fn len(&self) -> usize {
        if self.is_single() { 1 } else { TARGETS }
    }

    /// Returns the target SIRs, linear, in ascending order.
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

/// Returns the ratio of a ladder's highest target to the lower of its two middle targets. `gap` and `growth` are the
/// codes in a [`Ladder`].
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

/// Returns the gap, divided by the lower target, for the byte `code`: (1 + m / 8) 2^(e - 25). m is the number in the
/// low three bits of `code`, e the number in its high five bits.
const fn gap_value(code: u8) -> f32 {
    f32::from_bits(((code as u32) << 20) + (102 << 23))
}

/// Returns the one-byte code, 1 to 254, whose gap is nearest to `gap`. A gap is relative: the difference of two
/// targets, divided by the lower one.
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
