//! COBS in both directions.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay_decode::envelope::{stuffed, unstuffed};

proptest! {
    #[test]
    fn stuffed_bytes_are_read_again(
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
