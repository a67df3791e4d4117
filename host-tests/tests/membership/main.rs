//! Loss and return of relays: the rest ends in an undisturbed chain's positions (`COUNT`, `SEED`).

mod duplicates;
mod endurance;
mod flights;
mod leaves;
mod losses;
mod parts;
mod schedules;

use host_tests::fixtures::mission;
use host_tests::flights::{go_on_until, seconds};
use host_tests::ledger::{self, left, number};
use uav_relay::{Duration, Instant, Mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Partition, Setup};

/// Returns the paper's chain of `relays` on one radio channel.
fn paper(relays: u16) -> Setup {
    Setup::on_shared_channel(mission(relays))
}

/// Runs `setup`. Checks that the surviving relays `left` end at the positions of a chain of only these relays.
fn settles(setup: &Setup, left: &[u16], name: &str) -> Outcome {
    let outcome = run(setup.clone()).unwrap();
    assert_eq!(outcome.ending, Ending::Settled, "{name}");
    judge(setup, &outcome, left).unwrap_or_else(|what| panic!("{name}: {what}"));
    outcome
}

/// Checks that the surviving relays `left` have the positions of a chain of only these relays.
///
/// The error describes the difference.
fn judge(setup: &Setup, outcome: &Outcome, left: &[u16]) -> Result<(), String> {
    ledger::judge(setup, outcome, left, 0, *setup.mission.config())
}

const ALL: [u16; 8] = [1, 2, 3, 4, 5, 6, 7, 8];

/// Returns the indices 1 to 8 without those in `gone`.
fn without(gone: &[u16]) -> Vec<u16> {
    ALL.into_iter()
        .filter(|index| !gone.contains(index))
        .collect()
}

/// Returns the number of times that a relay accepted a new membership view.
fn views(outcome: &Outcome, relay: u16) -> usize {
    let reformed = |what| matches!(what, TimelineEvent::ViewAccepted { .. });
    outcome
        .moments
        .iter()
        .filter(|moment| moment.relay == relay && reformed(moment.what))
        .count()
}

/// Returns the number of random cases: the environment variable `COUNT`, or else `usual`.
fn count(usual: u64) -> u64 {
    std::env::var("COUNT").map_or(usual, |text| text.parse().unwrap())
}

fn ms(span: Duration) -> u64 {
    span.as_micros() / 1_000
}
