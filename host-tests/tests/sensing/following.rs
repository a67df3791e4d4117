//! An interferer that moves.

use rayon::prelude::*;
use uav_relay::{Duration, Instant, Interference, Listen};
use uav_relay_sim::simulator::chain::run;

use crate::scenes::{Wild, count, quantile, share};

/// Of every scene the mean share of the optimum at that moment, from a minute after the begin on: of the chain that follows, and of one that
/// stays where it was best then.
fn shares(relays: u16, speed_mps: f64, listen: Listen) -> (Vec<f64>, Vec<f64>) {
    let seeds: Vec<u64> = (0..count(20)).collect();
    seeds
        .into_par_iter()
        .map(|seed| {
            let mut wild = Wild::new(seed, relays, 1);
            // It passes at 300 m, and is in the middle half way.
            let span_s = 600.0 / speed_mps.max(3.0) + 60.0;
            if let uav_relay_sim::scenario::Interference::Sources(sources) =
                &mut wild.scenario.interference
            {
                sources[0].x_m = 500.0 - speed_mps * (60.0 + 0.5 * (span_s - 60.0));
                sources[0].y_m = 300.0;
            }
            let mut setup = wild.flown(Interference::Unknown);
            setup.settings.listen = Some(listen);
            let sky = setup.sky.as_mut().unwrap();
            sky.velocity_mps = [speed_mps, 0.0];
            sky.until = Instant::from_millis((span_s * 1e3) as u64);
            let sky = sky.clone();
            let outcome = run(setup).unwrap();
            let (mut followed, mut stayed, mut n) = (0.0, 0.0, 0.0);
            let mut first = None;
            for stand in outcome.stands.iter().filter(|stand| stand.at >= Instant::from_millis(60_000)) {
                let scene = sky.scene_at(stand.at);
                let mut now = wild.clone();
                now.scenario.interference =
                    uav_relay_sim::scenario::Interference::Sources(scene.sources.clone());
                let (best, places) = now.told();
                let first = first.get_or_insert(places);
                followed += share(&scene, &stand.places) / best;
                stayed += share(&scene, first) / best;
                n += 1.0;
            }
            (followed / n, stayed / n)
        })
        .unzip()
}

#[test]
fn a_moving_interferer_is_followed() {
    for relays in [8, 3] {
        for speed_mps in [1.2, 3.0, 9.0] {
            let listen = Listen {
                every: Duration::from_millis(std::env::var("E").map_or(1_000, |n| n.parse().unwrap())),
                half_life: Duration::from_millis(std::env::var("H").map_or(4_000, |n| n.parse().unwrap())),
                ..Listen::default()
            };
            let (mut followed, mut stayed) = shares(relays, speed_mps, listen);
            let mean = |shares: &[f64]| shares.iter().sum::<f64>() / shares.len() as f64;
            println!(
                "N = {relays}, {speed_mps} m/s: followed {:.4} (least {:.4}), stayed {:.4}",
                mean(&followed),
                quantile(&mut followed, 0.0),
                mean(&stayed)
            );
            _ = quantile(&mut stayed, 0.5);
        }
    }
}

#[test]
fn debug() {
    let relays: u16 = std::env::var("N").map_or(8, |n| n.parse().unwrap());
    let speed_mps: f64 = std::env::var("V").map_or(3.0, |n| n.parse().unwrap());
    let mut wild = Wild::new(1, relays, 1);
    if let uav_relay_sim::scenario::Interference::Sources(sources) = &mut wild.scenario.interference {
        sources[0].x_m = 100.0;
        sources[0].y_m = 300.0;
    }
    let mut setup = wild.flown(Interference::Unknown);
    setup.settings.listen = Some(Listen { every: Duration::from_millis(1000), half_life: Duration::from_millis(4_000), ..Listen::default() });
    let sky = setup.sky.as_mut().unwrap();
    sky.velocity_mps = [speed_mps, 0.0];
    sky.until = Instant::from_millis(160_000);
    let sky = sky.clone();
    let outcome = run(setup).unwrap();
    for stand in outcome.stands.iter() {
        let scene = sky.scene_at(stand.at);
        let mut now = wild.clone();
        now.scenario.interference = uav_relay_sim::scenario::Interference::Sources(scene.sources.clone());
        let (best, places) = now.told();
        let lag: Vec<i32> = places.iter().zip(&stand.places).map(|(a, b)| (a.x_m - b.x_m) as i32).collect();
        let goal: Vec<i32> = stand.goals.iter().flatten().zip(&places).map(|(a, b)| (b.x_m - a.x_m) as i32).collect();
        println!("{} true {:.0} {:?} share {:.3} agreements {} lag {lag:?} goal {goal:?}", stand.at.as_micros() / 1_000_000, scene.sources[0].x_m, stand.believed, share(&scene, &stand.places) / best, stand.agreements);
    }
}
