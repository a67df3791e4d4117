//! Wrong sensor at a relay or an end: its cost and its detection, without false alarms.

use rayon::prelude::*;
use uav_relay::{Instant, Interference, Wiring};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Moment, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::true_interference::{BrokenReading, BrokenReceiver};

use uav_relay_tools::listening::{RandomScene, quantile};

use crate::count;

/// Simulated faults of a sensor: factors on its readings, and constant readings. The constants are the power of a 10
/// W interferer at 500 m, a receiver's noise, and zero.
const KINDS: [(&str, BrokenReading); 7] = [
    ("0.1 times", BrokenReading::Times(0.1)),
    ("0.5 times", BrokenReading::Times(0.5)),
    ("2 times", BrokenReading::Times(2.0)),
    ("10 times", BrokenReading::Times(10.0)),
    ("5e-9 W always", BrokenReading::Always(5e-9)),
    ("1e-13 W always", BrokenReading::Always(1e-13)),
    ("0 W always", BrokenReading::Always(0.0)),
];

/// Returns the setup of a chain whose Tx and Rx measure the interference and send it to the relays.
fn setup(wild: &RandomScene) -> Setup {
    let mut setup = wild.setup(Interference::Unknown).unwrap();
    setup.settings.wiring = Wiring::Shared;
    setup.auth = true;
    setup
}

/// Returns the SIR at the final positions as a fraction of the optimum SIR.
pub(crate) fn share(wild: &RandomScene, outcome: &Outcome) -> f64 {
    let goals = outcome.snapshots.last().unwrap().goals.as_ref();
    goals.map_or(0.0, |goals| {
        wild.scene().unwrap().chain_sir(goals) / wild.optimum().unwrap()
    })
}

/// Returns the nodes whose sensors were reported as wrong, each once.
pub(crate) fn named(outcome: &Outcome) -> Vec<u16> {
    let off = outcome
        .moments
        .iter()
        .filter(|it| it.what == TimelineEvent::SensorOff);
    let mut named: Vec<u16> = off.filter_map(|it| it.other).collect();
    named.sort_unstable();
    named.dedup();
    named
}

/// Returns each scene's SIR as a fraction of the optimum, with intact sensors.
fn sound(relays: u16) -> Vec<f64> {
    let one = |seed| {
        let wild = RandomScene::new(seed, relays, 1);
        share(&wild, &run(setup(&wild)).unwrap())
    };
    (0..count(24)).into_par_iter().map(one).collect()
}

/// Runs a scene in which the sensor of `node` is wrong from the start, as `says` describes.
fn with_wrong(wild: &RandomScene, node: u16, says: BrokenReading) -> Outcome {
    let mut wrong = setup(wild);
    wrong.true_interference.as_mut().unwrap().broken = vec![BrokenReceiver {
        node,
        reading: says,
        since: Instant::ZERO,
    }];
    run(wrong).unwrap()
}

/// Checks that no kind of faulty sensor costs much SIR, and that the faulty sensor is reported.
///
/// `node` gives the node with the faulty sensor for each scene. `sound` has the fraction of the optimum SIR that each
/// scene reaches without faults.
fn hold(relays: u16, sound: &[f64], who: &str, node: impl Fn(u64) -> u16 + Sync) {
    for (what, says) in KINDS {
        let one = |seed: usize| {
            let (wild, node) = (RandomScene::new(seed as u64, relays, 1), node(seed as u64));
            let outcome = with_wrong(&wild, node, says);
            let named = named(&outcome);
            let other = named.iter().any(|it| *it != node);
            let lost = 1.0 - share(&wild, &outcome) / sound[seed];
            (lost, named.contains(&node), other)
        };
        let came: Vec<_> = (0..sound.len()).into_par_iter().map(one).collect();
        let mut lost: Vec<f64> = came.iter().map(|it| it.0).collect();
        let at = came
            .iter()
            .position(|it| it.0 >= came.iter().map(|it| it.0).fold(f64::MIN, f64::max));
        let [median, ninety, most] = [0.5, 0.9, 1.0].map(|part| quantile(&mut lost, part));
        let found = came.iter().filter(|it| it.1).count();
        let other = came.iter().filter(|it| it.2).count();
        println!(
            "N = {relays}, {who} says {what}: lost {median:.4} in the median, {ninety:.4} in nine of ten, {most:.4} at most (seed {at:?}); named {found}, another {other} of {}",
            came.len()
        );
        assert!(median < 0.03, "{relays} {who} {what}");
        assert!(other * 100 <= came.len(), "{relays} {who} {what}: {other}");
        // An end that receives nothing sends no measurement.
        let least = match (who, says) {
            ("a relay", _) => 0.9,
            (_, BrokenReading::Always(0.0)) => 0.0,
            _ => 2.0 / 3.0,
        };
        let share = found as f64 / came.len() as f64;
        assert!(share >= least, "{relays} {who} {what}: {share}");
    }
}

#[test]
fn one_wrong_sensor_of_a_relay_costs_little_sir() {
    for relays in [5, 8] {
        let of = |seed| 1 + (seed % u64::from(relays)) as u16;
        hold(relays, &sound(relays), "a relay", of);
    }
}

#[test]
fn one_wrong_sensor_of_tx_or_rx_costs_little_sir() {
    for relays in [5, 8] {
        let sound = sound(relays);
        hold(relays, &sound, "the receiver", |_| relays + 1);
        hold(relays, &sound, "the transmitter", |_| 0);
    }
}

/// Checks that chains of one or two relays never report a correct sensor as wrong. Instead these chains report that no single interferer
/// fits.
///
/// Chains of three or four relays may report a correct sensor as wrong in at most 2 % of the scenes.
#[test]
fn a_short_chain_seldom_accuses_a_correct_sensor() {
    for relays in [1, 2, 3, 4] {
        for (what, says) in KINDS {
            let one = |seed: usize| {
                let wild = RandomScene::new(seed as u64, relays, 1);
                let node = 1 + (seed % usize::from(relays)) as u16;
                let outcome = with_wrong(&wild, node, says);
                let other = named(&outcome).iter().any(|it| *it != node);
                let is_unclear = |it: &Moment| it.what == TimelineEvent::InterfererUnclear;
                (other, outcome.moments.iter().any(is_unclear))
            };
            let scenes = count(24) as usize;
            let came: Vec<(bool, bool)> = (0..scenes).into_par_iter().map(one).collect();
            let other = came.iter().filter(|it| it.0).count();
            let unclear = came.iter().filter(|it| it.1).count();
            println!(
                "N = {relays}, a relay says {what}: another named in {other}, unclear in {unclear} of {scenes}"
            );
            let most = if relays > 2 { scenes / 50 } else { 0 };
            assert!(other <= most, "{relays} {what}: {other}");
            assert!(relays > 2 || unclear == scenes, "{relays} {what}");
        }
    }
}

#[test]
fn correct_sensors_are_not_accused() {
    let mut all = 0;
    for relays in [5, 8, 3, 2, 1, 20] {
        let each: Vec<(Vec<u16>, f64)> = (0..count(24))
            .into_par_iter()
            .map(|seed| {
                let wild = RandomScene::new(seed, relays, 1);
                let outcome = run(setup(&wild)).unwrap();
                (named(&outcome), share(&wild, &outcome))
            })
            .collect();
        let wrong = each.iter().filter(|(named, _)| !named.is_empty()).count();
        let mut shares: Vec<f64> = each.iter().map(|it| it.1).collect();
        println!(
            "N = {relays}: {wrong} of {} named somebody, median {:.4}",
            each.len(),
            quantile(&mut shares, 0.5)
        );
        let who: Vec<_> = (0..)
            .zip(&each)
            .filter(|(_, (named, _))| !named.is_empty())
            .collect();
        println!("{who:?}");
        all += wrong;
    }
    assert_eq!(all, 0);
}

/// Checks that measurements of Tx and Rx help although they start late or stop early.
///
/// The measurements matter because Rx is behind a hill, and the path loss in the mission is that without the hill.
#[test]
fn measurements_of_an_end_may_come_late_or_stop() {
    let [begin, late, end] = [0, 60_000, 10_000_000].map(Instant::from_millis);
    let mut medians = Vec::new();
    for (what, during) in [
        ("from the beginning", [begin, end]),
        ("after a minute", [late, end]),
        ("for a minute", [begin, late]),
        ("never", [begin, begin]),
    ] {
        let one = |seed| {
            let mut late = setup(&RandomScene::new(seed, 5, 1));
            let true_interference = late.true_interference.as_mut().unwrap();
            true_interference.scene.mu_nlos *= 8.0;
            true_interference.ends_during = during;
            let truth = true_interference.scene.clone();
            let outcome = run(late).unwrap();
            let goals = outcome.snapshots.last().unwrap().goals.clone();
            goals.map_or(0.0, |goals| truth.chain_sir(&goals))
        };
        let sirs: Vec<f64> = (0..count(24)).into_par_iter().map(one).collect();
        medians.push((what, sirs));
    }
    let (_, first) = &medians[0];
    for (what, sirs) in &medians {
        let mut parts: Vec<f64> = sirs
            .iter()
            .zip(first)
            .map(|(sir, best)| sir / best)
            .collect();
        let [tenth, median] = [0.1, 0.5].map(|part| quantile(&mut parts, part));
        println!(
            "ends that measure {what}: {median:.4} of the SIR in the median, {tenth:.4} in nine of ten"
        );
        assert!(median > 0.97 || *what == "never", "{what}");
    }
}
