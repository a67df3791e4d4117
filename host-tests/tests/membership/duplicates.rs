//! Two drones with equal index, number, key and epoch, as from a cloned image; `COUNT` sets the chains.

use std::cell::Cell;
use std::rc::Rc;

use chacha20::ChaCha8Rng;
use host_tests::bench::{Bench, between_neighbours};
use host_tests::make;
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use uav_relay::{Event, Identity, Port, Relay, Settings, Wiring};

use super::*;

/// Latency of a frame, and interval at which the setpoints are observed, ms.
const STEP_MS: u64 = 10;

/// Longest time for which one of two relays with the same index may keep its setpoint, ms. It counts from the first
/// frame between the two.
const LIMIT_MS: u64 = 2_000;

/// Longest permitted time in which two relays with the same index both have setpoints, ms. The two receive each other,
/// but few frames are sent in a settled chain.
const HEARD_MS: u64 = 10_000;

/// Longest permitted time in which two relays with the same index both have setpoints, ms. Frames are lost here, and
/// may be those that reveal the two relays.
const HEARD_LOSSY_MS: u64 = 20_000;

/// Longest permitted time in which two relays with the same index both have setpoints, ms. The two do not receive each
/// other, and several index claims in a row may be lost.
const HIDDEN_MS: u64 = 40_000;

/// Longest permitted time until one duplicate and all other relays have lasting setpoints, ms. Duplicates are two
/// relays with the same index.
const FLIES_MS: u64 = 60_000;

/// Time of observation after the second of two relays with the same index was switched on, ms.
const WATCHED_MS: u64 = 100_000;

/// Time at which two settled chains come into range of each other, ms.
const MEETING_MS: u64 = 200_000;
/// Time of observation after two settled chains have come into range, ms.
const MET_MS: u64 = 60_000;

/// Medium that connects two relays with the same index to each other and to the other relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Medium {
    /// A shared channel, on which the two relays with the same index receive each other.
    Shared,
    /// Links to both neighbours, on which the two relays with the same index receive each other.
    Links,
    /// Links to both neighbours, on which the two relays with the same index do not receive each other.
    HiddenLinks,
}

impl Medium {
    /// Returns the port at which relay `to` receives a frame that relay `from` sends at `port`, if any.
    fn carries(self, from: usize, port: Port, to: usize) -> Option<Port> {
        match port {
            Port::Shared => Some(port),
            _ if from == to => (self == Self::Links).then_some(port),
            _ => between_neighbours(from, port, to),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Case {
    medium: Medium,
    signed: bool,
    loss: f64,
    /// True if both duplicate relays are switched on at time 0.
    at_once: bool,
    seed: u64,
}

/// Durations measured in one simulated chain with two relays of the same index, ms.
#[derive(Clone, Copy, Debug, Default)]
struct Durations {
    /// Longest time in which both duplicates have setpoints. The measurement begins `LIMIT_MS` after the first frame
    /// that one duplicate receives from the other.
    both: u64,
    /// Longest time in which both duplicates have setpoints, from the start of the second duplicate.
    both_at_all: u64,
    /// Total time in which neither duplicate has a setpoint, from the start of the second duplicate.
    neither: u64,
    /// Time from the second duplicate's start until the whole chain has setpoints for good. One duplicate is a part
    /// of the chain then.
    flies: u64,
    /// True if the duplicate that was switched on first has the setpoint in the end.
    first_stays: bool,
    /// True for each duplicate that raised `Event::DuplicateIndex`.
    reported: [bool; 2],
}

fn flown(case: Case) -> Durations {
    let rng = &mut ChaCha8Rng::seed_from_u64(case.seed);
    let relays = rng.random_range(3..=8);
    let twice = rng.random_range(1..=relays);
    let mission = mission(relays);
    let wiring = match case.medium {
        Medium::Shared => Wiring::Shared,
        _ => Wiring::Pair,
    };
    let settings = Settings {
        wiring,
        auth: case.signed.then(|| make::auth([7; 32], 5)),
        ..Settings::default()
    };
    let later = if case.at_once {
        0
    } else {
        10 * rng.random_range(1..6_000)
    };
    let mut relay = |index, at| {
        let identity = Identity { network: 7, index };
        Relay::new(mission, identity, settings, rng.random(), at).unwrap()
    };
    let relays_on = (1..=relays)
        .map(|index| relay(index, Instant::ZERO))
        .collect();
    let copy = relay(twice, Instant::from_millis(later));
    let mut bench = Bench::new(relays_on, Instant::ZERO);
    bench.latency = Duration::from_millis(STEP_MS);
    bench.route = Box::new(move |from, port, to| case.medium.carries(from, port, to));
    // Time of the first frame between the duplicates.
    let heard = Rc::new(Cell::new(None));
    let (first, second) = (usize::from(twice) - 1, usize::from(relays));
    let (first_heard, mut losses) = (Rc::clone(&heard), ChaCha8Rng::seed_from_u64(case.seed));
    bench.fate = Box::new(move |frame| {
        let arrives = !losses.random_bool(case.loss);
        let is_between = [frame.from, frame.to]
            .iter()
            .all(|node| [first, second].contains(&(node - 1)));
        if arrives && is_between && first_heard.get().is_none() {
            first_heard.set(Some(frame.at.as_micros() / 1_000));
        }
        arrives
    });
    let mut found = Durations::default();
    let (mut run, mut run_at_all) = (0, 0);
    bench.run(Instant::from_millis(later));
    bench.switch_on(copy);
    for step in later / STEP_MS..(later + WATCHED_MS) / STEP_MS {
        let ms = step * STEP_MS;
        bench.run(Instant::from_millis(ms));
        let has = |at: usize| bench.relays[at].setpoint().is_some();
        let both = has(first) && has(second);
        let limited = heard.get().is_some_and(|heard| ms > heard + LIMIT_MS);
        run_at_all = if both { run_at_all + STEP_MS } else { 0 };
        run = if both && limited { run + STEP_MS } else { 0 };
        found.both = found.both.max(run);
        found.both_at_all = found.both_at_all.max(run_at_all);
        found.neither += if has(first) || has(second) {
            0
        } else {
            STEP_MS
        };
        let others = (0..relays.into()).all(|at| at == first || has(at));
        if !(others && (has(first) || has(second))) {
            found.flies = ms + STEP_MS - later;
        }
    }
    found.first_stays = bench.relays[first].setpoint().is_some();
    let taken = Event::DuplicateIndex { node: twice };
    found.reported = [first, second].map(|at| bench.has_raised(at, taken));
    found
}

/// Simulates `COUNT` chains with two relays of the same index, and prints the results. Returns the seed and the result
/// of each chain.
fn fly(medium: Medium, signed: bool, loss: f64, at_once: bool) -> Vec<(u64, Durations)> {
    let found: Vec<(u64, Durations)> = (0..number("COUNT", 12))
        .map(|seed| {
            let case = Case {
                medium,
                signed,
                loss,
                at_once,
                seed,
            };
            (seed, flown(case))
        })
        .collect();
    let most = |of: fn(&Durations) -> u64| found.iter().map(|(_, found)| of(found)).max().unwrap();
    let both = found.iter().filter(|(_, found)| found.both > 0).count();
    let stays = found.iter().filter(|(_, found)| found.first_stays).count();
    let reported = found
        .iter()
        .filter(|(_, found)| found.reported == [true; 2])
        .count();
    println!(
        "{medium:?}, signed {signed}, loss {loss}, at once {at_once}: {both} of {} chains with two setpoints later than {LIMIT_MS} ms after the \
         first frame heard, for {} ms at most; two setpoints at all for {} ms at most; none for {} ms at most; whole after {} ms at most; \
         the first stays in {stays}; both report it in {reported}",
        found.len(),
        most(|found| found.both),
        most(|found| found.both_at_all),
        most(|found| found.neither),
        most(|found| found.flies),
    );
    found
}

/// Checks that two relays with the same index both have setpoints for at most `most_ms`. At least one of the two must
/// report the other. The whole chain must have setpoints within `FLIES_MS`.
fn at_most_one_flies(medium: Medium, most_ms: u64) {
    let mut faults = Vec::new();
    for kind in 0..8 {
        let (signed, loss, at_once) = (kind & 4 > 0, [0.0, 0.3][kind >> 1 & 1], kind & 1 == 0);
        for (seed, found) in fly(medium, signed, loss, at_once) {
            let reported = found.reported.contains(&true);
            let both = found.both > 0 || found.both_at_all > most_ms;
            if both || found.flies > FLIES_MS || !reported {
                faults.push((signed, loss, at_once, seed, found));
            }
        }
    }
    assert!(
        faults.is_empty(),
        "{} of them: {:#?}",
        faults.len(),
        &faults[..faults.len().min(4)]
    );
}

#[test]
fn one_of_two_duplicates_on_a_channel_has_a_setpoint() {
    at_most_one_flies(Medium::Shared, HEARD_MS);
}

#[test]
fn one_of_two_duplicates_on_links_has_a_setpoint() {
    at_most_one_flies(Medium::Links, HEARD_MS);
}

#[test]
fn one_of_two_hidden_duplicates_has_a_setpoint() {
    at_most_one_flies(Medium::HiddenLinks, HIDDEN_MS);
}

/// Test of two chains that meet on a shared channel. A relay of the first chain and a relay of the second chain have
/// the same index; these two relays are the duplicates.
///
/// Half of the other relays are in one chain, and half in the other. The chains come into range of each other once both
/// have agreed on positions.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    relays: u16,
    twice: u16,
    loss: f64,
    /// Epochs of the two duplicate relays. An epoch is a number that rises at each start of a relay.
    epochs: [u32; 2],
    /// True if only the two duplicates receive each other after the meeting, false if all relays do.
    only_duplicates: bool,
    seed: u64,
}

impl Meeting {
    fn of(seed: u64, loss: f64) -> Self {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        // Only with an odd number of relays both chains have a quorum. Every index in turn.
        let lines = [3, 5, 7].map(|relays| (1..=relays).map(move |twice| (relays, twice)));
        let lines: Vec<(u16, u16)> = lines.into_iter().flatten().collect();
        let (relays, twice) = lines[usize::try_from(seed).unwrap() % lines.len()];
        Self {
            relays,
            twice,
            loss,
            epochs: [[5, 5], [5, 6], [6, 5]][rng.random_range(0..3)],
            only_duplicates: rng.random(),
            seed,
        }
    }

    /// Draws the relays that form a chain with the first duplicate. Returns their indices, without the duplicate's.
    fn first_chain(&self, rng: &mut ChaCha8Rng) -> Vec<u16> {
        let mut others: Vec<u16> = (1..=self.relays).collect();
        others.retain(|index| *index != self.twice);
        // Neighbours are at most four indices apart.
        let links = |chain: &[u16]| {
            let mut chain = [chain, &[self.twice]].concat();
            chain.sort_unstable();
            chain.windows(2).all(|pair| pair[1] - pair[0] <= 4)
        };
        loop {
            others.shuffle(rng);
            let (first, second) = others.split_at(others.len() / 2);
            if links(first) && links(second) {
                return first.to_vec();
            }
        }
    }

    /// Returns the longest time in which both duplicates have setpoints after the meeting, ms. Also returns how many
    /// duplicates have a setpoint in the end.
    fn fly(self) -> (u64, usize) {
        let rng = &mut ChaCha8Rng::seed_from_u64(self.seed);
        let chain = self.first_chain(rng);
        let mission = mission(self.relays);
        let mut relay = |index, epoch| {
            let identity = Identity { network: 7, index };
            let settings = Settings {
                wiring: Wiring::Shared,
                auth: Some(make::auth([7; 32], epoch)),
                ..Settings::default()
            };
            Relay::new(mission, identity, settings, rng.random(), Instant::ZERO).unwrap()
        };
        let relays = (1..=self.relays)
            .map(|index| relay(index, self.epochs[0]))
            .collect();
        let copy = relay(self.twice, self.epochs[1]);
        let mut bench = Bench::new(relays, Instant::ZERO);
        bench.latency = Duration::from_millis(STEP_MS);
        bench.route = Box::new(|_, port, _| Some(port));
        let meeting = Instant::from_millis(MEETING_MS + STEP_MS * rng.random_range(0..1_000));
        let duplicates = [self.twice, self.relays + 1].map(usize::from);
        let mut losses = ChaCha8Rng::seed_from_u64(self.seed);
        bench.fate = Box::new(move |frame| {
            let is_first = |node| {
                node == duplicates[0] || chain.iter().any(|index| usize::from(*index) == node)
            };
            let ends = [frame.from, frame.to];
            let meets = !self.only_duplicates || ends.iter().all(|end| duplicates.contains(end));
            let in_range =
                is_first(frame.from) == is_first(frame.to) || frame.at >= meeting && meets;
            in_range && !losses.random_bool(self.loss)
        });
        bench.switch_on(copy);
        bench.run(meeting);
        let flying = |bench: &Bench| {
            let has = |node: &&usize| bench.relays[**node - 1].setpoint().is_some();
            duplicates.iter().filter(has).count()
        };
        assert_eq!(flying(&bench), 2, "both chains hold: {self:?}");
        let (mut run, mut longest) = (0, 0);
        for _ in 0..MET_MS / STEP_MS {
            bench.run_for(Duration::from_millis(STEP_MS));
            run = if flying(&bench) == 2 {
                run + STEP_MS
            } else {
                0
            };
            longest = longest.max(run);
        }
        let taken = Event::DuplicateIndex { node: self.twice };
        let reported = |node: &usize| bench.has_raised(node - 1, taken);
        assert!(duplicates.iter().any(reported), "{self:?}");
        (longest, flying(&bench))
    }
}

/// Checks that one of two duplicates in settled chains gives up its setpoint when the chains meet. Duplicates are
/// relays with the same index. Only handshakes reveal a duplicate, and settled chains send them only with the lease
/// renewals.
#[test]
fn one_of_two_settled_duplicates_loses_its_setpoint() {
    let mut faults = Vec::new();
    for (loss, limit_ms) in [(0.0, HEARD_MS), (0.3, HEARD_LOSSY_MS)] {
        let mut longest = Vec::new();
        for seed in 0..number("COUNT", 45) {
            let meeting = Meeting::of(seed, loss);
            let (both, flying) = meeting.fly();
            if both > limit_ms || flying != 1 {
                faults.push((meeting, both, flying));
            }
            longest.push(both);
        }
        longest.sort_unstable();
        println!(
            "two settled chains that meet, loss {loss}: two setpoints for {} ms (half of {}), {} ms at most",
            longest[longest.len() / 2],
            longest.len(),
            longest[longest.len() - 1]
        );
    }
    assert!(
        faults.is_empty(),
        "{} of them: {:#?}",
        faults.len(),
        &faults[..faults.len().min(4)]
    );
}
