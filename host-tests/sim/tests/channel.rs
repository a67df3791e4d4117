//! Capacity of a shared channel. How many relays agree and stay in agreement, and with how many messages.
//!
//! `-- --ignored --nocapture` prints the tables of long chains.
#![cfg(test)]

use uav_relay::{Instant, Mission};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::report::seconds;
use uav_relay_sim::simulator::chain::{run, run_seeds};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

/// Returns the mission of the paper's scenario for `relays` relays, with a minimum separation of 0.1 m.
fn close(relays: u16) -> Mission {
    let scenario = Scenario {
        min_separation_m: 0.1,
        ..Scenario::default()
    };
    mission::mission(&scenario, relays, 1e-4).unwrap().0
}

/// Returns the setup of a ten-minute run, in which all relays receive each other on one CSMA channel.
///
/// Frames are signed, and are lost with the probability `loss`. The data rate is the lowest that is permitted.
fn at_least_baud(relays: u16, loss: f64) -> Setup {
    let mut setup = Setup::on_air(close(relays), Access::Csma);
    setup.auth = true;
    setup.radio_reach = usize::from(relays);
    setup.faults.loss = loss;
    let load = setup.load().unwrap();
    assert_eq!(load.in_range, relays);
    setup.link.baud = load.least_baud(setup.settings.probe_after);
    setup.soaked(Instant::from_millis(600_000))
}

fn agree_and_hold(relays: u16, loss: f64, seeds: u64) {
    let setup = at_least_baud(relays, loss);
    let ends = run_seeds(&setup, 1..=seeds, |_, outcome| {
        (outcome.watched.unwrap(), outcome.air)
    });
    let ends = ends.unwrap();
    let firsts: Vec<f64> = ends
        .iter()
        .filter_map(|(end, _)| end.first_agreement)
        .map(seconds)
        .collect();
    let load = ends
        .iter()
        .map(|(_, air)| air.air_time_us as f64 / 6e8)
        .fold(0.0, f64::max);
    println!(
        "{relays} relays in one range at {} baud, loss {loss}: first agreement {firsts:.1?} s, load {load:.3}",
        setup.link.baud
    );
    for (end, _) in ends {
        assert_eq!(end.availability, Some(1.0), "{relays} relays, loss {loss}");
        assert_eq!(end.most_flying, 1, "{relays} relays, loss {loss}");
    }
}

#[test]
fn twenty_agree_at_the_least_baud_with_30_percent_loss() {
    for relays in [2, 8, 20] {
        for loss in [0.0, 0.3] {
            agree_and_hold(relays, loss, 4);
        }
    }
}

#[test]
fn a_hundred_agree_at_the_least_baud() {
    agree_and_hold(100, 0.0, 1);
}

#[test]
fn fifty_agree_at_the_least_baud_with_30_percent_loss() {
    agree_and_hold(50, 0.3, 4);
}

/// Checks 100 relays on the slowest permitted channel with 30 % loss. It fails at present: after the agreement on
/// positions, requests from the relays fill the channel.
#[test]
#[ignore = "fails"]
fn a_hundred_agree_at_the_least_baud_with_30_percent_loss() {
    agree_and_hold(100, 0.3, 2);
}

/// Returns the largest permitted number of claims, and of echoes of claims, of a relay until `ended`.
///
/// With a claim (a message) a relay claims its number, so that relays detect a number in use twice. The receiver of a
/// claim sends it back as an echo.
fn most_claims(ended: Instant) -> u64 {
    let ms = ended.as_micros() / 1_000;
    let first = (1..=6).filter(|k| 250 * ((1 << k) - 1) <= ms);
    2 * (first.count() as u64 + ms / 15_000)
}

/// Checks that without faults one message along the chain and back is enough to agree on positions.
#[test]
fn without_faults_one_sweep_is_enough() {
    for relays in [2, 8, 50, 100, 200, 300, 600, 1_000] {
        let outcome = run(Setup::new(close(relays))).unwrap();
        assert_eq!(outcome.ending, Ending::Settled, "{relays} relays");
        let (sent, ended) = (outcome.messages, seconds(outcome.ended));
        println!(
            "{relays} relays: {sent} messages, {} sweeps, {ended:.3} s",
            outcome.sweeps
        );
        let there_and_back = 2 * u64::from(relays - 1);
        let most = there_and_back + most_claims(outcome.ended) * u64::from(relays);
        assert!((there_and_back..=most).contains(&sent), "{relays} relays");
        assert_eq!(outcome.sweeps, 1, "{relays} relays");
    }
}

/// Largest accepted growth of a median time or count from 25 to N relays, divided by that of N log N.
const MOST: f64 = 1.5;

/// Checks that the time and the messages until an agreement of N relays grow like N log N on bad links.
///
/// 30 % of the frames are lost, 15 % corrupted, 10 % duplicated and 10 % delayed.
#[test]
fn with_faults_time_and_messages_grow_as_n_log_n() {
    println!("| N | links | settled | time, median | worst | messages, median | most |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut shares = Vec::new();
    for relays in [8, 25, 50, 100, 200] {
        for (name, mut setup) in [
            ("wires", Setup::new(close(relays))),
            ("csma", Setup::on_air(close(relays), Access::Csma)),
        ] {
            setup.faults = Faults::BAD_DAY;
            setup.deadline = Instant::from_millis(3_600_000);
            let ends = run_seeds(&setup, 1..=10, |_, end| {
                (end.ending, seconds(end.ended), end.messages)
            });
            let mut ends = ends.unwrap();
            let settled = ends
                .iter()
                .filter(|(ending, ..)| *ending == Ending::Settled)
                .count();
            ends.sort_by(|one, other| one.1.total_cmp(&other.1));
            let (median, worst) = (ends[5].1, ends[9].1);
            ends.sort_by_key(|(.., messages)| *messages);
            println!(
                "| {relays} | {name} | {settled} of 10 | {median:.1} s | {worst:.1} s | {} | {} |",
                ends[5].2, ends[9].2
            );
            assert_eq!(settled, 10, "{relays} relays, {name}");
            let share = f64::from(relays) * f64::from(relays).log2();
            shares.push((relays, name, median / share, ends[5].2 as f64 / share));
        }
    }
    for (relays, name, time, messages) in &shares {
        let of = shares
            .iter()
            .find(|of| (of.0, of.1) == (25, *name))
            .unwrap();
        assert!(*relays < 25 || *time <= MOST * of.2, "{relays}, {name}");
        assert!(*relays < 25 || *messages <= MOST * of.3, "{relays}, {name}");
    }
}
