//! Recorded optima: positions that reach them, values of an independent program, and brute force.
//!
//! The optima are those of a search that is no longer here. These tests show that no recorded value is too high (its positions
//! reach it), and that neither moves nor searches of other kinds find a higher one.

use std::collections::BTreeMap;
use std::iter::successors;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay_oracle::mission::of_link;
use uav_relay_oracle::random::joint::judged::{COUNT, numbered, optima};
use uav_relay_oracle::random::{log_uniform, seed};
use uav_relay_oracle::recorded::{Optimum, Record, all, optimum};
use uav_relay_oracle::reference::joint::{Corridor, FixedCrossSection, Place, keeps_rules, sir};
use uav_relay_oracle::reference::{Link, Relay};

const BAND: Corridor = Corridor::plane(20.0, 300.0);

fn close(got: f64, want: f64, rtol: f64, what: &str) {
    assert!(
        (got - want).abs() <= rtol * want.abs(),
        "{what}: got {got:e}, want {want:e} within {rtol:e}"
    );
}

/// Returns the recorded problems of all sets whose name begins with `set`, with their optima. A problem is left out if the positions of its
/// optimum are not recorded.
fn of(set: &str) -> impl Iterator<Item = (&'static Record, &'static Optimum)> {
    let wanted = move |record: &&Record| record.set.starts_with(set);
    let placed = |record: &'static Record| {
        let best = record.best.as_ref().filter(|best| !best.places.is_empty());
        best.map(|best| (record, best))
    };
    all().unwrap().iter().filter(wanted).filter_map(placed)
}

/// Returns the link with its relays at `altitudes`, m, and without a minimum separation.
fn flown(link: &Link, altitudes: &[f64]) -> Link {
    let relays = link.relays.iter().zip(altitudes);
    let relays = relays.map(|(relay, &altitude_m)| Relay {
        altitude_m,
        ..*relay
    });
    Link {
        min_separation_m: 0.0,
        relays: relays.collect(),
        ..link.clone()
    }
}

/// Returns the paper's link with the interferer at (`x_i`, `y_i`), m, and a separation of 4 m.
fn paper(relays: usize, x_i: f64, y_i: f64) -> Link {
    Link {
        x_i,
        y_i,
        min_separation_m: 4.0,
        ..Link::paper(relays)
    }
}

#[test]
fn the_recorded_places_reach_the_recorded_optimum() {
    let mut count = BTreeMap::new();
    for (record, best) in of("") {
        let scene = &record.scene;
        assert!(
            keeps_rules(&scene.link, scene.corridor, &scene.held, &best.places),
            "{record:?}"
        );
        let reached = sir(&scene.link, &best.places).unwrap();
        close(reached, best.sir, 1e-9, &record.set);
        *count.entry(record.set.as_str()).or_insert(0) += 1;
    }
    println!("{count:?}");
    for (set, least) in [
        ("figures aside", 700),
        ("joint_method crowded", 60),
        ("joint_method own", 200),
        ("joint_method roomy", 100),
        ("model", 395),
        ("multi_interferer polish", 20),
        ("noise space", 195),
        ("numbered", 40),
        ("plan random", 40),
        ("theorems aside", 290),
    ] {
        assert!(count[set] >= least, "{set}: {count:?}");
    }
}

/// Checks that the recorded optima agree with a joint solver and with a general optimiser.
///
/// Both are separate programs. The general optimiser searches all (x, y, h) from 24 starts.
#[test]
fn optima_of_independent_programs_are_recorded() {
    for (n, want) in [
        (2, 0.881_533_886_7),
        (3, 0.937_863_772_385),
        (5, 1.047_463_457_8),
        (8, 1.235_783_782_6),
        (50, 6.498_377_624_4),
    ] {
        let found = optimum(&paper(n, 500.0, 150.0), BAND, &[]).unwrap();
        close(found.unwrap().sir, want, 1e-9, &format!("N = {n}"));
    }
    let aside = |side_m: f64, most_m: f64| Corridor {
        left_m: -side_m,
        right_m: side_m,
        ..Corridor::plane(20.0, most_m)
    };
    for (n, x_i, y_i, corridor, want) in [
        (3, 500.0, 150.0, BAND, 0.9379),
        (8, 500.0, 400.0, BAND, 2.4656),
        (3, 300.0, 50.0, BAND, 1.1226),
        (3, 500.0, 150.0, aside(280.0, 300.0), 1.0732),
        (8, 500.0, 150.0, aside(280.0, 300.0), 1.5430),
        (8, 500.0, 400.0, aside(280.0, 300.0), 2.9831),
        (3, 300.0, 50.0, aside(280.0, 300.0), 1.1761),
        (8, 500.0, 150.0, aside(30.0, 120.0), 1.2689),
        (8, 500.0, 150.0, aside(100.0, 120.0), 1.3790),
        (50, 500.0, 150.0, aside(280.0, 300.0), 9.0026),
    ] {
        for sign in [1.0, -1.0] {
            let found = optimum(&paper(n, x_i, sign * y_i), corridor, &[]).unwrap();
            let what = format!("N = {n}, X = {x_i}, Y = {y_i}, {corridor:?}");
            close(found.unwrap().sir, want, 1e-4, &what);
        }
    }
}

/// Checks that the two recorded optimum SIRs of each of forty scenarios agree. They were found by searches with different random seeds.
///
/// [`optima`] has the SIRs of all 2 000 numbered scenarios, without positions. [`optimum`] has the SIRs of forty of
/// them, with positions.
#[test]
fn the_numbered_optima_are_reproduced() {
    let stored = optima().unwrap();
    assert_eq!(stored.len(), COUNT as usize);
    for number in (17..COUNT).step_by(50) {
        let scene = numbered(number);
        let found = optimum(&scene.link, scene.corridor, &scene.held).unwrap();
        let want = stored[number as usize];
        close(found.unwrap().sir, want, 1e-6, &format!("{number}"));
    }
}

/// Checks that the numbered scenarios are of many kinds, and valid missions.
#[test]
fn the_numbered_scenarios_are_of_many_kinds() {
    let mut seen = [0; 6];
    for number in 0..COUNT {
        let of = numbered(number);
        assert_eq!(of, of.as_relays_know_it());
        assert!(of_link(&of.link, 1e-4).is_some(), "{of:?}");
        let room = of.corridor;
        assert!(room.left_m <= 0.0 && room.right_m >= 0.0 && room.least_m <= room.most_m);
        let sides = u32::from(room.left_m < 0.0) + u32::from(room.right_m > 0.0);
        let kinds = [
            sides == 0,
            sides == 1,
            room.least_m >= room.most_m,
            of.link.min_separation_m > 0.0,
            of.link.len() <= 10,
            of.link.y_i > 0.0,
        ];
        for (seen, kind) in seen.iter_mut().zip(kinds) {
            *seen += u32::from(kind);
        }
    }
    let ranges = [650..780, 280..400, 150..250, 930..1070, 550..700, 930..1070];
    for (seen, range) in seen.iter().zip(ranges) {
        assert!(range.contains(seen), "{seen} in {range:?}");
    }
}

/// Checks that no random move of one or all relays improves a recorded optimum. Scenes are in the plane, with lateral
/// offsets, with fixed altitudes, and in noise.
#[test]
fn no_single_move_improves_an_optimum() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(35));
    let mut legal = 0;
    let scenes = |set, many| of(set).step_by(3).take(many);
    let plane = scenes("joint_method roomy", 30).chain(scenes("joint_method own", 30));
    for (record, best) in plane.chain(of("numbered")).chain(scenes("noise", 20)) {
        let (link, room) = (&record.scene.link, record.scene.corridor);
        for _ in 0..2000 {
            let size = log_uniform(&mut rng, 1e-8, 0.1) * link.distance_m;
            let only = rng.random_range(0..2 * link.len());
            let moved = best.places.iter().enumerate().map(|(k, place)| {
                let mut by = || size * rng.random_range(-1.0..=1.0);
                if only < link.len() && only != k {
                    return *place;
                }
                let x_m = (place.x_m + by()).clamp(0.0, link.distance_m);
                if record.scene.held.iter().any(|hold| hold.relay == k) {
                    return Place { x_m, ..*place };
                }
                Place {
                    x_m,
                    y_m: (place.y_m + by()).clamp(room.left_m, room.right_m),
                    altitude_m: (place.altitude_m + by()).clamp(room.least_m, room.most_m),
                }
            });
            let moved: Vec<Place> = moved.collect();
            if keeps_rules(link, room, &record.scene.held, &moved) {
                let sir = sir(link, &moved).unwrap();
                assert!(sir <= best.sir * (1.0 + 1e-8), "{sir}: {record:?}");
                legal += 1;
            }
        }
    }
    assert!(legal > 50_000, "{legal}");
}

/// Returns the best SIR of a chain whose relays share one altitude, by trying 61 altitudes.
fn best_common(link: &Link, room: Corridor) -> f64 {
    let altitude = |i: i32| room.least_m * (room.most_m / room.least_m).powf(f64::from(i) / 60.0);
    let level = |h: f64| flown(link, &vec![h; link.len()]).optimum();
    (0..=60).map(altitude).filter_map(level).fold(0.0, f64::max)
}

/// Returns the best SIR over all ways to give each relay of a chain one of the altitudes `levels`.
fn best_of_levels(link: &Link, levels: &[f64]) -> f64 {
    let relays = u32::try_from(link.len()).unwrap();
    let assignments = (0..levels.len().pow(relays)).map(|number| {
        let digits = successors(Some(number), |rest| Some(rest / levels.len()));
        let altitudes = digits.map(|rest| levels[rest % levels.len()]);
        altitudes.take(link.len()).collect::<Vec<f64>>()
    });
    assignments
        .filter_map(|altitudes| flown(link, &altitudes).optimum())
        .fold(0.0, f64::max)
}

/// Checks that no common altitude, and no choice among three altitudes, exceeds a recorded optimum. The scenes have
/// no minimum separation.
#[test]
fn no_common_altitude_and_no_assignment_of_levels_is_better() {
    let (mut common, mut levelled, mut gained) = (0, 0, 0);
    let plane = of("model").take(100).chain(of("joint_method roomy"));
    for (record, best) in plane.filter(|(record, _)| record.scene.link.min_separation_m <= 0.0) {
        let (link, room) = (&record.scene.link, record.scene.corridor);
        let of_one = best_common(link, room);
        assert!(best.sir >= of_one * (1.0 - 1e-9), "{of_one}: {record:?}");
        common += 1;
        gained += u32::from(best.sir > 1.01 * of_one);
        if link.len() <= 4 && levelled < 100 {
            let levels = [
                room.least_m,
                (room.least_m * room.most_m).sqrt(),
                room.most_m,
            ];
            let of_levels = best_of_levels(link, &levels);
            assert!(
                best.sir >= of_levels * (1.0 - 1e-9),
                "{of_levels}: {record:?}"
            );
            levelled += 1;
        }
    }
    println!("{common} common altitudes, {levelled} with levels; own altitudes help in {gained}");
    assert!(common >= 40 && levelled >= 40 && gained >= 4);
}

/// Returns the maximum of the function `of` over [low, high], by successively finer grids.
fn closing_in(low: f64, high: f64, steps: i32, grids: u32, of: impl Fn(f64) -> f64) -> f64 {
    if low >= high {
        return of(low);
    }
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

/// Checks that the recorded optimal SIR of a chain with one relay equals the result of a search. The search varies
/// the relay's x, y and altitude.
#[test]
fn one_relay_agrees_with_brute_force() {
    let plane = of("figures aside").step_by(18);
    for (record, best) in of("theorems aside").take(30).chain(plane) {
        let (link, room) = (&record.scene.link, record.scene.corridor);
        let found = closing_in(room.least_m, room.most_m, 24, 5, |altitude_m| {
            closing_in(room.left_m, room.right_m, 24, 5, |y_m| {
                closing_in(0.0, link.distance_m, 60, 7, |x_m| {
                    let place = Place {
                        x_m,
                        y_m,
                        altitude_m,
                    };
                    sir(link, &[place]).unwrap()
                })
            })
        });
        assert!(best.sir >= found * (1.0 - 1e-9), "{found} {record:?}");
        close(best.sir, found, 1e-5, &format!("{record:?}"));
    }
}

#[test]
fn an_unknown_scene_is_an_error_and_rules_are_checked() {
    let error = optimum(&paper(7, 123.0, 4.0), BAND, &[]).unwrap_err();
    assert!(error.to_string().contains("no stored optimum"), "{error}");
    let link = Link {
        min_separation_m: 50.0,
        ..Link::paper(2)
    };
    let places = [200.0, 260.0].map(|x_m| Place::in_plane(x_m, 20.0));
    let held = FixedCrossSection {
        relay: 1,
        y_m: 400.0,
        altitude_m: 350.0,
    };
    let outside = Place {
        x_m: 260.0,
        y_m: 400.0,
        altitude_m: 350.0,
    };
    let swapped = [places[1], places[0]];
    let close = [places[0], Place::in_plane(249.0, 20.0)];
    let low = [places[0], Place::in_plane(260.0, 19.9)];
    for (places, held, keeps) in [
        (places, &[][..], true),
        ([places[0], outside], &[held], true),
        ([places[0], outside], &[], false),
        (places, &[held], false),
        (swapped, &[], false),
        (close, &[], false),
        (low, &[], false),
    ] {
        assert_eq!(keeps_rules(&link, BAND, held, &places), keeps, "{places:?}");
    }
    assert_eq!(sir(&link, &places[..1]), None);
}
