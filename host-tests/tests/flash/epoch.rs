//! Epoch in a drone's flash: it rises at every start, whatever fails.

use chacha20::ChaCha8Rng;
use host_tests::firmware::epoch::{KEY, WORDS, begin};
use host_tests::firmware::journal::{Journal, OVERHEAD};
use host_tests::firmware::ram::Ram;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::seed;

const ENTRY: usize = WORDS + OVERHEAD;

fn start(flash: &mut Ram, floor: u32) -> Option<(u32, bool)> {
    begin(&mut Journal::new(flash, WORDS, KEY), floor)
}

#[test]
fn the_epoch_rises_at_every_start_through_full_sectors() {
    let mut flash = Ram::blank(7 * ENTRY, 1);
    for begun in 1..=100 {
        assert_eq!(start(&mut flash, 1), Some((begun, true)));
    }
    // A new provisioning block may raise the epoch, but not lower it.
    assert_eq!(start(&mut flash, 1_000), Some((1_000, true)));
    assert_eq!(start(&mut flash, 500), Some((1_001, true)));
    assert_eq!(start(&mut flash, 1_002), Some((1_002, true)));
    let mut blank = Ram::blank(7 * ENTRY, 1);
    assert_eq!(start(&mut blank, 0), Some((1, true)), "0 is no epoch");
}

#[test]
fn no_epoch_follows_the_last_one() {
    let mut flash = Ram::blank(7 * ENTRY, 1);
    let last = u32::MAX - 1;
    assert_eq!(start(&mut flash, last), Some((last, true)));
    assert_eq!(start(&mut flash, 1), None);
    assert_eq!(start(&mut Ram::blank(7 * ENTRY, 1), u32::MAX), None);
}

/// Checks that no epoch is used twice, no matter when the power fails, even during an erase.
#[test]
fn no_epoch_comes_twice_whenever_power_fails() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(31));
    let mut failures = 0;
    for run in 0..300 {
        let mut flash = Ram::blank(5 * ENTRY, run);
        let mut used = 0;
        for _ in 0..60 {
            if rng.random_ratio(1, 2) {
                flash.power = Some(rng.random_range(1..=ENTRY + 1));
            }
            let (epoch, _) = start(&mut flash, 1).unwrap();
            // If the power failed, no frames were signed with this epoch.
            if flash.switch_on() {
                failures += 1;
            } else {
                assert!(epoch > used, "{used} came again: {epoch}");
                used = epoch;
            }
        }
        assert!(used > 20, "{used}");
    }
    println!("power failed {failures} times");
    assert!(failures > 1_000);
}

/// Checks that a flash that cannot be written does not set the epoch back.
#[test]
fn a_failed_write_never_decreases_the_epoch() {
    for worn in 0..=5 {
        let mut flash = Ram::blank(40 * ENTRY, 1);
        for _ in 0..10 {
            start(&mut flash, 3);
        }
        flash.worn = worn;
        let kept = worn < 4;
        assert_eq!(start(&mut flash, 3), Some((13, kept)));
        flash.worn = 0;
        assert_eq!(start(&mut flash, 3), Some((13 + u32::from(kept), true)));
    }
    let mut emulator = Ram::blank(0, 1);
    assert_eq!(start(&mut emulator, 9), Some((9, false)));
}
