//! Relays that may stand to the side of the Tx-Rx plane.

use host_tests::random::joint::Scenario;
use host_tests::reference::Link;
use host_tests::reference::joint::{Corridor, Effort};

use crate::{PAPER_BAND, checked, close};

/// Places to the side: all of (x, y, h) free in a general-purpose optimiser of 24 starts.
#[test]
fn known_optima_in_space_are_found() {
    let wide = Corridor {
        left_m: -280.0,
        right_m: 280.0,
        ..PAPER_BAND
    };
    let low = |side_m: f64| Corridor {
        least_m: 20.0,
        most_m: 120.0,
        left_m: -side_m,
        right_m: side_m,
    };
    let known = [
        (3, 500.0, 150.0, PAPER_BAND, 0.9379),
        (8, 500.0, 400.0, PAPER_BAND, 2.4656),
        (3, 300.0, 50.0, PAPER_BAND, 1.1226),
        (3, 500.0, 150.0, wide, 1.0732),
        (8, 500.0, 150.0, wide, 1.5430),
        (8, 500.0, 400.0, wide, 2.9831),
        (3, 300.0, 50.0, wide, 1.1761),
        (8, 500.0, 150.0, low(30.0), 1.2689),
        (8, 500.0, 150.0, low(100.0), 1.3790),
        (50, 500.0, 150.0, wide, 9.0026),
    ];
    for (n, x_i, y_i, corridor, want) in known {
        for sign in [1.0, -1.0] {
            let of = Scenario {
                link: Link {
                    x_i,
                    y_i: sign * y_i,
                    min_separation_m: 4.0,
                    ..Link::paper(n)
                },
                corridor,
            };
            let found = checked(&of, Effort { seed: 1, rounds: 1 });
            let what = format!("N = {n}, X = {x_i}, Y = {y_i}, {corridor:?}");
            close(found.sir, want, 1e-4, &what);
        }
    }
}
