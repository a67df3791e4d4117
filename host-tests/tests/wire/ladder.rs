//! Random ladders (coded lists of target SIRs): the crate and the rules agree, to the bit.

use proptest::prelude::*;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay_decode::range::targets;

use super::config;
use super::message::WireMessage;
use super::strategies::kinds;

fn bits(targets: &[f32]) -> Vec<u32> {
    targets.iter().map(|target| target.to_bits()).collect()
}

/// Returns the target SIRs of a sweep message, computed with fused multiply-add. The wire format forbids fused multiply-add, because the
/// results differ.
fn fused(anchor: f32, gap: u8, growth: u8) -> Vec<f32> {
    let mut gap = f32::from_bits(0x3300_0000 + (u32::from(gap) << 20));
    let mut targets = targets(anchor, 1, 0);
    for k in 7..15 {
        targets[k + 1] = targets[k].mul_add(gap, targets[k]);
        gap *= 1.0 + f32::from(growth) / 16.0;
    }
    targets[8..].to_vec()
}

/// Returns the target SIRs of a sweep message as encoded: absolute `anchor`, `gap` and `growth`.
fn ladder_of(sweep: &WireMessage) -> (f32, u8, u8) {
    let code = |name| sweep.number(name) as u8;
    let anchor = sweep.number("anchor") as f32;
    (anchor.abs(), code("gap"), code("growth"))
}

proptest! {
    #![proptest_config(config(20_000))]

    #[test]
    fn targets_follow_the_rules_to_the_bit(sweep in kinds(&["Sweep"])) {
        let (anchor, gap, growth) = ladder_of(&sweep);
        let ladder = Ladder::from_parts(anchor, gap, growth).unwrap();
        let by_the_rules = targets(anchor, gap, growth);
        prop_assert_eq!(bits(&ladder.targets()), bits(&by_the_rules));
        prop_assert_eq!(ladder.len(), by_the_rules.len());
        prop_assert_eq!(ladder.parts(), (anchor, gap, growth));
        prop_assert!(by_the_rules.windows(2).all(|pair| pair[0] <= pair[1]), "never falling");
    }

    #[test]
    fn the_same_ladders_are_valid(anchor in any::<u32>(), gap in any::<u8>(), growth in any::<u8>()) {
        let anchor = f32::from_bits(anchor);
        let targets = targets(anchor, gap, growth);
        let unique = gap != 0 || growth == 0;
        let valid = unique && targets[0] >= f32::MIN_POSITIVE && targets[targets.len() - 1] < f32::INFINITY;
        prop_assert_eq!(Ladder::from_parts(anchor, gap, growth).is_some(), valid);
    }
}

#[test]
fn a_fused_multiply_add_would_give_other_bits() {
    let differ = (1..=255_u8)
        .filter(|&gap| bits(&targets(1.1, gap, 5)[8..]) != bits(&fused(1.1, gap, 5)))
        .count();
    println!("{differ} of 255 ladders differ");
    assert!(differ > 50);
}

#[test]
fn the_gap_codes_follow_the_document() {
    for gap in 1..=u8::MAX {
        let (e, m) = (i32::from(gap >> 3), f32::from(gap & 7));
        let value = (1.0 + m / 8.0) * 2_f32.powi(e - 25);
        assert_eq!(value.to_bits(), 0x3300_0000 + (u32::from(gap) << 20));
        let upper = Ladder::from_parts(1.0, gap, 0).unwrap().targets()[8];
        assert_eq!(upper, 1.0 + value, "{gap}");
    }
}
