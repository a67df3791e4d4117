//! Random waves: the crate and the rules agree to the bit on targets, levels and places.

use proptest::prelude::*;
use uav_relay::Band;
use uav_relay::optimiser::coded::{Coded, PLACES};
use uav_relay::optimiser::levels::Levels;
use uav_relay::optimiser::wave::Rungs;

use super::codec::{altitudes, code, place, rungs};
use super::config;
use super::strategies::{rises, widths};

fn bits(numbers: &[f32]) -> Vec<u32> {
    numbers.iter().map(|number| number.to_bits()).collect()
}

/// Distances from Tx to Rx.
fn distances() -> impl Strategy<Value = f32> {
    prop_oneof![1.0..=1e6_f32, 1.0..=10_000.0_f32, Just(1.0), Just(1e6)]
}

/// A band of altitudes, of which one in four is a single one.
fn bands() -> impl Strategy<Value = Band> {
    let wide = (0.1..500.0_f32, 0.0..500.0_f32);
    prop_oneof![3 => wide, 1 => (0.1..500.0_f32, Just(0.0))].prop_map(|(least_m, span_m)| Band {
        least_m,
        most_m: least_m + span_m,
    })
}

proptest! {
    #![proptest_config(config(20_000))]

    #[test]
    fn targets_follow_the_rules_to_the_bit((base, rise) in rises(), count in 1..=16_u8) {
        let crates = Rungs::from_parts(base, rise, count).unwrap();
        let targets: Vec<f32> = (0..count).map(|at| crates.target(at)).collect();
        prop_assert_eq!(bits(&targets), bits(&rungs(base, rise, count)));
        prop_assert!(targets.windows(2).all(|pair| pair[0] <= pair[1]), "never falling");
        prop_assert!(targets.iter().all(|target| target.is_normal()));
        prop_assert_eq!(crates.parts(), (base, rise, count));
    }

    #[test]
    fn the_same_targets_are_valid(base in any::<u32>(), rise in any::<u32>(), count in any::<u8>()) {
        let (base, rise) = (f32::from_bits(base), f32::from_bits(rise));
        let valid = (f32::MIN_POSITIVE..=1e30).contains(&base)
            && (0.0..=1e6).contains(&rise)
            && (1..=16).contains(&count);
        prop_assert_eq!(Rungs::from_parts(base, rise, count).is_some(), valid);
    }

    #[test]
    fn levels_follow_the_rules_to_the_bit(
        (centre_m, width_m) in widths(),
        count in prop_oneof![2 => 1..=64_u8, 1 => Just(9)],
        band in bands(),
    ) {
        let levels = Levels::from_parts(centre_m, width_m, count).unwrap();
        let crates: Vec<f32> = (0..count).map(|level| levels.altitude(band, level)).collect();
        let by_the_rules = altitudes(centre_m, width_m, count, (band.least_m, band.most_m));
        prop_assert_eq!(bits(&crates), bits(&by_the_rules));
        prop_assert!(crates.windows(2).all(|pair| pair[0] <= pair[1]), "never falling");
        let inside = crates.iter().all(|h| (band.least_m..=band.most_m).contains(h));
        prop_assert!(inside || width_m == 0.0);
    }

    #[test]
    fn places_follow_the_rules_to_the_bit(
        code_drawn in prop_oneof![4 => 0..=0x00FF_FFFF_u32, 1 => 0x00FF_FF00..=0x00FF_FFFF_u32, 1 => 0..256_u32],
        part in prop_oneof![4 => 0.0..=1.0_f32, 1 => Just(1.0), 1 => Just(0.0)],
        distance_m in distances(),
        at in 0..PLACES,
    ) {
        let [a, b, c, _] = code_drawn.to_le_bytes();
        let mut bytes = vec![0; 3 * at];
        bytes.extend([a, b, c]);
        let mut coded = Coded::new();
        coded.fill(&bytes);
        let read = coded.get(at, distance_m);
        prop_assert_eq!(read.map(f32::to_bits), place([a, b, c], distance_m).map(f32::to_bits));
        prop_assert!(read.is_none_or(|x_m| (0.0..=distance_m).contains(&x_m)));
        for x_m in [part * distance_m, read.unwrap_or(0.0)] {
            coded.set(at, Some(x_m), distance_m);
            let bytes = coded.bytes(at + 1);
            prop_assert_eq!(&bytes[3 * at..], code(x_m, distance_m));
            let kept = coded.get(at, distance_m).unwrap();
            prop_assert!(kept <= x_m, "toward Tx");
            prop_assert!(x_m - kept <= 1.3e-7 * distance_m, "{x_m} became {kept}");
        }
    }
}

/// The orders of operations that the document forbids would show.
#[test]
fn other_orders_of_operations_would_give_other_bits() {
    let (mut fused, mut product, mut divided) = (0, 0, 0);
    for k in 1..=1000_u16 {
        let (base, rise) = (1.1 + 0.003 * f32::from(k), 0.1 + 0.0007 * f32::from(k));
        let top = rungs(base, rise, 2)[1];
        fused += u32::from(base.mul_add(rise, base).to_bits() != top.to_bits());
        product += u32::from((base * (1.0 + rise)).to_bits() != top.to_bits());
        let code_drawn = 16_000 * u32::from(k);
        let [a, b, c, _] = code_drawn.to_le_bytes();
        let x_m = place([a, b, c], 1000.0).unwrap();
        #[expect(clippy::cast_precision_loss, reason = "it fits 24 bits")]
        let other = code_drawn as f32 * 1000.0 / 16_777_214.0;
        divided += u32::from(other.to_bits() != x_m.to_bits());
    }
    println!("{fused} fused, {product} with one product, {divided} divided last, of 1000");
    assert!(fused > 100 && product > 100 && divided > 20);
}
