//! Best chain at one altitude, and best such altitude.

use std::time::Instant;

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::SeedableRng;
use uav_relay_oracle::random::{self, Chain, seed};
use uav_relay_oracle::reference::Link;
use uav_relay_scenario::scene::Corridor;
use uav_relay_scenario::scene::Scene;
use uav_relay_tools::multi_interferer::{self, best_common_altitude, optimum};

use super::scenes::{level, of_link, scene};
use super::{above, brute};

/// Checks a chain's order, altitudes, separation and SIR, and returns the chain.
pub(crate) fn checked(scene: &Scene, chain: multi_interferer::Chain) -> multi_interferer::Chain {
    let places = &chain.places;
    assert_eq!(places.len(), scene.relays.len());
    assert_eq!(scene.chain_sir(places), chain.sir);
    assert!(chain.free_sir >= chain.sir);
    assert!(
        places
            .iter()
            .all(|&(x, h)| (0.0..=scene.distance_m).contains(&x)
                && (scene.band.least_m..=scene.band.most_m).contains(&h))
    );
    for pair in places.windows(2) {
        let step = pair[1].0 - pair[0].0;
        assert!(step >= scene.min_separation_m * (1.0 - 1e-9), "{chain:?}");
    }
    chain
}

#[test]
fn for_one_source_the_optimum_is_that_of_the_reference() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(76));
    let (mut worst, mut hopeless) = (0.0_f64, 0);
    for at in 0..600 {
        let chain = [Chain::Alike, Chain::OwnPower][at % 2];
        let link = random::link(&mut rng, &make::style(1..=50, chain));
        let scene = of_link(&link);
        match (optimum(&scene), link.optimum()) {
            (Some(ours), Some(theirs)) => {
                let ours = checked(&scene, ours);
                assert!(!ours.separation_binds());
                worst = worst.max(above(ours.sir, theirs).abs());
            }
            (None, None) => hopeless += 1,
            other => panic!("{other:?} in {link:?}"),
        }
    }
    println!("off the optimum of the reference by {worst:.1e} at most; {hopeless} without SIR");
    assert!(worst < 1e-9, "{worst}");
}

/// Checks that the optimum of one to four relays agrees with a brute-force search.
///
/// In a third of the scenes the relays have different powers; half of the scenes have a minimum separation.
#[test]
fn brute_force_finds_the_same() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(77));
    let (mut worst, mut binding) = (0.0_f64, 0);
    for at in 0..100 {
        let scene = level(scene(&mut rng, 1..=4, 2..=5));
        let found = checked(&scene, optimum(&scene).unwrap());
        let brute = brute::best(&scene, scene.band.least_m);
        let off = above(found.sir, brute);
        worst = worst.max(off.abs());
        binding += u32::from(found.separation_binds());
        assert!(
            off.abs() < 1e-6,
            "scene {at}: {off:e}, {found:?} in {scene:?}"
        );
        let free = Scene {
            min_separation_m: 0.0,
            ..scene
        };
        let free = optimum(&free).unwrap();
        assert!(above(found.free_sir, free.sir).abs() < 1e-11);
    }
    println!(
        "off what brute force finds by {worst:.1e} at most; the separation binds in {binding}"
    );
    assert!(binding >= 3, "{binding}");
}

#[test]
fn a_scene_without_an_optimum_has_none() {
    let paper = |n| of_link(&Link::paper(n));
    assert!(optimum(&paper(3)).is_some());
    let mut uneven = paper(3);
    uneven.relays[1].altitude_m = 21.0;
    assert_eq!(optimum(&uneven), None);
    let mut jammed = paper(3);
    (jammed.sources[0].x_m, jammed.sources[0].y_m) = (1000.0, 0.0);
    assert_eq!(optimum(&jammed), None);
    let empty = Scene {
        relays: Vec::new(),
        ..paper(1)
    };
    assert_eq!(optimum(&empty), None);
    let quiet = Scene {
        sources: Vec::new(),
        ..paper(3)
    };
    assert_eq!(optimum(&quiet), None);
    let held = |holds| {
        let mut scene = paper(3);
        scene.band.most_m = 30.0;
        scene.relays[2].holds = holds;
        best_common_altitude(&scene).is_some()
    };
    assert!(held(false) && !held(true));
}

/// Checks that positions are found for as many relays as the separation permits.
///
/// A separation that is larger by 0.1 % must be refused. Positions must also be found for a thousand relays of
/// different powers.
#[test]
fn crowded_and_long_chains_are_placed() {
    let crowd = |n, apart| Scene {
        min_separation_m: apart,
        ..of_link(&Link::paper(n))
    };
    for n in [2, 11, 101] {
        let apart = 1000.0 / (n as f64 - 1.0);
        let full = crowd(n, apart);
        let found = checked(&full, optimum(&full).unwrap());
        assert!(found.separation_binds(), "{found:?}");
        assert!(found.places[0].0 < 1e-6 && found.places[n - 1].0 > 1000.0 - 1e-6);
        assert_eq!(optimum(&crowd(n, apart * 1.001)), None);
    }
    let mut long = crowd(1000, 0.3);
    for (i, relay) in long.relays.iter_mut().enumerate() {
        relay.power_w = 1.0 + 1e-3 * i as f64;
    }
    let started = Instant::now();
    let found = checked(&long, optimum(&long).unwrap());
    println!("1000 relays: SIR {:.3}, {:?}", found.sir, started.elapsed());
    assert!(found.sir > 40.0, "more than a hundred relays reach");
}

/// Checks that the best common altitudes of the paper's scenario, and their SIRs, equal known values.
///
/// The interferer is at y = 150 m, altitudes are 20 m to 300 m, and the separation is 4 m.
#[test]
fn known_best_common_altitudes_are_found() {
    for (n, sir, altitude_m) in [
        (2, 0.881_533_2, 20.0),
        (5, 1.047_409_1, 20.0),
        (8, 1.228_699_0, 210.45),
        (50, 5.450_572_0, 209.42),
    ] {
        let mut scene = of_link(&Link {
            y_i: 150.0,
            min_separation_m: 4.0,
            ..Link::paper(n)
        });
        scene.band.most_m = 300.0;
        let found = checked(&scene, best_common_altitude(&scene).unwrap());
        let h = found.places[0].1;
        println!("{n}: {} at {h}", found.sir);
        assert!(above(found.sir, sir).abs() < 1e-7, "{n}: {}", found.sir);
        assert!((h - altitude_m).abs() < 0.01, "{n}: {h}");
    }
}

#[test]
fn no_altitude_of_a_dense_scan_is_better() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(78));
    let mut inside = 0;
    for at in 0..8 {
        let mut scene = scene(&mut rng, 1..=6, 2..=5);
        scene.band.most_m = 0.5 * scene.distance_m;
        let found = checked(&scene, best_common_altitude(&scene).unwrap());
        let Corridor {
            least_m, most_m, ..
        } = scene.band;
        let h = found.places[0].1;
        inside += u32::from(h > least_m * 1.001 && h < most_m * 0.999);
        for i in 0..=120 {
            let h = least_m * (most_m / least_m).powf(f64::from(i) / 120.0);
            let mut flown = scene.clone();
            for relay in &mut flown.relays {
                relay.altitude_m = h;
            }
            let there = optimum(&flown).unwrap().sir;
            assert!(
                found.sir >= there * (1.0 - 1e-9),
                "scene {at}: {there} at {h}, {found:?}"
            );
        }
    }
    println!("{inside} of 8 best altitudes lie inside their bands");
    assert!(inside > 0);
}
