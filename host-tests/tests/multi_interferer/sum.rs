//! True sum of interferers: conversion of a scenario to a scene, and SIRs compared with the reference.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::{log_uniform, seed};
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::scene::{self, Scene};
use uav_relay_scenario::{Field, Interference, Scenario, Source};

use super::above;
use super::scenes::scene;

/// Checks that the inverse SIR with several sources is the sum of the inverse SIRs with single sources.
#[test]
fn the_inverse_sirs_of_the_sources_add_up() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(71));
    for at in 0..500 {
        let mut scene = scene(&mut rng, 1..=6, 1..=5);
        for relay in &mut scene.relays {
            relay.altitude_m *= log_uniform(&mut rng, 0.5, 2.0);
        }
        let mut xs: Vec<f64> = scene
            .relays
            .iter()
            .map(|_| rng.random_range(0.0..=scene.distance_m))
            .collect();
        xs.sort_by(f64::total_cmp);
        let altitudes = scene.relays.iter().map(|relay| relay.altitude_m);
        let places: Vec<(f64, f64)> = xs.iter().copied().zip(altitudes).collect();
        let sirs = scene.hop_sirs(&places);
        assert_eq!(sirs.len(), xs.len() + 1);
        let mut inverse = vec![0.0; sirs.len()];
        for source in &scene.sources {
            for (sum, sir) in inverse.iter_mut().zip(alone(&scene, source).sir_hops(&xs)) {
                *sum += 1.0 / sir;
            }
        }
        for (sir, inverse) in sirs.iter().zip(&inverse) {
            assert!((sir * inverse - 1.0).abs() < 1e-12, "{at}: {sir} {inverse}");
        }
        let worst = sirs.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(scene.chain_sir(&places), worst);
    }
}

fn alone(scene: &Scene, source: &Source) -> Link {
    let station = |relay: &scene::Relay| make::reference_relay(relay.altitude_m, relay.power_w);
    Link {
        distance_m: scene.distance_m,
        min_separation_m: scene.min_separation_m,
        tx_w: scene.tx_w,
        interferer_w: source.power_w,
        x_i: source.x_m,
        y_i: source.y_m,
        mu_los: scene.mu_los,
        mu_nlos: scene.mu_nlos,
        eta: scene.eta,
        noise_w: scene.noise_w,
        relays: scene.relays.iter().map(station).collect(),
    }
}

#[test]
fn a_scene_has_the_scenarios_values() {
    let mut scenario = Scenario {
        altitude_max_m: 300.0,
        ..Scenario::default()
    };
    let own = |altitude_m, power_w| make::relay_override(altitude_m, power_w);
    scenario.relays.insert(2, own(Some(30.0), Some(0.5)));
    scenario.relays.insert(3, own(None, Some(2.0)));
    scenario.relays.insert(9, own(Some(50.0), None));
    let scene = Scene::new(&scenario, 3).unwrap();
    let paper = Link::paper(3);
    assert_eq!((scene.band.least_m, scene.band.most_m), (20.0, 300.0));
    assert_eq!((scene.distance_m, scene.min_separation_m), (1000.0, 4.0));
    assert_eq!(scene.tx_w, 80.0);
    for (ours, theirs) in [
        (scene.mu_los, paper.mu_los),
        (scene.mu_nlos, paper.mu_nlos),
        (scene.eta, paper.eta),
    ] {
        assert!(above(ours, theirs).abs() < 1e-14);
    }
    let relay = |altitude_m, power_w, holds| scene::Relay {
        altitude_m,
        power_w,
        holds,
    };
    let want = [
        relay(20.0, 1.0, false),
        relay(30.0, 0.5, true),
        relay(20.0, 2.0, false),
    ];
    assert_eq!(scene.relays, want);
    assert!(scene.hop_sirs(&[(1.0, 20.0)]).is_empty());
    assert_eq!(scene.chain_sir(&[] as &[(f64, f64)]), 0.0);
}

#[test]
fn a_scenario_without_sources_is_no_scene() {
    let with = |interference| Scenario {
        interference,
        ..Scenario::default()
    };
    let field = Field {
        i_max_w: 1e-9,
        beta: Vec::new(),
    };
    assert_eq!(Scene::new(&with(Interference::Field(field)), 3), None);
    assert_eq!(
        Scene::new(&with(Interference::Sources(Vec::new())), 3),
        None
    );
}
