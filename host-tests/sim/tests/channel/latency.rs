//! Links that take longer than `hop_time`: what the relays say again for nothing.

use uav_relay::Duration;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use super::*;

/// What the relays are told that a hop takes.
const HOP_TIME: Duration = Duration::from_millis(10);

/// How many times `HOP_TIME` a link takes, and how many times 2 (N - 1) messages the chain may take until it has agreed. That is what the
/// first message says again before anything can have come back, and where it takes longer than `probe_after` questions for signs of life, too.
const LINKS: [(u32, u64); 5] = [(1, 8), (2, 8), (5, 8), (20, 16), (100, 32)];

fn slow(mut setup: Setup, times: u32) -> Setup {
    setup.hop_time_set = Some(HOP_TIME);
    setup.link.latency = HOP_TIME.times(times);
    setup.deadline = Instant::from_millis(600_000);
    setup
}

#[test]
fn links_slower_than_hop_time_are_noticed() {
    println!("| N | links | latency | time | messages | times 2 (N - 1) | sweeps |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut beyond = Vec::new();
    for relays in [5, 8] {
        for (times, most) in LINKS {
            for (name, setup) in [
                ("wires", Setup::new(close(relays))),
                ("shared", Setup::on_shared_channel(close(relays))),
                ("csma", Setup::on_air(close(relays), Access::Csma)),
            ] {
                let end = run(slow(setup, times)).unwrap();
                assert_eq!(end.ending, Ending::Settled, "{relays}, {times}, {name}");
                let least = 2 * u64::from(relays - 1);
                let share = end.messages as f64 / least as f64;
                println!(
                    "| {relays} | {name} | {times} hop times | {:.2} s | {} | {share:.1} | {} |",
                    seconds(end.ended),
                    end.messages,
                    end.sweeps
                );
                assert_eq!(end.sweeps, 1, "{relays}, {times}, {name}");
                if end.messages > most * least {
                    beyond.push((relays, name, times, share));
                }
            }
        }
    }
    assert!(beyond.is_empty(), "{beyond:?}");
}

/// Over ten minutes a chain that was told too short a `hop_time` says little more than one that was told the right one.
#[test]
fn slow_links_are_got_used_to() {
    for times in [2, 5, 20] {
        for (name, setup) in [
            ("wires", Setup::new(close(8))),
            ("shared", Setup::on_shared_channel(close(8))),
            ("csma", Setup::on_air(close(8), Access::Csma)),
        ] {
            let said = |hop_time_set| {
                let mut setup = slow(setup.clone(), times);
                setup.hop_time_set = hop_time_set;
                let end = run(setup.soaked(Instant::from_millis(600_000))).unwrap();
                assert_eq!(end.watched.unwrap().availability, Some(1.0));
                end.messages
            };
            let (right, short) = (said(None), said(Some(HOP_TIME)));
            println!("{name}, {times} hop times: {short} messages instead of {right}");
            assert!(4 * short <= 5 * right, "{name}, {times}: {short}, {right}");
        }
    }
}
