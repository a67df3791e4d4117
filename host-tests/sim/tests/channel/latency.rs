//! Links that take longer than `hop_time`: what the relays say again for nothing.

use uav_relay::Duration;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;

use super::*;

/// What the relays are told that a hop takes.
const HOP_TIME: Duration = Duration::from_millis(10);

/// How many times as many messages as without repetitions a chain may take that finds its links `times` as slow: twice the number of
/// repetitions at spans that double, and as many again for what the relays before and after conclude from them.
fn most(times: u32) -> u64 {
    u64::from(4 + 2 * times.ilog2())
}

fn slow(mut setup: Setup, times: u32) -> Setup {
    setup.hop_time_set = Some(HOP_TIME);
    setup.link.latency = HOP_TIME.times(times);
    setup.deadline = Instant::from_millis(600_000);
    setup
}

#[test]
#[ignore = "fails"]
fn links_slower_than_hop_time_are_noticed() {
    println!("| N | links | latency | time | messages | times 2 (N - 1) | sweeps |");
    println!("| --- | --- | --- | --- | --- | --- | --- |");
    let mut beyond = Vec::new();
    for relays in [5, 8] {
        for times in [1, 2, 5, 20, 100] {
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
                if end.messages > most(times) * least {
                    beyond.push((relays, name, times, share));
                }
            }
        }
    }
    assert!(beyond.is_empty(), "{beyond:?}");
}
