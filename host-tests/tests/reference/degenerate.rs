//! Reaches where formulas divide by zero or lose a root, with answers worked out by hand.

use host_tests::make;
use uav_relay_oracle::reference::Link;

use super::close;

#[test]
fn degenerate_reaches_are_right() {
    let base = Link::paper(2);
    // Interferer at Tx: hop 1 has SIR 1 everywhere.
    let at_tx = Link {
        x_i: 0.0,
        y_i: 0.0,
        ..base.clone()
    };
    assert_eq!(at_tx.farthest(1, 0.0, 1.0), Some(1000.0));
    assert_eq!(at_tx.farthest(1, 0.0, 1.0 + 1e-12), None);
    // Target equal to the SIR's limit at large distances.
    close(
        base.farthest(1, 0.0, 1.0).unwrap(),
        410.0,
        1e-12,
        "gamma = A, ahead",
    );
    assert_eq!(
        Link {
            x_i: -1.0,
            ..base.clone()
        }
        .farthest(1, 0.0, 1.0),
        Some(1000.0)
    );
    close(
        base.farthest(2, 0.0, 1.0 / 80.0).unwrap(),
        410.4,
        1e-12,
        "gamma = A, middle",
    );
    // Sender abreast of the interferer: (H + d^2) / 80 d^2 = 5 at d^2 = H / 399.
    let abreast = base.farthest(2, 500.0, 5.0).unwrap() - 500.0;
    close(abreast, (160_400.0_f64 / 399.0).sqrt(), 1e-12, "X = from_x");
    // A maximum in the middle: both ends of the hop miss the target.
    let behind = Link {
        x_i: -10.0,
        y_i: 0.0,
        distance_m: 3500.0,
        ..Link::paper(1)
    };
    let behind = Link {
        relays: vec![make::reference_relay(50.0, 1.0)],
        ..behind
    };
    let (near, far) = (
        behind.sir_relay(1, 0.0, 0.0).unwrap(),
        behind.sir_relay(1, 0.0, 3500.0).unwrap(),
    );
    let reach = behind.farthest(1, 0.0, 1.1).unwrap();
    assert!(near < 1.1 && far < 1.1 && reach > 0.0);
    close(
        behind.sir_relay(1, 0.0, reach).unwrap(),
        1.1,
        1e-13,
        "far side of the hill",
    );
    assert!(behind.sir_relay(1, 0.0, reach + 1e-6).unwrap() < 1.1);
    assert_eq!(behind.farthest(1, 0.0, 1.25), None);
    // Interferer on Rx: no target is met.
    let on_rx = Link {
        x_i: 1000.0,
        y_i: 0.0,
        ..base.clone()
    };
    assert_eq!((on_rx.optimum(), on_rx.rx_reach(1e-9)), (None, None));
    // Queries without an answer.
    assert_eq!(
        (base.farthest(0, 0.0, 1.0), base.farthest(3, 0.0, 1.0)),
        (None, None)
    );
    assert_eq!(
        (
            base.farthest(2, 1000.1, 1.0),
            base.farthest(2, f64::NAN, 1.0)
        ),
        (None, None)
    );
    assert_eq!((base.rx_reach(0.0), base.rx_reach(f64::NAN)), (None, None));
    assert_eq!(
        (Link::paper(0).optimum(), Link::paper(0).feasible(1.0)),
        (None, None)
    );
    assert_eq!(base.chain_sir(&[1.0]), 0.0);
}

/// Checks that the reference finds a chain in which relay 1 is not at its farthest possible position.
///
/// With relay 1 at its farthest position, relay 2, which is lower, would have to be too near to the interferer. The
/// chain with all relays at their farthest positions has less than a fifth of the best SIR.
#[test]
fn the_farthest_positions_are_not_best_at_mixed_altitudes() {
    let link = Link {
        distance_m: 2224.8,
        tx_w: 22.15,
        interferer_w: 4.99,
        x_i: 1026.0,
        y_i: 60.0,
        relays: [527.0, 298.0]
            .map(|altitude_m| make::reference_relay(altitude_m, 2.2))
            .to_vec(),
        ..Link::paper(0)
    };
    let (greedy, best) = (link.farthest_optimum().unwrap(), link.optimum().unwrap());
    assert!(greedy < 0.2 * best, "{greedy} {best}");
    close(link.optimum_by_search(64), best, 1e-6, "brute force");
    assert!(link.feasible(best).is_none());
    let first = link.farthest(1, 0.0, best).unwrap();
    assert!(first > 100.0 && link.farthest(2, first, best).is_none());
    assert!(link.chain_sir(&link.placement(best).unwrap()) >= best * (1.0 - 1e-14));
}

/// Checks the first target SIR of the paper's fixed-step search for an interferer behind Tx.
///
/// The first target must be the best SIR of the first hop. The first hop has this SIR with relay 1 some way beyond
/// Tx, not straight above Tx.
#[test]
fn the_fixed_step_starts_above_the_hilltop() {
    let relay = make::reference_relay(50.0, 1e3);
    let link = Link {
        x_i: -10.0,
        y_i: 0.0,
        distance_m: 35.0,
        relays: vec![relay],
        ..Link::paper(1)
    };
    let above_tx = link.sir_relay(1, 0.0, 0.0).unwrap();
    let best = link.optimum().unwrap();
    close(above_tx, 1.04, 1e-12, "above Tx");
    assert!(best > 1.2);
    let (count, target) = link.fixed_step(0.001).unwrap();
    assert_eq!(count, 1);
    close(target, best, 1e-12, "no step is needed");
}
