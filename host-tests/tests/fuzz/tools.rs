//! Checks of the targets' tools: COBS in both directions, numbers over their whole ranges.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay_decode::envelope::{stuffed, unstuffed};
use uav_relay_fuzz::input::Input;

proptest! {
    #[test]
    #[cfg_attr(miri, ignore = "nothing of the crate runs here")]
    fn the_reference_decoder_reads_a_published_encoder(
        plain in vec(prop_oneof![Just(0), 1..=u8::MAX], 0..900),
        runs in vec(252..257_usize, 0..4),
    ) {
        let full: Vec<u8> = runs.iter().flat_map(|&len| [vec![7; len], vec![0]].concat()).collect();
        let last = full.len().saturating_sub(1);
        for plain in [&plain[..], &full, &full[..last]] {
            let wire = stuffed(plain);
            let (end, inside) = wire.split_last().unwrap();
            prop_assert_eq!(*end, 0);
            prop_assert!(!inside.contains(&0));
            prop_assert_eq!(unstuffed(inside), (plain.to_vec(), true));
        }
    }
}

#[test]
fn fuzz_input_reaches_both_ends_and_ends_in_zeros() {
    let (low, high) = (0.1_f32, 1e5_f32);
    assert_eq!(Input::new(&[0, 0]).scaled(low, high), low);
    assert_eq!(Input::new(&[255, 255]).scaled(low, high), high);
    assert_eq!(Input::new(&[0, 0]).even(-high, high), -high);
    assert_eq!(Input::new(&[255, 255]).even(-high, high), high);
    let mut input = Input::new(&[7]);
    assert_eq!((input.word(), input.is_empty(), input.byte()), (7, true, 0));
    assert_eq!(Input::new(&[9, 1, 2]).piece(), [1, 2]);
}
