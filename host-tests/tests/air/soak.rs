//! Availability of chains, number of groups in flight, and distances between relays.

use host_tests::fixtures::mission;
use uav_relay_sim::report::ChainReport;
use uav_relay_sim::simulator::chain::undisturbed;
use uav_relay_sim::simulator::chain::{run, run_seeds};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::{Partition, Setup};
use uav_relay_sim::simulator::watch::Watched;

use super::*;

fn watched(setup: Setup) -> (Outcome, Watched) {
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Soaked);
    let watched = outcome.watched.unwrap();
    (outcome, watched)
}

fn s(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}

#[test]
fn without_faults_the_availability_is_1() {
    for access in [Access::Ideal, Access::Csma] {
        let setup = Setup::on_air(mission(8), access).soaked(seconds(300));
        let (outcome, watched) = watched(setup);
        assert_eq!(outcome.ended, seconds(300));
        assert_eq!(watched.availability, Some(1.0), "{access:?}");
        assert_eq!(watched.most_flying, 1);
        let places = outcome
            .relays
            .iter()
            .map(|relay| relay.setpoint.unwrap().x_m);
        let places: Vec<f64> = places.map(f64::from).collect();
        let nearest = places.windows(2).map(|pair| pair[1] - pair[0]);
        let nearest = nearest.reduce(f64::min).unwrap();
        assert!((watched.least_separation_m.unwrap() - nearest).abs() < 1e-9);
    }
}

#[test]
fn a_chain_is_unavailable_from_a_loss_to_new_positions() {
    let mut setup = Setup::on_shared_channel(mission(8));
    setup.kills = vec![(4, seconds(50))];
    let mission = setup.mission;
    let (outcome, watched) = watched(setup.soaked(seconds(200)));
    let report = ChainReport::new("align", &mission, &outcome, 1);
    let converged = report.recovery[0].converged_s.unwrap();
    let (first, wrong) = (s(watched.first_agreement.unwrap()), converged - 50.0);
    let share = 1.0 - wrong / (200.0 - first);
    assert!(
        (watched.availability.unwrap() - share).abs() < 1e-3,
        "{watched:?}, {share}"
    );
    let longest = watched.longest_wrong.unwrap().as_micros() as f64 / 1e6;
    assert!((longest - wrong).abs() < 0.2, "{longest}, {wrong}");
}

#[test]
fn the_optimum_is_that_of_the_remaining_relays() {
    let setup = Setup::on_shared_channel(mission(8));
    let seven = run(Setup::new(mission(7))).unwrap();
    let places = undisturbed(&setup, &[1, 2, 3, 5, 6, 7, 8], 0).unwrap();
    for (place, relay) in places.iter().zip(&seven.relays) {
        assert_eq!(place[0], f64::from(relay.setpoint.unwrap().x_m));
    }
    assert_eq!(places.len(), 7);
}

/// Returns the setup of eight relays whose link between relays 4 and 5 fails for good after 30 s. If `quorum` is
/// true, an agreement needs a majority of the relays.
fn split(quorum: bool) -> Setup {
    let mut setup = Setup::on_shared_channel(mission(8));
    setup.settings.quorum = quorum;
    setup.partitions = vec![Partition {
        after: 4,
        from: seconds(30),
        until: None,
    }];
    setup.soaked(seconds(200))
}

#[test]
fn without_a_quorum_two_groups_fly_at_once() {
    let (_, both) = watched(split(false));
    assert_eq!(both.most_flying, 2);
    // The halves have the same size: each is the longest chain that can form, and has its best positions.
    assert!(both.availability.unwrap() > 0.85, "{both:?}");
}

#[test]
fn a_chain_that_never_agrees_has_availability_0() {
    let mut setup = Setup::on_shared_channel(mission(8));
    setup.partitions = (1..8)
        .map(|after| Partition {
            after,
            from: at(0),
            until: None,
        })
        .collect();
    let (_, watched) = watched(setup.soaked(seconds(100)));
    assert_eq!(watched.availability, Some(0.0), "{watched:?}");
    assert_eq!(watched.most_flying, 0);
}

#[test]
fn run_seeds_gives_the_same_results_as_single_runs() {
    let mut setup = Setup::on_air(mission(5), Access::Csma).soaked(seconds(60));
    setup.faults = Faults {
        loss: 0.4,
        ..Faults::default()
    };
    setup.burst = 5.0;
    let many = run_seeds(&setup, 10..20, |seed, outcome| (seed, outcome.air)).unwrap();
    assert_eq!(many.len(), 10);
    for (place, (seed, air)) in many.into_iter().enumerate() {
        assert_eq!(seed, 10 + place as u64);
        setup.seed = seed;
        assert_eq!(run(setup.clone()).unwrap().air, air);
    }
}
