//! Joint optimum of relays with lateral room.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay_oracle::random::joint::{Scenario, in_space, with_own};
use uav_relay_oracle::random::{self, log_uniform};
use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{
    Corridor, Effort, Hold, Place, keeps_rules, optimum, sir,
};

use crate::{PAPER_BAND, checked, close, flown};

/// Runs `check` on random scenarios with lateral room, half of them with unlike relays.
fn for_scenarios(
    default_seed: u64,
    count: u32,
    most_relays: u32,
    mut check: impl FnMut(Scenario, &mut ChaCha8Rng),
) {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(default_seed));
    for number in 0..count {
        let mut drawn = in_space(&mut rng, &(1..=most_relays));
        if number % 2 > 0 {
            drawn = with_own(&mut rng, drawn);
        }
        check(drawn, &mut rng);
    }
}

/// Compares with a general-purpose optimiser of all (x, y, h), with 24 starts.
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
                held: Vec::new(),
            };
            let found = checked(&of, Effort { seed: 1, rounds: 1 });
            let what = format!("N = {n}, X = {x_i}, Y = {y_i}, {corridor:?}");
            close(found.sir, want, 1e-4, &what);
        }
    }
}

#[test]
fn seeds_agree() {
    for_scenarios(51, 24, 60, |of, rng| {
        let [one, other] = [rng.random(), rng.random()].map(|seed| {
            let found = checked(&of, Effort { seed, rounds: 1 });
            found.sir
        });
        close(one, other, 1e-6, &format!("{of:?}"));
    });
}

/// Checks that random moves of any size, of one relay or all, do not improve the optimum.
#[test]
fn no_move_is_better() {
    for_scenarios(52, 30, 40, |of, rng| {
        let found = checked(&of, Effort::usual(1));
        for _ in 0..2000 {
            let size = log_uniform(rng, 1e-8, 0.1) * of.link.distance_m;
            let only = rng.random_range(0..2 * of.link.len());
            let moved = found.places.iter().enumerate().map(|(k, place)| {
                let mut by = || size * rng.random_range(-1.0..=1.0);
                if only < of.link.len() && only != k {
                    return *place;
                }
                let x_m = (place.x_m + by()).clamp(0.0, of.link.distance_m);
                if of.held.iter().any(|hold| hold.relay == k) {
                    return Place { x_m, ..*place };
                }
                Place {
                    x_m,
                    y_m: (place.y_m + by()).clamp(of.corridor.left_m, of.corridor.right_m),
                    altitude_m: (place.altitude_m + by())
                        .clamp(of.corridor.least_m, of.corridor.most_m),
                }
            });
            let moved: Vec<Place> = moved.collect();
            if keeps_rules(&of.link, of.corridor, &of.held, &moved) {
                let sir = sir(&of.link, &moved).unwrap();
                assert!(sir <= found.sir * (1.0 + 1e-8), "{sir}: {found:?}");
            }
        }
    });
}

/// Returns the maximum of `of` over [low, high], by successively finer grids.
fn closing_in(low: f64, high: f64, steps: i32, grids: u32, of: impl Fn(f64) -> f64) -> f64 {
    let (mut from, mut to, mut best) = (low, high, (f64::NEG_INFINITY, low));
    for _ in 0..grids {
        let step = (to - from) / f64::from(steps);
        let tried = (0..=steps).map(|i| (from + f64::from(i) * step).min(high));
        best = tried
            .map(|at| (of(at), at))
            .fold(best, |best, next| if next.0 > best.0 { next } else { best });
        (from, to) = (
            (best.1 - 2.0 * step).max(low),
            (best.1 + 2.0 * step).min(high),
        );
    }
    best.0
}

/// Compares one relay with the best x for every lateral offset and altitude.
#[test]
fn one_relay_agrees_with_brute_force() {
    for_scenarios(53, 30, 1, |mut of, _| {
        of.held.clear();
        let found = checked(&of, Effort { seed: 1, rounds: 1 }).sir;
        let room = of.corridor;
        let best = closing_in(room.least_m, room.most_m, 24, 5, |altitude_m| {
            closing_in(room.left_m, room.right_m, 24, 5, |y_m| {
                closing_in(0.0, of.link.distance_m, 60, 7, |x_m| {
                    let place = Place {
                        x_m,
                        y_m,
                        altitude_m,
                    };
                    sir(&of.link, &[place]).unwrap()
                })
            })
        });
        assert!(found >= best * (1.0 - 1e-9), "{found} {best} {of:?}");
        close(found, best, 1e-5, &format!("{of:?}"));
    });
}

#[test]
fn mirrored_scenarios_have_the_same_optimum() {
    for_scenarios(54, 20, 30, |of, _| {
        let mut mirrored = of.clone();
        mirrored.link.y_i = -of.link.y_i;
        mirrored.corridor.left_m = -of.corridor.right_m;
        mirrored.corridor.right_m = -of.corridor.left_m;
        for hold in &mut mirrored.held {
            hold.y_m = -hold.y_m;
        }
        let [one, other] = [of, mirrored].map(|of| checked(&of, Effort::usual(1)).sir);
        close(one, other, 1e-7, "mirrored");
    });
}

/// Compares relays in the plane at held altitudes with the exact reference.
#[test]
fn held_altitudes_are_the_reference_at_those() {
    for_scenarios(55, 20, 50, |mut of, rng| {
        of.link.min_separation_m = 0.0;
        let draw = |relay| Hold {
            relay,
            y_m: 0.0,
            altitude_m: rng.random_range(of.corridor.least_m..=of.corridor.most_m),
        };
        of.held = (0..of.link.len()).map(draw).collect();
        let altitudes: Vec<f64> = of.held.iter().map(|hold| hold.altitude_m).collect();
        let link = flown(&of.link, &altitudes);
        let found = checked(&of, Effort::usual(1));
        close(found.sir, link.optimum().unwrap(), 1e-9, &format!("{of:?}"));
        let x: Vec<f64> = found.places.iter().map(|place| place.x_m).collect();
        close(found.sir, link.chain_sir(&x), 1e-12, "in the plane");
    });
}

/// Checks that more room, or fewer held altitudes, never harms and often helps.
#[test]
fn more_room_is_no_worse() {
    let mut gained = 0;
    for_scenarios(56, 30, 30, |of, _| {
        let [free, held] =
            [Vec::new(), of.held.clone()].map(|held| Scenario { held, ..of.clone() });
        let effort = Effort { seed: 1, rounds: 1 };
        let free = checked(&free, effort).sir;
        let kept = checked(&held, effort).sir;
        assert!(kept <= free * (1.0 + 1e-8), "{kept} {free}: {of:?}");
        let plane = Corridor::plane(of.corridor.least_m, of.corridor.most_m);
        let plane = optimum(&of.link, plane, &[], effort).unwrap().sir;
        assert!(plane <= free * (1.0 + 1e-8), "{plane} {free}: {of:?}");
        gained += u32::from(free > 1.01 * plane);
    });
    assert!(gained >= 5, "sides helped {gained} times");
}

#[test]
fn a_corridor_without_room_is_refused() {
    let found = |corridor, held: &[Hold]| {
        optimum(
            &Link::paper(3),
            corridor,
            held,
            Effort { seed: 1, rounds: 1 },
        )
    };
    let inside_out = Corridor {
        left_m: 10.0,
        right_m: -10.0,
        ..PAPER_BAND
    };
    assert_eq!(found(inside_out, &[]), None);
    let underground = Hold {
        relay: 1,
        y_m: 0.0,
        altitude_m: 0.0,
    };
    assert_eq!(found(PAPER_BAND, &[underground]), None);
    let outside = Hold {
        relay: 1,
        y_m: 400.0,
        altitude_m: 350.0,
    };
    let places = found(PAPER_BAND, &[outside]).unwrap().places;
    assert_eq!((places[1].y_m, places[1].altitude_m), (400.0, 350.0));
}
