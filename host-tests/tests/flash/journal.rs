//! Journal in the flash: the last record survives any power failure.

use chacha20::ChaCha8Rng;
use host_tests::firmware::journal::{BLANK, Journal, OVERHEAD, WhenFull};
use host_tests::firmware::ram::Ram;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::seed;

const KEY: u32 = 0xB10C_B10C;
const KEPT: usize = 3;
const RECORD: usize = KEPT + OVERHEAD;

fn log(flash: &mut Ram) -> Journal<&mut Ram> {
    Journal::new(flash, KEPT, KEY)
}

fn newest(flash: &mut Ram) -> Option<Vec<u32>> {
    log(flash).newest::<KEPT>().map(Vec::from)
}

fn entry(number: u32) -> Vec<u32> {
    vec![number, !number, 7 * number]
}

#[test]
fn records_fill_both_sectors_and_the_newest_is_read() {
    // The sector has spare words that hold no record.
    let mut flash = Ram::blank(4 * RECORD + 3, 1);
    log(&mut flash).tidy();
    assert_eq!(newest(&mut flash), None);
    for number in 1..=8 {
        assert!(log(&mut flash).append(&entry(number), WhenFull::Refuse));
        assert_eq!(newest(&mut flash), Some(entry(number)));
        let mut other = Journal::new(&mut flash, KEPT, KEY + 1);
        assert_eq!(other.newest::<KEPT>(), None, "another key");
    }
    let full = flash.sectors.clone();
    assert!(!log(&mut flash).append(&entry(9), WhenFull::Refuse));
    assert_eq!((&full, flash.erased.len()), (&flash.sectors, 0));
    // Tidying at the start makes room for all records of a sector.
    log(&mut flash).tidy();
    assert_eq!(flash.erased, [0]);
    for number in 9..=12 {
        assert!(log(&mut flash).append(&entry(number), WhenFull::Refuse));
    }
    assert!(!log(&mut flash).append(&entry(13), WhenFull::Refuse));
    assert_eq!(newest(&mut flash), Some(entry(12)));
}

/// Checks that a full journal erases the sector without the newest record, and continues there.
#[test]
fn a_full_log_continues_in_the_older_sector() {
    let mut flash = Ram::blank(4 * RECORD, 1);
    for number in 1..=40 {
        assert!(log(&mut flash).append(&entry(number), WhenFull::Erase));
        assert_eq!(newest(&mut flash), Some(entry(number)));
    }
    assert_eq!(flash.erased, [0, 1, 0, 1, 0, 1, 0, 1]);
}

#[test]
fn a_record_with_any_changed_bit_is_ignored() {
    let mut flash = Ram::blank(4 * RECORD, 1);
    assert!(log(&mut flash).append(&entry(1), WhenFull::Refuse));
    assert!(log(&mut flash).append(&entry(2), WhenFull::Refuse));
    for bit in 0..32 * RECORD {
        let mut bad = flash.copy(0);
        bad.sectors[0][RECORD + bit / 32] ^= 1 << (bit % 32);
        assert_eq!(newest(&mut bad), Some(entry(1)), "bit {bit}");
    }
    for word in [0, BLANK] {
        let mut bad = flash.copy(0);
        bad.sectors[0].fill(word);
        assert_eq!(newest(&mut bad), None);
    }
}

#[test]
fn records_of_another_key_are_erased_at_a_start() {
    let mut flash = Ram::blank(4 * RECORD, 1);
    for number in 1..=6 {
        assert!(log(&mut flash).append(&entry(number), WhenFull::Refuse));
    }
    let mut other = Journal::new(&mut flash, KEPT, KEY + 1);
    other.tidy();
    assert_eq!(other.newest::<KEPT>(), None);
    assert_eq!(flash.erased, [0, 1]);
    assert!(flash.sectors.iter().flatten().all(|word| *word == BLANK));
}

#[test]
fn worn_flash_is_skipped() {
    for worn in 0..=5 {
        let mut flash = Ram::blank(20 * RECORD, 1);
        assert!(log(&mut flash).append(&entry(1), WhenFull::Erase));
        flash.worn = worn;
        let kept = log(&mut flash).append(&entry(2), WhenFull::Erase);
        assert_eq!(kept, worn < 4, "{worn}");
        assert_eq!(newest(&mut flash), Some(entry(1 + u32::from(kept))));
        flash.worn = 0;
        assert!(log(&mut flash).append(&entry(3), WhenFull::Erase));
        assert_eq!(newest(&mut flash), Some(entry(3)));
        assert!(flash.erased.is_empty());
    }
    let mut none = Ram::blank(0, 1);
    assert!(!log(&mut none).append(&entry(1), WhenFull::Erase));
}

/// Checks that a power failure at any moment neither loses stored records nor produces new ones.
///
/// The power may fail during an erase, within a record or within a word.
#[test]
fn no_record_is_lost_at_any_power_failure() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(37));
    let (mut cut, mut erases_cut, mut whole) = (0, 0, 0);
    for run in 0..300 {
        let mut flash = Ram::blank(3 * RECORD, run);
        let mut kept = None;
        for number in 1..=60 {
            if rng.random_ratio(1, 3) {
                flash.power = Some(rng.random_range(1..=RECORD + 2));
            }
            if rng.random_ratio(1, 2) {
                let before = flash.erased.len();
                log(&mut flash).tidy();
                let off = flash.power == Some(0);
                erases_cut += u32::from(off && flash.erased.len() > before);
                assert_eq!(newest(&mut flash), kept);
            }
            let before = flash.erased.len();
            let stands = log(&mut flash).append(&entry(number), WhenFull::Erase);
            let erased = flash.erased.len() > before;
            // By chance a truncated word may be complete.
            let found = newest(&mut flash);
            if stands || found == Some(entry(number)) {
                kept = Some(entry(number));
            }
            assert_eq!(found, kept, "run {run}, number {number}");
            whole += u32::from(stands);
            if flash.switch_on() {
                cut += 1;
                erases_cut += u32::from(erased && !stands);
            }
        }
        assert!(kept > Some(entry(30)), "{kept:?}");
    }
    println!("{cut} times power failed, in {erases_cut} erases; {whole} records");
    assert!(cut > 1_000 && erases_cut > 100 && whole > 5_000);
}
