//! What must not happen: a still world that is not left in peace, relays that believe different things, a broken sensor that is believed.

use rayon::prelude::*;
use uav_relay::{Instant, Interference};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::Turning;

use crate::scenes::{Wild, count, quantile, sir};

/// An hour of a still world, measured every second.
#[test]
fn a_still_world_becomes_silent() {
    let seeds: Vec<u64> = (0..count(12)).collect();
    let most = seeds
        .into_par_iter()
        .map(|seed| {
            let relays = [3, 5, 8, 20][seed as usize % 4];
            let wild = Wild::new(seed, relays, 1);
            let mut setup = wild.setup(Interference::Unknown);
            let sky = setup.sky.as_mut().unwrap();
            sky.period = crate::scenes::seconds(1);
            sky.until = Instant::from_millis(3_600_000);
            setup.deadline = Instant::from_millis(3_700_000);
            let outcome = run(setup).unwrap();
            // The first agreement is that of relays which know nothing.
            let found = outcome.stands.last().unwrap().agreements - 1;
            let last = outcome.stands.iter().position(|stand| stand.agreements == found + 1);
            let at = outcome.stands[last.unwrap()].at.as_micros() / 1_000_000;
            println!("seed {seed}: {relays} relays, {found} agreements, the last after {at} s");
            found
        })
        .max();
    assert!(most.unwrap() <= 5, "{most:?}");
}

#[test]
fn under_faults_all_believe_the_same_to_the_bit() {
    let seeds: Vec<u64> = (0..count(20)).collect();
    let mut shares: Vec<f64> = seeds
        .into_par_iter()
        .map(|seed| {
            let wild = Wild::new(seed, 8, 1);
            let mut setup = wild.setup(Interference::Unknown);
            setup.faults = Faults::BAD_DAY;
            let outcome = run(setup).unwrap();
            assert!(outcome.injected.lost > 0 && outcome.injected.corrupted > 0);
            let told: Vec<_> = outcome.relays.iter().map(|relay| relay.believed).collect();
            assert!(told.iter().all(|one| one.number > 0));
            // Who holds a place holds it for what is believed; the last belief may still be on its way.
            let last = outcome.stands.last().unwrap();
            let bits = |one: &uav_relay::sensing::belief::Told| format!("{one:?}");
            let settled = told.windows(2).all(|pair| bits(&pair[0]) == bits(&pair[1]));
            assert!(settled, "{seed}: {told:?}");
            sir(&wild.scene(), last.goals.as_ref().unwrap()) / wild.optimum()
        })
        .collect();
    assert!(quantile(&mut shares, 0.5) >= 0.98, "{shares:?}");
}

/// One relay of eight measures 20 dB too much, too little, or nonsense.
#[test]
fn a_broken_sensor_is_named_and_left_out() {
    for off_db in [20.0, -20.0, 60.0] {
        let seeds: Vec<u64> = (0..count(20)).collect();
        let outcomes: Vec<(bool, f64)> = seeds
            .into_par_iter()
            .map(|seed| {
                let wild = Wild::new(seed, 8, 1);
                let broken = 1 + (seed % 8) as u16;
                let mut setup = wild.setup(Interference::Unknown);
                setup.sky.as_mut().unwrap().broken = vec![(broken, off_db)];
                let outcome = run(setup).unwrap();
                let named = outcome
                    .moments
                    .iter()
                    .any(|moment| moment.what == Turning::Off && moment.other == Some(broken));
                let wrong = outcome
                    .moments
                    .iter()
                    .any(|moment| moment.what == Turning::Off && moment.other != Some(broken));
                assert!(!wrong, "{seed}: another one is named");
                let last = outcome.stands.last().unwrap();
                let share = sir(&wild.scene(), last.goals.as_ref().unwrap()) / wild.optimum();
                (named, share)
            })
            .collect();
        let named = outcomes.iter().filter(|(named, _)| *named).count();
        let mut shares: Vec<f64> = outcomes.iter().map(|(_, share)| *share).collect();
        let [least, tenth, median] = [0.0, 0.1, 0.5].map(|part| quantile(&mut shares, part));
        println!(
            "{off_db} dB: named {named} of {}, share median {median:.4}, 10 % {tenth:.4}, least {least:.4}",
            outcomes.len()
        );
    }
}

#[test]
fn debug() {
    use uav_relay::Interferer;
    for seed in 0..60 {
        let wild = Wild::new(seed, 3, 1);
        let source = &wild.scene().sources[0];
        let outcome = run(wild.setup(Interference::Source(Interferer {
            power_w: (100.0 * source.power_w) as f32,
            x_m: (1_000.0 - source.x_m) as f32,
            y_m: (-0.3 * source.y_m) as f32,
        })))
        .unwrap();
        let best = wild.optimum();
        let sirs = crate::scenes::by_agreement(&wild.scene(), &outcome.stands);
        if sirs.last().unwrap() / best < 0.9 {
            println!("seed {seed} {source:?}");
            let mut last = u16::MAX;
            for stand in &outcome.stands {
                if stand.believed.number != last {
                    last = stand.believed.number;
                    println!(
                        "  {} {:?} share {:.3} {:?}",
                        stand.at.as_micros() / 1_000_000,
                        stand.believed,
                        sir(&wild.scene(), stand.goals.as_ref().unwrap()) / best,
                        stand.goals.iter().flatten().map(|p| p.x_m as i32).collect::<Vec<_>>()
                    );
                }
            }
            for moment in &outcome.moments {
                if moment.what == Turning::Off || moment.what == Turning::Unclear {
                    println!("   {:?} {:?} {:?}", moment.at, moment.what, moment.other);
                }
            }
        }
    }
}
