//! Checks of the f64 reference for chains in stochastic interference by independent values and methods.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::random::{log_uniform, seed};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::stochastic::StochasticLink;

use super::off;

/// Upsilon = E[1/I], 1/W, of the constant interference in the chains that a separate program computed.
///
/// I is the interference power. With this value, a relay straight above Rx at 20 m has an expected SIR of 0.8 at Rx.
const UPSILON: f64 = 2_301_379.773_574_951;

/// Returns the paper's multi-hop chain of `n` relays, with constant interference along the line.
fn paper(n: usize) -> StochasticLink {
    let link = Link::paper(n);
    StochasticLink {
        distance_m: link.distance_m,
        tx_w: link.tx_w,
        mu_los: link.mu_los,
        eta: link.eta,
        upsilon: vec![(0.0, UPSILON)],
        relays: link.relays,
    }
}

/// Returns a chain of one relay at 10 m altitude over a line of 100 m. Tx has 10 W, the relay 1 W, and all path-loss
/// factors are 1.
fn short(upsilon: Vec<(f64, f64)>) -> StochasticLink {
    StochasticLink {
        distance_m: 100.0,
        tx_w: 10.0,
        mu_los: 1.0,
        eta: 1.0,
        upsilon,
        relays: vec![make::reference_relay(10.0, 1.0)],
    }
}

/// Checks that the positions `got` begin at `first` and are `step` apart.
fn evenly(got: &[f64], first: f64, step: f64) {
    for (k, got) in (0..).zip(got) {
        let want = first + step * f64::from(k);
        assert!(off(*got, want) < 1e-7, "relay {k}: {got} against {want}");
    }
}

#[test]
fn algorithm_4_takes_the_steps_of_the_reference_program() {
    let twenty = paper(20).algorithm4(0.1).unwrap();
    assert!(off(twenty.gamma, 0.2) < 1e-12);
    assert_eq!((twenty.iterations, twenty.places.len()), (7, 20));
    evenly(&twenty.places, 205.358_983_848_622_42, 40.0);

    let fifty = paper(50).algorithm4(0.1).unwrap();
    assert!(off(fifty.gamma, 0.8) < 1e-12);
    assert_eq!((fifty.iterations, fifty.places.len()), (1, 50));
    evenly(&fifty.places, 20.0, 20.0);

    // At full reach fewer than 100 relays fill the distance: the others are above Tx.
    let hundred = paper(100).algorithm4(0.1).unwrap();
    assert_eq!((hundred.iterations, hundred.places[0]), (1, 0.0));
    // The optimum of eight, 0.09117, is below the step, so no target is found.
    assert_eq!(paper(8).algorithm4(0.1), None);
    assert!(off(paper(8).algorithm4(1e-4).unwrap().gamma, 0.091_17) < 2e-3);
}

#[test]
fn the_fewest_relays_are_those_of_the_reference_program() {
    let low = paper(1).fewest(0.2, 100).unwrap();
    assert_eq!(low.iterations, 17);
    evenly(&low.places, 325.358_983_848_622_4, 40.0);
    let high = paper(1).fewest(0.79, 100).unwrap();
    assert_eq!(high.iterations, 42);
    evenly(&high.places, 172.576_271_298_479_2, 20.126_184_217_065);
    // Only shorter hops help, and 12 relays suffice.
    let link = StochasticLink {
        distance_m: 105.0,
        tx_w: 1.0,
        ..short(vec![(0.0, 100.0)])
    };
    assert_eq!(link.fewest(1.0, 100).unwrap().iterations, 12);
    assert_eq!(link.fewest(1.0, 11), None);
}

#[test]
fn algorithm_3_takes_the_steps_of_the_reference_program() {
    let link = short(vec![(0.0, 4.0)]);
    let printed = link.algorithm3_printed(1e-4).unwrap();
    assert!(off(printed.x_m, 77.297_916_056_347_92) < 1e-6);
    assert!(off(printed.sir, 0.006_499_999_999_999_889_5) < 1e-6);
    assert_eq!(printed.iterations, 336);
    // The corrected algorithm may end a step earlier, but its SIR is never lower.
    let right = link.algorithm3(1e-4).unwrap();
    let (_, optimum) = link.single_optimum(1000).unwrap();
    assert!(right.sir >= printed.sir && right.sir <= optimum * (1.0 + 1e-12));
    assert!(optimum - right.sir <= 1e-4);
}

#[test]
fn the_first_feasible_target_is_not_the_optimum() {
    // The field is quiet from 90 m on, and loud before.
    let link = short(vec![(0.0, 0.1), (90.0 - 1e-9, 0.1), (90.0, 100.0)]);
    let printed = link.algorithm3_printed(1e-5).unwrap();
    assert!((printed.sir - 0.009_98).abs() < 1e-5, "{printed:?}");
    let right = link.algorithm3(1e-5).unwrap();
    assert!((right.sir - 0.121_95).abs() < 1e-5, "{right:?}");
    let (x, optimum) = link.single_optimum(1000).unwrap();
    assert!((x - 90.0).abs() < 1e-6 && off(optimum, 1000.0 / 8200.0) < 1e-9);
    assert!(off(link.backward_best(2000), optimum) < 1e-3);
}

/// Draws a chain of identical relays with the same interference everywhere on the line.
fn random_chain(rng: &mut ChaCha8Rng) -> StochasticLink {
    let distance_m = log_uniform(rng, 10.0, 1e5);
    let station = make::reference_relay(
        (log_uniform(rng, 0.002, 0.2) * distance_m).clamp(1.0, 5000.0),
        log_uniform(rng, 0.01, 100.0),
    );
    let mu_los = log_uniform(rng, 1.0, 1e4);
    StochasticLink {
        distance_m,
        tx_w: log_uniform(rng, 0.1, 1e3),
        mu_los,
        eta: mu_los * log_uniform(rng, 1.0, 20.0),
        upsilon: vec![(0.0, log_uniform(rng, 1e-3, 1e12))],
        relays: vec![station; rng.random_range(1..20)],
    }
}

#[test]
fn constant_interference_gives_equal_optima() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(1));
    let mut capped = 0;
    for _ in 0..150 {
        let link = random_chain(&mut rng);
        let closed = link.iid_optimum().unwrap();
        let ceiling = link.ceiling();
        let found = link.backward_best(400);
        assert!(off(found, closed) < 1e-6, "{link:?}: {found:e} {closed:e}");
        let apart = link.best_apart(0.0);
        assert!(off(apart, closed) < 1e-6, "{link:?}: {apart:e} {closed:e}");
        // A fixed step is never better, and at most one step worse.
        let step = closed * 0.01;
        if ceiling / step < 1e5 {
            let fixed = link.algorithm4(step).unwrap();
            assert!(fixed.gamma <= closed * (1.0 + 1e-9), "{link:?}");
            assert!(fixed.gamma >= closed - step * (1.0 + 1e-6), "{link:?}");
            assert!(link.chain_sir(&fixed.places) >= fixed.gamma * (1.0 - 1e-9));
        }
        if link.relays.len() == 1 {
            let (_, best) = link.single_optimum(200).unwrap();
            assert!(off(best, closed) < 1e-6, "{link:?}");
        }
        capped += u32::from(
            off(
                closed,
                ceiling.min(ceiling * link.tx_w / link.relays[0].power_w),
            ) < 1e-12,
        );
    }
    println!("{capped} of 150 at the ceiling");
    assert!(capped > 0, "the ceiling was never reached");
}

#[test]
fn one_relay_in_any_field_is_placed_by_backward_search() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(2));
    for _ in 0..100 {
        let mut link = random_chain(&mut rng);
        link.relays.truncate(1);
        let d = link.distance_m;
        let knots = rng.random_range(2..8_u8);
        link.upsilon = (0..knots)
            .map(|k| {
                let x = d * f64::from(k) / f64::from(knots - 1);
                (x, log_uniform(&mut rng, 1e3, 1e5))
            })
            .collect();
        assert_eq!(link.iid_optimum(), None);
        let (x, best) = link.single_optimum(500).unwrap();
        assert!(off(link.chain_sir(&[x]), best) < 1e-12);
        let apart = link.best_apart(0.0);
        assert!(off(apart, best) < 1e-5, "{link:?}: {apart:e} {best:e}");
        let backward = link.backward_best(2000);
        assert!(
            backward <= best * (1.0 + 1e-6),
            "{link:?}: {backward:e} {best:e}"
        );
        assert!(
            backward >= best * (1.0 - 1e-3),
            "{link:?}: {backward:e} {best:e}"
        );
        let stepped = link.algorithm3(link.ceiling() * 1e-4).unwrap();
        assert!(
            best - stepped.sir <= link.ceiling() * 1e-4,
            "{link:?}: {stepped:?} {best:e}"
        );
    }
}

#[test]
fn the_expected_sir_is_power_over_distance_and_upsilon() {
    let link = StochasticLink {
        distance_m: 100.0,
        tx_w: 8.0,
        mu_los: 2.0,
        eta: 4.0,
        upsilon: vec![(0.0, 1.0), (100.0, 11.0)],
        relays: vec![
            make::reference_relay(3.0, 10.0),
            make::reference_relay(6.0, 13.0),
        ],
    };
    assert_eq!(link.upsilon_at(-5.0), 1.0);
    assert_eq!(link.upsilon_at(105.0), 11.0);
    // 8 W over 4 (40^2 + 3^2), 10 W over 2 (10^2 + 3^2), 13 W over 4 (50^2 + 6^2); Upsilon 5, 6 and 11.
    let want = [40.0 / 6436.0, 60.0 / 218.0, 143.0 / 10144.0];
    let got = link.hop_sirs(&[40.0, 50.0]);
    assert_eq!(got.len(), 3);
    for (got, want) in got.iter().zip(want) {
        assert!(off(*got, want) < 1e-14, "{got} {want}");
    }
    assert_eq!(link.chain_sir(&[40.0, 50.0]), got[0]);
    assert!(link.hop_sirs(&[40.0]).is_empty() && link.chain_sir(&[40.0]) == 0.0);
}
