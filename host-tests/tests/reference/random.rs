//! Reference on random links, compared with scans, brute force, and between methods.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::{self, Chain, Style, log_uniform};
use uav_relay_oracle::reference::Link;

/// Draws `count` random chains, and runs `check` on each. `check` also gets the random generator.
fn for_links(
    default_seed: u64,
    count: u32,
    style: &Style,
    mut check: impl FnMut(&Link, &mut ChaCha8Rng),
) {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(default_seed));
    for _ in 0..count {
        let link = random::link(&mut rng, style);
        check(&link, &mut rng);
    }
}

/// Checks the receiver's farthest x at which a hop meets a target SIR against a scan of many positions.
#[test]
fn reaches_agree_with_a_scan() {
    let (mut hills, mut blocked, mut inside) = (0, 0, 0);
    for_links(11, 3000, &make::style(2..=2, Chain::Any), |link, rng| {
        let k = rng.random_range(1..=2);
        let start = if k == 1 || rng.random_bool(0.2) {
            0.0
        } else {
            link.distance_m * rng.random::<f64>()
        };
        let span = link.distance_m - start;
        // A third of the interferers are behind the sender, where the SIR has a maximum.
        let mut link = link.clone();
        let behind = rng.random_bool(0.33);
        if behind {
            link.x_i = start - span * log_uniform(rng, 1e-3, 1.0);
        }
        let sir = |x: f64| link.sir_relay(k, start, x).unwrap();
        let miss = if behind {
            1.0
        } else {
            log_uniform(rng, 0.5, 1.5)
        };
        let target = sir(start + span * log_uniform(rng, 1e-4, 1.0)) * miss;
        let reach = link.farthest(k, start, target);
        let samples = (0..=2000).map(|i| start + span * (f64::from(i) / 2000.0).powi(2));
        let seen = samples
            .filter(|&x| x <= link.distance_m && sir(x) >= target)
            .fold(f64::NEG_INFINITY, f64::max);
        if let Some(x) = reach {
            assert!(
                x >= seen && (start..=link.distance_m).contains(&x),
                "{x} {seen} {link:?}"
            );
            assert!(sir(x) >= target * (1.0 - 1e-15));
            // Beyond the reach no position meets the target.
            for i in 1..=50 {
                let beyond = x + (link.distance_m - x) * f64::from(i) / 50.0;
                assert!(
                    x == link.distance_m || sir(beyond) < target * (1.0 + 1e-12),
                    "{x} {beyond} {link:?}"
                );
            }
            inside += u32::from(x < link.distance_m);
            hills += u32::from(x < link.distance_m && sir(start) < target);
        } else {
            assert!(seen == f64::NEG_INFINITY, "{seen} {link:?}");
            blocked += 1;
        }
    });
    println!("inside {inside}, of them over a hill {hills}; blocked {blocked}");
    assert!(inside > 500 && hills > 100 && blocked > 100);
}

/// Checks that the optimum of one and two relays agrees with brute force.
///
/// The cases are with and without a minimum separation. At different altitudes, a relay may have to stop short of its
/// farthest position. So the reference computes all possible positions of each relay.
#[test]
fn one_and_two_relays_agree_with_brute_force() {
    for (seed, count, n, chain, points, apart) in [
        (21, 400, 1, Chain::Any, 100, false),
        (22, 200, 2, Chain::Any, 32, false),
        (23, 300, 2, Chain::Own, 32, false),
        (24, 200, 2, Chain::Any, 32, true),
        (25, 200, 2, Chain::Own, 32, true),
    ] {
        let (mut mixed_gains, mut dead, mut costs) = (0, 0, 0);
        let relays = n..=n;
        for_links(seed, count, &Style { relays, chain }, |link, rng| {
            let mut link = link.clone();
            if apart {
                link.min_separation_m = link.distance_m * log_uniform(rng, 0.01, 1.2);
            }
            let found = link.optimum_by_search(points);
            let Some(optimum) = link.optimum_apart() else {
                dead += 1;
                assert_eq!(found, 0.0);
                return;
            };
            assert!(
                found <= optimum * (1.0 + 1e-12),
                "search {found:e} beats {optimum:e}: {link:?}"
            );
            assert!(
                found >= optimum * (1.0 - 1e-6),
                "search {found:e} misses {optimum:e}: {link:?}"
            );
            let free = link.optimum().unwrap();
            assert!(apart || optimum == free);
            costs += u32::from(optimum < free * 0.999);
            let greedy = link.farthest_optimum();
            mixed_gains += u32::from(greedy.is_none_or(|greedy| greedy < free * (1.0 - 1e-9)));
        });
        println!(
            "N = {n}, {chain:?}: greedy below the optimum in {mixed_gains} of {count}, separation costs SIR in {costs}, SIR of zero in {dead}"
        );
        assert!(n > 1 || mixed_gains == 0);
        assert!(chain != Chain::Own || mixed_gains > 0);
        assert!(!apart || costs > 20);
    }
}

#[test]
fn greedy_and_exact_agree_at_a_common_altitude() {
    for_links(
        31,
        300,
        &make::style(1..=30, Chain::OwnPower),
        |link, rng| {
            let Some(optimum) = link.optimum() else {
                return;
            };
            for target in [
                optimum,
                optimum * (1.0 + 1e-11),
                optimum * log_uniform(rng, 0.1, 10.0),
            ] {
                let (greedy, exact) = (link.feasible(target), link.placement(target));
                assert_eq!(greedy.is_some(), exact.is_some(), "{target:e} {link:?}");
            }
        },
    );
}

/// Checks that the reference finds positions that meet a given target SIR. The reference computes for each relay the
/// positions that it can reach, and then chooses positions backward from Rx.
#[test]
fn placements_meet_their_target() {
    let style = make::style(2..=12, Chain::OwnAltitude);
    for_links(32, 1000, &style, |link, rng| {
        let Some(optimum) = link.optimum() else {
            return;
        };
        for _ in 0..4 {
            let target = optimum * log_uniform(rng, 0.05, 1.0);
            let x = link.placement(target).unwrap();
            assert!(x.is_sorted(), "{x:?}");
            assert!(
                link.chain_sir(&x) >= target * (1.0 - 1e-14),
                "{target:e} {link:?}"
            );
            // The best SIR with all relays at their farthest positions is at most the exact optimum.
            assert!(
                link.farthest_optimum()
                    .is_none_or(|greedy| greedy <= optimum * (1.0 + 1e-12))
            );
        }
    });
}

#[test]
fn no_perturbation_beats_the_optimum() {
    let mut compared = 0;
    for_links(41, 400, &Style::ANY, |link, rng| {
        let Some(optimum) = link.optimum() else {
            return;
        };
        let x = link.placement(optimum).unwrap();
        assert_eq!(x.len(), link.len());
        assert!(x.is_sorted() && x[0] >= 0.0 && x[x.len() - 1] <= link.distance_m);
        assert!(link.chain_sir(&x) >= optimum * (1.0 - 1e-14), "{link:?}");
        for _ in 0..40 {
            let size = link.distance_m * log_uniform(rng, 1e-9, 0.3);
            let all = rng.random_bool(0.5);
            let mut moved = x.clone();
            for x in &mut moved {
                if all || rng.random_bool(0.3) {
                    *x = (*x + size * rng.random_range(-1.0..=1.0)).clamp(0.0, link.distance_m);
                }
            }
            moved.sort_by(f64::total_cmp);
            let sir = link.chain_sir(&moved);
            assert!(
                sir <= optimum * (1.0 + 1e-12),
                "{sir:e} > {optimum:e}: {link:?}"
            );
            compared += 1;
        }
    });
    assert!(compared > 10_000);
}

#[test]
fn the_generator_draws_every_class() {
    let mut seen = [0_u32; 10];
    for_links(51, 2000, &Style::ANY, |link, _| {
        let d = link.distance_m;
        let first = link.relays[0];
        let classes = [
            link.x_i == 0.0,
            link.x_i == d,
            link.x_i < 0.0,
            link.x_i > d,
            link.x_i.abs() > 10.0 * d,
            link.y_i == 0.0,
            link.relays
                .iter()
                .any(|relay| relay.altitude_m != first.altitude_m),
            link.relays
                .iter()
                .any(|relay| relay.power_w != first.power_w),
            link.len() == 1,
            link.len() > 40,
        ];
        for (count, hit) in seen.iter_mut().zip(classes) {
            *count += u32::from(hit);
        }
        assert!((10.0..=1e5).contains(&d) && (1..=50).contains(&link.len()));
        assert!(
            link.relays
                .iter()
                .all(|relay| (1.0..=5000.0).contains(&relay.altitude_m))
        );
    });
    println!("{seen:?}");
    assert!(seen.iter().all(|&count| count >= 60));
}
