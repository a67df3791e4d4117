//! Events for the operator name the node and the cause.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::unnecessary_wraps,
    clippy::redundant_closure_for_method_calls,
    reason = "as every test may"
)]

mod air;
mod namesake;
mod signed;
mod withheld;

use air::mission;
use uav_relay::Instant;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::one_way::OneWayFailure;
use uav_relay_sim::simulator::outcome::{Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::Setup;

fn at(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

fn of(outcome: &Outcome, what: fn(TimelineEvent) -> bool) -> Vec<(u16, Option<u16>)> {
    let moments = outcome.moments.iter().filter(|moment| what(moment.what));
    moments
        .map(|&Moment { relay, other, .. }| (relay, other))
        .collect()
}

/// A dead relay is reported by its number; its replacement is reported by its own.
#[test]
fn who_is_lost_and_who_is_found_is_told_by_its_number() {
    let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(200));
    setup.kills = vec![(3, at(60))];
    let outcome = run(setup).unwrap();
    let mut lost = of(&outcome, |what| matches!(what, TimelineEvent::Lost(_)));
    lost.sort_unstable();
    assert_eq!(lost, [(2, Some(3)), (4, Some(3))]);
    let found = of(&outcome, |what| matches!(what, TimelineEvent::Found(_)));
    assert!(
        found.contains(&(2, Some(4))) && found.contains(&(4, Some(2))),
        "{found:?}"
    );
    assert!(
        found.iter().all(|(_, other)| *other != Some(3)),
        "{found:?}"
    );
}

/// Relay 3 does not receive relay 2. Relay 2 receives relay 3 and must be told why they are no neighbours.
#[test]
fn a_relay_that_is_not_heard_is_told_by_whom() {
    let mut setup = Setup::on_shared_channel(mission(4)).soaked(at(300));
    setup.deaf = vec![OneWayFailure {
        by: 3,
        of: 2,
        from: at(60),
        until: None,
    }];
    let outcome = run(setup).unwrap();
    assert_eq!(
        of(&outcome, |what| what == TimelineEvent::NotHeard),
        [(2, Some(3))]
    );
}

/// Lost and corrupted frames never cause reports of deaf nodes, wrong keys or old epochs.
#[test]
fn a_bad_channel_has_nobody_told_of_what_is_not_so() {
    for seed in 1..=3 {
        let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(300));
        setup.faults.loss = 0.3;
        setup.faults.corrupt = 0.1;
        setup.auth = true;
        setup.seed = seed;
        let outcome = run(setup).unwrap();
        let told = of(&outcome, |what| {
            let causes = [
                TimelineEvent::NotHeard,
                TimelineEvent::MissionMismatch,
                TimelineEvent::KeyMismatch,
                TimelineEvent::EpochWentBack,
                TimelineEvent::DuplicateIndex,
            ];
            causes.contains(&what)
        });
        assert_eq!(told, [], "seed {seed}");
    }
}

/// Two of five relays have no quorum. They keep requesting a view but report this once.
#[test]
fn a_quorum_lost_is_told_once_until_a_view_is_agreed_on() {
    let mut setup = Setup::on_shared_channel(mission(5)).soaked(at(600));
    setup.kills = vec![(1, at(60)), (2, at(60)), (3, at(60))];
    let outcome = run(setup).unwrap();
    for what in [TimelineEvent::NoQuorum, TimelineEvent::LeaseLapsed] {
        let mut told = outcome.moments.clone();
        told.retain(|moment| moment.what == what);
        let mut by: Vec<u16> = told.iter().map(|moment| moment.relay).collect();
        by.sort_unstable();
        assert_eq!(by, [4, 5], "{what:?}");
    }
}
