//! Single faults: a one-way or flapping link, a relay with another mission, an epoch that goes back.

use std::collections::BTreeSet;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::Wiring;

use super::air::Air;
use super::number;
use super::schedule::{SECOND, Schedule};
use host_tests::fixtures::mission;

/// Returns the number of times that all relays together raised the event `name`.
fn event_count(air: &Air, name: &str) -> u32 {
    let of = |((_, event), times): (&(usize, String), &u32)| (event == name).then_some(*times);
    air.events.iter().filter_map(of).sum()
}

/// Checks that a chain of four with a one-way link has agreed positions nearly all the time. The chain is permitted to
/// leave one relay out.
#[test]
fn a_permanent_one_way_link_leaves_out_one_relay_for_good() {
    let mut late = Vec::new();
    for (from, to) in [(2, 1), (1, 2), (0, 1), (1, 0), (3, 2), (2, 3)] {
        for seed in 0..10 {
            let mut schedule = Schedule::of(4, seed);
            schedule.cut_link_between(from, to, 0, 3_600 * SECOND);
            let mut air = schedule.begun();
            air.spare = 1;
            air.run(900 * SECOND);
            air.measure();
            let found = event_count(&air, "NeighbourBack");
            println!(
                "relay {} deaf to {}: flown {:.1} s, the first at {:?} s, the longest pause {:.1} s, {found} times found, {} frames; {}",
                to + 1,
                from + 1,
                air.flown_us as f64 / 1e6,
                air.first_us.map(|us| us as f64 / 1e6),
                air.longest_us as f64 / 1e6,
                air.frames,
                air.described()
            );
            if air.longest_us > 30 * SECOND || found > 20 || air.flown_us < 800 * SECOND {
                late.push((from, to, seed));
            }
        }
    }
    assert!(late.is_empty(), "{late:?}");
}

/// Simulates eight relays with a flapping link for two hours.
///
/// Returns the relays, and the fraction of the time after the first agreement in which at least seven relays had
/// positions of one agreement. The link is between relays `link + 1` and `link + 2`.
fn flown_with_flaps(link: usize, (up_us, down_us): (u64, u64), seed: u64) -> (Air, f64) {
    let mut schedule = Schedule::of(8, seed);
    schedule.kind.reach = 3;
    let end_us = 7_200 * SECOND;
    schedule.flap((link, link + 1), (down_us, up_us), 60 * SECOND, end_us);
    let mut air = schedule.begun();
    air.spare = 1;
    air.run(end_us);
    air.measure();
    let first_us = air.first_us.unwrap_or(0);
    let share = air.flown_us as f64 / (air.now_us - first_us) as f64;
    (air, share)
}

#[test]
fn one_flapping_link_costs_a_tenth_of_the_time_at_most() {
    let mut worst = Vec::new();
    println!(
        "| up | down | link 1-2 | longest pause | link 4-5 | longest pause | link 7-8 | longest pause |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- |");
    for (up, down) in [
        (3, 2),
        (5, 10),
        (10, 5),
        (20, 20),
        (30, 60),
        (60, 30),
        (100, 200),
        (200, 100),
    ] {
        let mut row = vec![format!("| {up} s | {down} s |")];
        for link in [0, 3, 6] {
            let (air, share) = flown_with_flaps(link, (up * SECOND, down * SECOND), 1);
            let pause_s = air.longest_us as f64 / 1e6;
            row.push(format!(" {:.1} % | {pause_s:.0} s |", 100.0 * share));
            if share < 0.9 {
                worst.push((share, link, up, down));
            }
        }
        println!("{}", row.concat());
    }
    assert!(worst.is_empty(), "{worst:?}");
}

/// Checks that a relay outside the chain does not attract a relay of the chain. Relay 3 is left out of the chain, and
/// has links to neither relay 1 nor relay 2. Relay 3's hello must not count these two as connected to relay 3:
/// otherwise relay 6 chooses relay 3 as its neighbour in place of relay 5 every 16 s.
#[test]
fn a_left_out_relay_attracts_no_other() {
    let (air, share) = flown_with_flaps(2, (10_191_000, 25_107_000), 325);
    println!("{:.1} %; {}", 100.0 * share, air.described());
    assert!(share > 0.98, "{share}");
}

/// Random seeds of links that stay up a little longer than the longest hold-down of 90 s.
///
/// The hold-down is a waiting time: after repeated losses of a link, a relay does not use the link until it has passed.
/// In these runs one end of the link uses the link before the other end does. Soon afterwards the link is lost again.
const UP_FOR_100_S: [u64; 6] = [206, 264, 321, 520, 663, 878];

/// Checks that one flapping link costs at most a tenth of the time with agreed positions. The link fails and returns
/// once in each period of 5 s to 300 s.
#[test]
fn random_flapping_links_cost_a_tenth_of_the_time_at_most() {
    let (first, count) = (number("SEED", 1), number("COUNT", 20));
    let others = UP_FOR_100_S.iter().filter(|_| count == 20);
    let seeds: BTreeSet<u64> = (first..first + count).chain(others.copied()).collect();
    let mut all: Vec<(f64, u64, String)> = seeds
        .into_par_iter()
        .map(|seed| {
            let rng = &mut ChaCha8Rng::seed_from_u64(seed);
            let period_s = 5.0 * f64::powf(60.0, rng.random_range(0.0..1.0));
            let up_s = period_s * rng.random_range(0.1..0.9);
            let link = rng.random_range(0..7);
            let spans = [up_s, period_s - up_s].map(|s| (s * 1e6) as u64);
            let (_, share) = flown_with_flaps(link, (spans[0], spans[1]), seed);
            let kind = format!("link {}, {up_s:.0} s of {period_s:.0} s up", link + 1);
            (share, seed, kind)
        })
        .collect();
    all.sort_by(|one, other| one.0.total_cmp(&other.0));
    let below = all.iter().filter(|(share, ..)| *share < 0.9).count();
    let median = all[all.len() / 2].0;
    println!(
        "{} flapping links: {below} below 90 %, median {:.1} %, worst {:?}",
        all.len(),
        100.0 * median,
        &all[..all.len().min(8)]
    );
    assert!(below == 0 && median > 0.99, "{all:?}");
}

/// Checks that a neighbour with another mission is reported seldom. No event may occur more than 22 times in ten
/// minutes.
#[test]
fn a_mission_mismatch_is_reported_once_a_minute() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut schedule = Schedule::of(4, 1);
        schedule.kind.wiring = wiring;
        schedule.kind.stranger = Some((1, mission(5)));
        let mut air = schedule.begun();
        air.run(600 * SECOND);
        let most = air.events.iter().max_by_key(|(_, times)| **times);
        println!(
            "{wiring:?}: {} times, {} frames, most {most:?}; {}",
            event_count(&air, "MissionMismatch"),
            air.frames,
            air.described()
        );
        assert!(
            most.is_some_and(|(_, times)| *times <= 22),
            "{:?}",
            air.events
        );
    }
}

/// Checks that the chain reports a relay whose epoch is lower after a reboot, and sends few frames. An epoch is the
/// part of a nonce that rises at every start of a relay. At most 6 frames a second are permitted.
#[test]
fn a_returning_epoch_on_wires_is_reported_and_costs_little() {
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut schedule = Schedule::of(4, 1);
        schedule.kind.wiring = wiring;
        schedule.kind.signed = true;
        schedule.kind.goes_back = Some(1);
        schedule.reboot(1, 60 * SECOND, 70 * SECOND);
        let mut air = schedule.begun();
        air.run(300 * SECOND);
        let before = air.frames;
        air.run(3_900 * SECOND);
        let rate = (air.frames - before) as f64 / 3_600.0;
        println!(
            "{wiring:?}: {rate:.1} frames a second, events {:?}; {}",
            air.events,
            air.described()
        );
        assert!(event_count(&air, "EpochWentBack") > 0);
        assert!(rate < 6.0, "{rate} frames a second");
    }
}
