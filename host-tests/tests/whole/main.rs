//! Recovery of the whole chain after any faults, with never two chains in flight at once.
//!
//! `COUNT` and `SEED` select other schedules; `STORY=1` prints their events.

mod air;
mod faults;
mod schedule;

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use self::air::Air;
use chacha20::ChaCha8Rng;
use host_tests::fixtures::voted;
use rand::{RngExt, SeedableRng};
use schedule::{SECOND, Schedule, random, with_copy, with_departures, without_steps};

/// Longest permitted time from the last fault until all relays have agreed positions in one view, s. A view is the
/// agreed membership of the chain.
const WHOLE_S: u64 = 120;

/// Returns the environment variable `name` as a number, or `usual`.
fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Result of one simulated schedule of faults.
#[derive(Clone, Debug)]
struct Measured {
    seed: u64,
    /// Time from the last fault until the chain was whole for good, s; `None` beyond 15 minutes. In a whole chain,
    /// all relays have agreed positions in one membership view.
    whole_s: Option<f64>,
    groups: usize,
    groups_s: f64,
    /// Longest time, s, in which two drones with the same index both had setpoints and received each other.
    both_s: f64,
    text: String,
}

fn flown(seed: u64, schedule: &Schedule) -> Measured {
    ended(seed, schedule, schedule.begun())
}

/// Simulates the chain `air` to the end of its faults, and on until all relays have agreed positions. Gives up after
/// 15 minutes.
fn ended(seed: u64, schedule: &Schedule, mut air: Air) -> Measured {
    let end = schedule.faults_end_us;
    air.run(end);
    // The chain has to stay whole for a minute.
    let mut at = end + (WHOLE_S + 60) * SECOND;
    air.run(at);
    let most = end + number("WAIT", 900) * SECOND;
    while air.whole_since_us.is_none() && at < most {
        at += 60 * SECOND;
        air.run(at);
    }
    let whole_us = air.whole_since_us.map(|since| since.saturating_sub(end));
    Measured {
        seed,
        whole_s: whole_us.map(|us| us as f64 / 1e6),
        groups: air.groups,
        groups_s: air.groups_us as f64 / 1e6,
        both_s: air.longest_both_us as f64 / 1e6,
        text: format!(
            "{} relays, {:?}, signed {}, faults end at {} s: {}",
            schedule.kind.mission.relays(),
            schedule.kind.wiring,
            schedule.kind.signed,
            end / SECOND,
            air.described()
        ),
    }
}

/// Runs `count` schedules on all cores. Returns the results in the order of their seeds.
fn flown_all(first: u64, count: u64, schedule: fn(u64) -> Schedule) -> Vec<Measured> {
    let next = AtomicU64::new(first);
    let all = Mutex::new(Vec::new());
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= first + count {
                        break;
                    }
                    let found = flown(seed, &schedule(seed));
                    all.lock().unwrap().push(found);
                }
            });
        }
    });
    let mut all = all.into_inner().unwrap();
    all.sort_by_key(|found: &Measured| found.seed);
    all
}

#[test]
fn every_schedule_ends_in_one_whole_chain_within_120_s() {
    ends_whole(random);
}

/// Checks schedules of faults in which relays also leave, wait outside as spares, and join again.
#[test]
fn schedules_with_departures_end_in_one_whole_chain_within_120_s() {
    ends_whole(with_departures);
}

fn ends_whole(schedule: fn(u64) -> Schedule) {
    let first = number("SEED", 1);
    let count = number("COUNT", 150);
    let all = flown_all(first, count, schedule);
    let late: Vec<&Measured> = all
        .iter()
        .filter(|found| found.whole_s.is_none_or(|s| s > WHOLE_S as f64))
        .collect();
    let two: Vec<&Measured> = all.iter().filter(|found| found.groups > 1).collect();
    let mut took: Vec<(f64, u64)> = all
        .iter()
        .map(|found| (found.whole_s.unwrap_or(f64::INFINITY), found.seed))
        .collect();
    took.sort_by(|one, other| one.0.total_cmp(&other.0));
    let at = |part: f64| took[((took.len() - 1) as f64 * part) as usize];
    println!(
        "{count} schedules: whole after {:.1} s (half of them), {:.1} s (99 %), {:.1} s (the slowest, SEED={}); {} later than {WHOLE_S} s; \
         {} with two chains at once",
        at(0.5).0,
        at(0.99).0,
        at(1.0).0,
        at(1.0).1,
        late.len(),
        two.len()
    );
    for found in late.iter().chain(&two).take(20) {
        println!(
            "SEED={}: whole after {:?} s, {} groups at {} s; {}",
            found.seed, found.whole_s, found.groups, found.groups_s, found.text
        );
    }
    assert!(late.is_empty() && two.is_empty());
}

/// Checks that of two drones with the same index, one loses its setpoint within 2 s.
///
/// The chain must be whole once one of the two is removed. Two agreements may be in use at the same time only if a cut
/// separates the two drones: then both drones vote, so that two parts of the chain can have a quorum.
#[test]
fn with_a_duplicate_one_chain_flies_and_recovers_later() {
    let (first, count) = (number("SEED", 1), number("COUNT", 150));
    let all = flown_all(first, count, with_copy);
    let mut faults = Vec::new();
    let mut took: Vec<f64> = Vec::new();
    for found in &all {
        let late = found.whole_s.is_none_or(|s| s > WHOLE_S as f64);
        let two = found.groups > 1 && with_copy(found.seed).is_uncut();
        if late || two || found.both_s > 2.0 {
            faults.push(found);
        }
        took.push(found.whole_s.unwrap_or(f64::INFINITY));
    }
    took.sort_by(f64::total_cmp);
    let both_s = all.iter().map(|found| found.both_s).fold(0.0, f64::max);
    let two = all.iter().filter(|found| found.groups > 1).count();
    println!(
        "{count} schedules with a copy: whole after {:.1} s (half of them), {:.1} s (the slowest); two setpoints for {both_s:.2} s at most; \
         {two} with two chains at once, {} faults",
        took[took.len() / 2],
        took[took.len() - 1],
        faults.len()
    );
    assert!(faults.is_empty(), "{faults:#?}");
}

/// Checks that a chain becomes whole again after schedules of faults that are hard to recover from.
///
/// The difficulties are a relay that knows far higher view numbers, an idle neighbour that is switched on elsewhere,
/// two interleaved chains, and two candidates for one position that are received in turn.
#[test]
fn schedules_that_once_got_stuck_end_in_one_chain() {
    for seed in [105, 218, 587, 593, 371, 1_463] {
        let found = flown(seed, &without_steps(seed));
        assert!(
            found.whole_s.is_some_and(|s| s <= WHOLE_S as f64),
            "{found:?}"
        );
        assert!(found.groups <= 1, "{found:?}");
    }
}

/// Returns a schedule in which relay `alone` neither sends nor receives frames for `minutes`.
fn one_alone(relays: u16, alone: usize, minutes: u64) -> Schedule {
    let mut schedule = Schedule::of(relays, 1);
    schedule.cut(|at| at == alone, 60 * SECOND, (60 + 60 * minutes) * SECOND);
    schedule
}

#[test]
fn a_radio_that_was_off_for_hours_joins_again_within_120_s() {
    let mut late = Vec::new();
    for (relays, alone) in [(2, 0), (3, 0), (3, 2), (5, 2), (8, 7)] {
        for minutes in [10, 25, 60, 240] {
            let found = flown(1, &one_alone(relays, alone, minutes));
            println!(
                "relay {} of {relays} alone for {minutes} minutes: whole after {:?} s; {}",
                alone + 1,
                found.whole_s,
                found.text
            );
            if found.whole_s.is_none_or(|s| s > WHOLE_S as f64) {
                late.push((relays, alone, minutes));
            }
        }
    }
    assert!(late.is_empty(), "{late:?}");
}

#[test]
fn a_drone_switched_on_hours_early_joins_within_120_s() {
    let mut late = Vec::new();
    for (relays, early) in [(2, 1), (4, 0), (4, 3), (6, 2)] {
        for minutes in [10, 25, 120] {
            let mut schedule = Schedule::of(relays, 1);
            for at in (0..usize::from(relays)).filter(|at| *at != early) {
                schedule.events[at].0 = 60 * minutes * SECOND;
            }
            schedule.faults_end_us = 60 * minutes * SECOND;
            let found = flown(1, &schedule);
            println!(
                "relay {} of {relays} {minutes} minutes early: whole after {:?} s; {}",
                early + 1,
                found.whole_s,
                found.text
            );
            if found.whole_s.is_none_or(|s| s > WHOLE_S as f64) {
                late.push((relays, early, minutes));
            }
        }
    }
    assert!(late.is_empty(), "{late:?}");
}

/// Checks that a chain recovers if one relay has a stored vote on a view with a far higher number. The vote is from an
/// earlier flight.
#[test]
fn a_relay_with_far_later_views_joins_within_120_s() {
    for (relays, later) in [(2_u16, 1), (4, 0), (5, 2), (8, 7)] {
        for number in [257, 3_000, 20_000, 100_000] {
            let schedule = Schedule::of(relays, 1);
            let mut air = schedule.begun();
            let loaded = schedule.kind.mission.digest();
            air.store(later, voted(loaded, relays, number, true));
            let found = ended(1, &schedule, air);
            println!(
                "relay {} of {relays} at view {number}: whole after {:?} s",
                later + 1,
                found.whole_s
            );
            assert!(
                found.whole_s.is_some_and(|s| s <= WHOLE_S as f64),
                "{found:?}"
            );
        }
    }
}

/// Runs chains whose clocks step by up to ten hours. In half of them a relay is isolated for three minutes.
///
/// If `forward` is true, about half of the steps are forward; otherwise all steps are back. Returns the number of
/// chains, the results of those that recovered late, and the results of those in which two agreements were in use at
/// the same time.
fn with_steps(forward: bool) -> (u64, Vec<Measured>, Vec<Measured>) {
    let (mut late, mut two) = (Vec::new(), Vec::new());
    let count = number("COUNT", 200);
    for seed in 1..=count {
        let rng = &mut ChaCha8Rng::seed_from_u64(seed);
        let relays = rng.random_range(2..=8);
        let mut schedule = Schedule::of(relays, seed);
        let all = usize::from(relays);
        if rng.random_bool(0.5) {
            let alone = rng.random_range(0..all);
            schedule.cut(|at| at == alone, 60 * SECOND, 240 * SECOND);
        }
        for _ in 0..rng.random_range(1..=6) {
            let at = rng.random_range(0..all);
            let at_us = rng.random_range(0..300 * SECOND);
            schedule.step(at, at_us, forward && rng.random_bool(0.5), rng);
        }
        let found = flown(seed, &schedule);
        if found.whole_s.is_none_or(|s| s > WHOLE_S as f64) {
            late.push(found);
        } else if found.groups > 1 {
            two.push(found);
        }
    }
    println!(
        "{count} chains, steps forward too: {forward}; {} whole later than {WHOLE_S} s, {} with two chains at once: {late:?} {two:?}",
        late.len(),
        two.len()
    );
    (count, late, two)
}

#[test]
fn clocks_that_step_back_leave_one_whole_chain() {
    let (_, late, two) = with_steps(false);
    assert!(late.is_empty() && two.is_empty());
}

/// Checks that clocks that step forward seldom let two agreements be in use at the same time.
///
/// A relay whose clock steps forward stops waiting for the other relays' leases too early. Two parts of the chain can
/// then use different agreements until these leases expire.
#[test]
fn clocks_that_step_forward_seldom_split_the_chain() {
    let (count, late, two) = with_steps(true);
    assert!(late.is_empty());
    assert!(two.len() as u64 * 100 <= count);
}
