//! Measurements of the transmitter and the receiver, sent over the air: `Ground::measured`.

use rayon::prelude::*;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Instant, Interference, Wiring};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;

use uav_relay_tools::listening::{RandomScene, quantile};

use crate::count;

const RELAYS: u16 = 5;

/// Factor by which the true path loss on the ground exceeds that in the mission: Rx is behind a hill.
const HILL: f64 = 8.0;

/// Returns two results of each random scene: relay 1's error of the power at Rx, and the SIR.
///
/// The error is relative, and `None` without an estimate. The SIR is the SIR of the chain's worst hop, linear, with
/// the true interference.
fn flown(change: impl Fn(&mut Setup) + Sync) -> Vec<(Option<f64>, f64)> {
    let one = |seed| {
        let wild = RandomScene::new(seed, RELAYS, 1);
        let mut setup = wild.setup(Interference::Unknown).unwrap();
        setup.settings.wiring = Wiring::Shared;
        setup.auth = true;
        setup.true_interference.as_mut().unwrap().scene.mu_nlos *= HILL;
        change(&mut setup);
        let truth = setup.true_interference.as_ref().unwrap().scene.clone();
        let outcome = run(setup).unwrap();
        let off = measured_at_rx(&outcome).map(|heard| heard / truth.interference_rx_w() - 1.0);
        let stand = outcome.snapshots.last().unwrap();
        let flown = stand.goals.as_ref().map_or(0.0, |goals| {
            let mut scene = truth.clone();
            scene.relays.truncate(goals.len());
            scene.chain_sir(goals)
        });
        (off, flown)
    };
    (0..count(20)).into_par_iter().map(one).collect()
}

/// Returns the first relay's estimate of the interference power at the receiver, W. `None` without an estimate.
fn measured_at_rx(outcome: &Outcome) -> Option<f64> {
    match outcome.relays.first()?.believed.estimate {
        InterferenceEstimate::Source { receiver_w, .. } if receiver_w > 0.0 => {
            Some(f64::from(receiver_w))
        }
        _ => None,
    }
}

#[test]
fn measurements_at_rx_reach_all_relays_by_radio() {
    type Change = fn(&mut Setup);
    let last_lost: Change = |setup| setup.kills = vec![(RELAYS, Instant::from_millis(7_000))];
    let last_anew: Change = |setup| {
        setup.kills = vec![(RELAYS, Instant::from_millis(6_000))];
        setup.boots = vec![(RELAYS, Instant::from_millis(7_000))];
    };
    for (what, change) in [
        ("as it should be", (|_| {}) as Change),
        ("on a bad day", |setup| setup.faults = Faults::BAD_DAY),
        ("the last relay lost", last_lost),
        ("the last relay switched on again", last_anew),
    ] {
        let runs = flown(change);
        let said = runs.iter().filter(|(off, _)| off.is_some()).count();
        let mut off: Vec<f64> = runs.iter().filter_map(|run| Some(run.0?.abs())).collect();
        let [median, most] = [0.5, 1.0].map(|part| quantile(&mut off, part));
        println!(
            "{what}: of {} runs {said} know it, off by {median:.4} in the median, {most:.4} at most",
            runs.len()
        );
        assert_eq!(said, runs.len(), "{what}");
        assert!(most < 0.1, "{what}");
    }
}

/// Checks that the measurements of Tx and Rx more than double the SIR of each scene. Without these measurements the last hop is planned
/// with the mission's wrong path loss on the ground.
#[test]
fn measurements_of_tx_and_rx_raise_the_sir() {
    let told = flown(|_| {});
    let untold = flown(|setup| setup.true_interference.as_mut().unwrap().ends = false);
    assert!(untold.iter().all(|(off, _)| off.is_none()));
    let mut gains: Vec<f64> = told
        .iter()
        .zip(&untold)
        .map(|(told, untold)| told.1 / untold.1)
        .collect();
    let [least, median] = [0.0, 0.5].map(|part| quantile(&mut gains, part));
    println!("SIR with what the ends say over that without: median {median:.3}, least {least:.3}");
    assert!(median > 3.0 && least > 2.0);
}
