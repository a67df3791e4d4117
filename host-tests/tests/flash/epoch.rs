//! The epoch that a drone keeps in its flash: it rises, whatever happens.

use host_tests::firmware::epoch::{Entry, Step, begin, entry, next};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay_oracle::random::seed;

const BLANK: Entry = [u32::MAX; 2];

/// Two sectors. Bits only fall, but for an erase.
struct Flash([Vec<Entry>; 2]);

impl Flash {
    fn blank(entries: usize) -> Self {
        Self([vec![BLANK; entries], vec![BLANK; entries]])
    }

    fn next(&self, floor: u32) -> Option<Step> {
        next([&self.0[0], &self.0[1]], floor)
    }

    fn program(&mut self, step: Step, words: Entry) {
        let place = &mut self.0[step.sector][step.entry];
        *place = [place[0] & words[0], place[1] & words[1]];
    }

    fn erase(&mut self, step: Step) {
        self.0[step.sector].fill(BLANK);
    }

    fn says(&self, step: Step) -> bool {
        self.0[step.sector][step.entry] == entry(step.epoch)
    }

    /// A start that nothing disturbs.
    fn start(&mut self, floor: u32) -> u32 {
        let step = self.next(floor).unwrap();
        if step.erase {
            self.erase(step);
        }
        self.program(step, entry(step.epoch));
        assert!(self.says(step), "it does not read back: {step:?}");
        step.epoch
    }
}

#[test]
fn the_epoch_rises_at_every_start_through_full_sectors() {
    let mut flash = Flash::blank(7);
    for start in 0..100 {
        assert_eq!(flash.start(1), start + 1);
    }
    // A new block may raise it, and never lower it.
    assert_eq!(flash.start(1_000), 1_000);
    assert_eq!(flash.start(500), 1_001);
    assert_eq!(flash.start(1_002), 1_002);
    assert_eq!(Flash::blank(7).start(0), 1, "0 is no epoch");
}

#[test]
fn after_the_last_epoch_there_is_none() {
    let mut flash = Flash::blank(7);
    assert_eq!(flash.start(0xFFFF_FFFE), 0xFFFF_FFFE);
    assert_eq!(flash.next(1), None);
    assert_eq!(Flash::blank(7).next(u32::MAX), None);
}

/// Power fails at any moment, in the middle of an erase or of a word too: no epoch that was used comes again.
#[test]
fn no_epoch_comes_twice_whenever_power_fails() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(31));
    let mut failures = [0; 4];
    for _ in 0..300 {
        let mut flash = Flash::blank(5);
        let mut used = 0;
        for _ in 0..60 {
            // A word that power left half written may be a large number, but its complement is not beside it.
            let step = flash.next(1).unwrap();
            assert!(step.epoch > used, "{used} came again: {step:?}");
            let [first, second] = entry(step.epoch);
            let failure = rng.random_range(0..8);
            if step.erase && failure == 0 {
                // Any bit may have risen, or not.
                for entry in &mut flash.0[step.sector] {
                    *entry = entry.map(|word| word | rng.random::<u32>());
                }
                failures[0] += 1;
                continue;
            }
            if step.erase {
                flash.erase(step);
            }
            match failure {
                1 => failures[1] += 1,
                2 => {
                    flash.program(step, [first | rng.random::<u32>(), u32::MAX]);
                    failures[2] += 1;
                }
                3 => {
                    flash.program(step, [first, second | rng.random::<u32>()]);
                    failures[3] += 1;
                }
                _ => flash.program(step, [first, second]),
            }
            // A relay signs only with what it reads back.
            if flash.says(step) {
                used = step.epoch;
            }
        }
        assert!(used > 20, "{used}");
    }
    println!("failures: {failures:?}");
    assert!(failures.iter().all(|&failures| failures > 100));
}

/// A place that cannot be written costs nothing; a flash that cannot be written at all does not put the epoch back.
#[test]
fn a_write_that_fails_never_puts_the_epoch_back() {
    for worn in 0..=5 {
        let mut flash = Flash::blank(40);
        for _ in 0..10 {
            flash.start(3);
        }
        let before = flash.0.clone();
        let mut tried = Vec::new();
        let begun = begin([&before[0], &before[1]], 3, |step| {
            tried.push(step.entry);
            let sound = tried.len() > worn;
            // A worn place takes half of what is written.
            let [epoch, complement] = entry(step.epoch);
            flash.program(
                step,
                if sound {
                    [epoch, complement]
                } else {
                    [epoch, u32::MAX]
                },
            );
            sound
        });
        let (epoch, kept) = begun.unwrap();
        assert_eq!(
            (epoch, kept, tried.len()),
            (13, worn < 4, (worn + 1).min(4))
        );
        let again = flash.next(3).unwrap();
        assert_eq!(again.epoch, if kept { 14 } else { 13 });
        assert!(
            again.entry > *tried.last().unwrap(),
            "a worn place is left alone"
        );
    }
    // The last place of a sector, and none that can be written.
    let full = vec![entry(7); 8];
    let blank = vec![BLANK; 8];
    let mut steps = Vec::new();
    let begun = begin([&full, &blank], 1, |step| {
        steps.push((step.sector, step.entry, step.erase));
        false
    });
    assert_eq!(begun, Some((8, false)));
    assert_eq!(steps[0], (1, 0, false));
    assert_eq!(
        begin([&[], &[]], 9, |_| true),
        Some((9, false)),
        "an emulator"
    );
}
