//! An interferer that moves, against the chain that stays where it was best.

use rayon::prelude::*;
use uav_relay::{Instant, Interference, Listen};
use uav_relay_sim::simulator::chain::run;

use crate::scenes::{Wild, count, quantile, sir};

/// From then on, that long after the begin, it counts.
const BEGUN_S: f64 = 60.0;

/// Of every scene the mean share of the optimum of that moment: of the chain that follows, and of one that stays where it was best at first.
fn shares(relays: u16, speed_mps: f64) -> (Vec<f64>, Vec<f64>) {
    let seeds: Vec<u64> = (0..count(20)).collect();
    seeds
        .into_par_iter()
        .map(|seed| {
            let mut wild = Wild::new(seed, relays, 1);
            // It passes at 300 m, and is beside the middle half way.
            let span_s = 600.0 / speed_mps.max(3.0) + BEGUN_S;
            wild.place(500.0 - speed_mps * 0.5 * (span_s + BEGUN_S), 300.0);
            let mut setup = wild.flown(Interference::Unknown);
            setup.settings.listen = Some(Listen::following(relays));
            let sky = setup.sky.as_mut().unwrap();
            sky.velocity_mps = [speed_mps, 0.0];
            sky.until = Instant::from_millis((span_s * 1e3) as u64);
            let sky = sky.clone();
            let outcome = run(setup).unwrap();
            let begun = Instant::from_millis((BEGUN_S * 1e3) as u64);
            let (mut followed, mut stayed, mut n) = (0.0, 0.0, 0.0);
            let mut first = None;
            for stand in outcome.stands.iter().filter(|stand| stand.at >= begun) {
                let scene = sky.scene_at(stand.at);
                let (best, places) = wild.with(&scene).told();
                let first = first.get_or_insert(places);
                followed += sir(&scene, &stand.places) / best;
                stayed += sir(&scene, first) / best;
                n += 1.0;
            }
            assert!(n > 50.0, "{n} moments");
            (followed / n, stayed / n)
        })
        .unzip()
}

fn mean(shares: &[f64]) -> f64 {
    shares.iter().sum::<f64>() / shares.len() as f64
}

#[test]
fn a_moving_interferer_is_followed() {
    for (relays, speed_mps, least) in [
        (8, 1.2, 0.96),
        (8, 3.0, 0.95),
        (8, 9.0, 0.88),
        (3, 1.2, 0.0),
        (3, 3.0, 0.0),
        (3, 9.0, 0.0),
    ] {
        let (mut followed, stayed) = shares(relays, speed_mps);
        let (follows, stays) = (mean(&followed), mean(&stayed));
        println!(
            "N = {relays}, {speed_mps} m/s: {follows:.4} followed (the worst scene {:.4}), {stays:.4} stayed",
            quantile(&mut followed, 0.0),
        );
        assert!(follows >= least && follows > stays, "{relays}, {speed_mps}");
    }
}
