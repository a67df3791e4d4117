//! The uploads that a drone keeps in its flash: the newest that was written down is there, whenever power fails.

use host_tests::firmware::uploads::{
    Found, Place, Record, SECTORS, WORDS, current, next, record, stale, upload,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::Upload;
use uav_relay_oracle::random::seed;
use uav_relay_sim::scenario::Scenario;
use uav_relay_tools::provision::block::Flight;

const BLANK: Record = [u32::MAX; WORDS];

/// The check sequence of a block.
const BLOCK: u32 = 0xB10C_B10C;

fn version(number: u16) -> Upload {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    Upload::new(flight.mission(), number, *flight.mission().config()).unwrap()
}

/// Two sectors. Bits only fall, but for an erase.
struct Flash([Vec<Record>; 2]);

impl Flash {
    fn blank(records: usize) -> Self {
        Self([vec![BLANK; records], vec![BLANK; records]])
    }

    fn found(&self, block: u32) -> [Found; 2] {
        [&self.0[0], &self.0[1]].map(|records| Found::of(records, block))
    }

    fn held(&self, block: u32) -> Option<u16> {
        let found = self.found(block);
        let at = current(found);
        let newest = found[at].newest?;
        let held = upload(&self.0[at][newest.record], block).unwrap();
        assert_eq!(held.id(), newest.mission_id);
        Some(held.version())
    }

    /// What a start does; with `failing` the erase is cut short, and any bit may have risen or not.
    fn start(&mut self, failing: Option<&mut ChaCha8Rng>) {
        let stale = stale(self.found(BLOCK));
        let sectors = self.0.iter_mut().zip(stale);
        let mut rng = failing;
        for (sector, _) in sectors.filter(|(_, stale)| *stale) {
            for word in sector.iter_mut().flatten() {
                *word |= rng.as_mut().map_or(u32::MAX, RngExt::random);
            }
        }
    }

    fn program(&mut self, place: Place, words: impl Iterator<Item = u32>) {
        let record = &mut self.0[place.sector][place.record];
        for (word, new) in record.iter_mut().zip(words) {
            *word &= new;
        }
    }
}

#[test]
fn records_fill_both_sectors_and_the_newest_counts() {
    let mut flash = Flash::blank(4);
    flash.start(None);
    assert_eq!(
        (flash.held(BLOCK), SECTORS[1] - SECTORS[0]),
        (None, 0x2_0000)
    );
    for number in 1..=8 {
        let place = next(flash.found(BLOCK)).unwrap();
        assert_eq!(
            place,
            Place {
                sector: usize::from(number > 4),
                record: usize::from(number - 1) % 4
            }
        );
        flash.program(place, record(&version(number), BLOCK).into_iter());
        assert_eq!(flash.held(BLOCK), Some(number));
        assert_eq!(flash.held(BLOCK + 1), None, "another block has none");
    }
    assert_eq!(next(flash.found(BLOCK)), None, "both are full");
    flash.start(None);
    assert_eq!(flash.held(BLOCK), Some(8));
    let first = Place {
        sector: 0,
        record: 0,
    };
    assert_eq!(next(flash.found(BLOCK)), Some(first));
    // With another block that is of no use either.
    assert_eq!(stale(flash.found(BLOCK)), [false, false]);
    assert_eq!(stale(flash.found(BLOCK + 1)), [false, true]);
}

#[test]
fn a_record_with_any_bit_changed_is_none() {
    let good = record(&version(77), BLOCK);
    assert_eq!(upload(&good, BLOCK), Some(version(77)));
    for bit in 0..32 * WORDS {
        let mut bad = good;
        bad[bit / 32] ^= 1 << (bit % 32);
        assert_eq!(upload(&bad, BLOCK), None, "bit {bit}");
    }
    assert_eq!(upload(&BLANK, BLOCK), None);
    assert_eq!(upload(&[0; WORDS], BLOCK), None);
}

/// Power fails in the middle of an erase, of a record or of a word: what was read back stays, and nothing else is ever held.
#[test]
fn no_upload_is_lost_whenever_power_fails() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(37));
    let mut failures = [0; 3];
    for _ in 0..200 {
        let mut flash = Flash::blank(3);
        let mut kept = None;
        for number in 1..=40_u16 {
            let failure = rng.random_range(0..6);
            if failure == 0 {
                // A start that fails in its erase, and one that does not.
                flash.start(Some(&mut rng));
                failures[0] += 1;
                assert_eq!(flash.held(BLOCK), kept);
            }
            if failure < 4 {
                flash.start(None);
            }
            assert_eq!(flash.held(BLOCK), kept);
            let Some(place) = next(flash.found(BLOCK)) else {
                continue;
            };
            let whole = record(&version(number), BLOCK);
            if failure == 1 || failure == 5 {
                let cut = rng.random_range(0..WORDS);
                let torn = whole[cut] | rng.random::<u32>();
                let words = whole[..cut].iter().copied().chain([torn]);
                flash.program(place, words);
                failures[1] += 1;
                // By chance the last word may be whole.
                let lucky = flash.0[place.sector][place.record] == whole;
                kept = if lucky { Some(number) } else { kept };
            } else {
                flash.program(place, whole.into_iter());
                assert_eq!(flash.0[place.sector][place.record], whole);
                failures[2] += 1;
                kept = Some(number);
            }
            assert_eq!(flash.held(BLOCK), kept);
        }
        assert!(kept > Some(20), "{kept:?}");
    }
    println!("erases cut short, records cut short, records: {failures:?}");
    assert!(failures.iter().all(|&count| count > 200));
}
