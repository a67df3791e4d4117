//! Time of recovery from a loss, by chain length and relay. Prints the table of `examples/RESULTS.md`.

use host_tests::fixtures::mission;
use uav_relay::Instant;
use uav_relay_sim::report::ChainReport;
use uav_relay_sim::report::timeline::RecoveryReport;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;

/// Time at which a relay is lost, s; the chain has settled long before.
const AT_S: u64 = 60;

/// Returns the setup of `relays` relays on one radio channel. Relay `lost` fails.
fn losing(relays: u16, lost: u16) -> Setup {
    let mut setup = Setup::on_shared_channel(mission(relays));
    setup.kills = vec![(lost, Instant::from_millis(1_000 * AT_S))];
    setup.deadline = Instant::from_millis(1_000 * (AT_S + 600));
    setup
}

fn recovered(setup: Setup) -> (Outcome, ChainReport) {
    let mission = setup.mission;
    let outcome = run(setup).unwrap();
    let report = ChainReport::new("align", &mission, &outcome, 1);
    (outcome, report)
}

/// Checks that a run lost only relay `lost`, and settled without this relay. Returns the report of the recovery.
fn only(report: &ChainReport, relays: u16, lost: u16) -> RecoveryReport {
    let [one] = report.recovery.as_slice() else {
        panic!("{:?}", report.recovery);
    };
    assert_eq!(
        (one.lost.as_slice(), one.back.as_slice(), one.relays),
        (&[lost][..], &[][..], relays - 1)
    );
    assert_eq!(report.left, Some(relays - 1));
    one.clone()
}

/// Returns the names and numbers of the first relay (the leader), the middle relay and the last relay.
fn places(relays: u16) -> Vec<(&'static str, u16)> {
    let mut places = vec![
        ("leader", 1),
        ("middle", relays.div_ceil(2)),
        ("last", relays),
    ];
    places.dedup_by_key(|(_, lost)| *lost);
    places
}

#[test]
fn a_loss_is_noticed_within_15_s_and_costs_up_to_six_sweeps() {
    println!(
        "| N | lost | noticed after | view accepted after | at the new positions after | sweeps |"
    );
    println!("| --- | --- | --- | --- | --- | --- |");
    for relays in [2, 4, 8, 16, 32, 100] {
        for (name, lost) in places(relays) {
            let (outcome, report) = recovered(losing(relays, lost));
            if (relays, lost) == (2, 1) {
                assert_eq!(outcome.ending, Ending::NoQuorum);
                println!(
                    "| 2 | leader | {:.1} s | never: the other one holds its place | | |",
                    detected(&report)
                );
                continue;
            }
            assert_eq!(outcome.ending, Ending::Settled, "{name} of {relays}");
            let one = only(&report, relays, lost);
            let since = |at_s: Option<f64>| at_s.unwrap() - one.happened_s.unwrap();
            let [noticed, formed, converged] =
                [one.detected_s, Some(one.formed_s), one.converged_s].map(since);
            let sweeps = one.sweeps.unwrap();
            println!(
                "| {relays} | {name} | {noticed:.1} s | {formed:.2} s | {converged:.2} s | {sweeps} |"
            );
            assert!(noticed <= 15.0, "{name} of {relays}: {noticed}");
            assert!((1..=6).contains(&sweeps), "{name} of {relays}: {sweeps}");
            // The other neighbour may notice the loss up to a renewal period, 2.5 s, later. If an end relay is lost,
            // its neighbour searches for another node for as long as the silence lasted.
            let search = if lost == 1 || lost == relays {
                10.1
            } else {
                2.6
            };
            let round_trips = 0.05 * f64::from(relays);
            assert!(
                converged - noticed <= search + round_trips,
                "{name} of {relays}: {converged}"
            );
        }
    }
}

/// Returns the time from the loss of a relay to its detection, s.
fn detected(report: &ChainReport) -> f64 {
    let lost = report.timeline.iter().find(|moment| moment.what == "lost");
    lost.unwrap().at_s - AT_S as f64
}

/// Checks that the relays that remain after a loss agree on the same positions as a new chain. The new chain has as many relays as remain
/// after the loss.
#[test]
fn the_remaining_chain_is_as_good_as_a_new_one() {
    for (relays, lost) in [(4, 2), (8, 1), (8, 4), (8, 8), (16, 9)] {
        let (outcome, _) = recovered(losing(relays, lost));
        let mut left = outcome.bits();
        left.remove(usize::from(lost) - 1);
        let mut fresh = losing(relays - 1, 1);
        fresh.kills.clear();
        assert_eq!(left, run(fresh).unwrap().bits(), "relay {lost} of {relays}");
    }
}

#[test]
fn without_a_quorum_the_last_relay_goes_on() {
    let mut setup = losing(2, 1);
    setup.settings.quorum = false;
    let (outcome, report) = recovered(setup);
    assert_eq!(outcome.ending, Ending::Settled);
    assert_eq!(only(&report, 2, 1).view, 1);
}

/// Checks that authentication does not change the positions after a loss. Authentication costs only the time of a
/// handshake.
#[test]
fn tags_change_only_the_time() {
    let (bare, _) = recovered(losing(8, 4));
    let mut setup = losing(8, 4);
    setup.auth = true;
    let (tagged, report) = recovered(setup);
    assert_eq!(tagged.ending, Ending::Settled);
    assert_eq!(tagged.bits(), bare.bits());
    assert!(only(&report, 8, 4).sweeps.unwrap() <= 6);
}
