//! Reference optimiser of the joint problem, compared with known optima, brute force and other seeds.

use std::iter::successors;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay_oracle::random::joint::{ROOMY, Scenario, scenario};
use uav_relay_oracle::random::{self, log_uniform};
use uav_relay_oracle::reference::joint::{
    Corridor, Effort, JointOptimum, Place, keeps_rules, optimum, sir,
};
use uav_relay_oracle::reference::{Link, Station};

mod judged;
mod space;

const PAPER_BAND: Corridor = Corridor::plane(20.0, 300.0);

fn close(got: f64, want: f64, rtol: f64, what: &str) {
    assert!(
        (got - want).abs() <= rtol * want.abs(),
        "{what}: got {got:e}, want {want:e} within {rtol:e}"
    );
}

/// Returns the optimum, after a check of its constraints and its SIR.
fn checked(of: &Scenario, effort: Effort) -> JointOptimum {
    let found = optimum(&of.link, of.corridor, &of.held, effort).unwrap();
    assert!(
        keeps_rules(&of.link, of.corridor, &of.held, &found.places),
        "{of:?}"
    );
    let again = sir(&of.link, &found.places).unwrap();
    assert!(again.total_cmp(&found.sir).is_eq(), "{of:?}");
    found
}

fn flown(link: &Link, altitudes: &[f64]) -> Link {
    let relays = link.relays.iter().zip(altitudes);
    let relays = relays.map(|(relay, &altitude_m)| Station {
        altitude_m,
        ..*relay
    });
    Link {
        relays: relays.collect(),
        ..link.clone()
    }
}

/// Runs `check` on random scenarios, with their random generator.
fn for_scenarios(
    default_seed: u64,
    count: u32,
    most_relays: u32,
    mut check: impl FnMut(Scenario, &mut ChaCha8Rng),
) {
    let mut rng = ChaCha8Rng::seed_from_u64(random::seed(default_seed));
    for _ in 0..count {
        let drawn = scenario(&mut rng, &(1..=most_relays), ROOMY);
        check(drawn, &mut rng);
    }
}

/// Returns the scenario without a separation, which the reference at given altitudes does not support.
fn unseparated(mut of: Scenario) -> Scenario {
    of.link.min_separation_m = 0.0;
    of
}

#[test]
fn known_optima_are_found() {
    let known = [
        (2, 0.881_533_886_7),
        (3, 0.937_863_772_385),
        (5, 1.047_463_457_8),
        (8, 1.235_783_782_6),
        (50, 6.498_377_624_4),
    ];
    for (n, want) in known {
        let paper = Scenario {
            link: Link {
                y_i: 150.0,
                min_separation_m: 4.0,
                ..Link::paper(n)
            },
            corridor: PAPER_BAND,
            held: Vec::new(),
        };
        for seed in 0..3 {
            let found = checked(&paper, Effort { seed, rounds: 1 });
            close(found.sir, want, 1e-9, &format!("N = {n}, seed {seed}"));
        }
    }
}

/// Checks two levels near the axis. The chain that flies as far as possible on each level is worse by a quarter.
#[test]
fn the_best_of_two_levels_is_beaten() {
    let relay = Station {
        altitude_m: 20.0,
        power_w: 1.0,
    };
    let link = Link {
        distance_m: 1000.0,
        min_separation_m: 0.0,
        tx_w: 1.0,
        interferer_w: 1.0,
        x_i: 200.0,
        y_i: 20.0,
        mu_los: 1.0,
        mu_nlos: 1.0,
        eta: 1.0,
        noise_w: 0.0,
        relays: vec![relay; 8],
    };
    let best = best_of_levels(&link, &[20.0, 150.0]);
    close(best, 3.72189, 1e-5, "on two levels");
    let corridor = Corridor::plane(20.0, 150.0);
    let found = checked(
        &Scenario {
            link,
            corridor,
            held: Vec::new(),
        },
        Effort::usual(1),
    );
    close(found.sir, 6.002_149_05, 1e-8, "in the band");
}

/// Returns the best optimum over every assignment of levels to relays.
fn best_of_levels(link: &Link, levels: &[f64]) -> f64 {
    let relays = u32::try_from(link.len()).unwrap();
    let assignments = (0..levels.len().pow(relays)).map(|number| {
        let digits = successors(Some(number), |rest| Some(rest / levels.len()));
        digits
            .take(link.len())
            .filter_map(|rest| levels.get(rest % levels.len()).copied())
            .collect::<Vec<f64>>()
    });
    assignments
        .filter_map(|altitudes| flown(link, &altitudes).optimum())
        .fold(0.0, f64::max)
}

#[test]
fn no_assignment_of_three_levels_is_better() {
    for_scenarios(31, 40, 4, |drawn, _| {
        let of = unseparated(drawn);
        let Corridor {
            least_m, most_m, ..
        } = of.corridor;
        let levels = [least_m, (least_m * most_m).sqrt(), most_m];
        let found = checked(&of, Effort::usual(1)).sir;
        let best = best_of_levels(&of.link, &levels);
        assert!(found >= best * (1.0 - 1e-9), "{found} < {best}: {of:?}");
    });
}

#[test]
fn no_common_altitude_is_better() {
    let mut gained = 0;
    for_scenarios(32, 40, 50, |drawn, _| {
        let of = unseparated(drawn);
        let found = checked(&of, Effort { seed: 1, rounds: 1 }).sir;
        let Corridor {
            least_m, most_m, ..
        } = of.corridor;
        let best = (0..=60)
            .map(|i| least_m * (most_m / least_m).powf(f64::from(i) / 60.0))
            .filter_map(|h| flown(&of.link, &vec![h; of.link.len()]).optimum())
            .fold(0.0, f64::max);
        assert!(found >= best * (1.0 - 1e-9), "{found} < {best}: {of:?}");
        gained += u32::from(found > 1.01 * best);
    });
    assert!(gained >= 4, "altitudes of their own helped {gained} times");
}

/// Compares one relay with a fine grid of altitudes, and a finer one around the best.
#[test]
fn one_relay_agrees_with_brute_force() {
    for_scenarios(33, 40, 1, |of, _| {
        let found = checked(&of, Effort { seed: 1, rounds: 1 }).sir;
        let Corridor {
            least_m, most_m, ..
        } = of.corridor;
        let at = |h: f64| flown(&of.link, &[h]).optimum().unwrap_or(0.0);
        let (mut low, mut high, mut best) = (least_m, most_m, 0.0);
        for _ in 0..4 {
            let stride = (high - low) / 100.0;
            let tried = (0..=100).map(|i| (low + f64::from(i) * stride).min(most_m));
            let top = tried.max_by(|&a, &b| at(a).total_cmp(&at(b))).unwrap();
            best = at(top);
            (low, high) = ((top - stride).max(least_m), (top + stride).min(most_m));
        }
        close(found, best, 1e-7, &format!("{of:?}"));
    });
}

#[test]
fn seeds_agree() {
    for_scenarios(34, 20, 50, |of, rng| {
        let [one, other] = [rng.random(), rng.random()].map(|seed| {
            let found = checked(&of, Effort::usual(seed));
            assert_eq!(found, checked(&of, Effort::usual(seed)), "the same again");
            found.sir
        });
        close(one, other, 1e-6, &format!("{of:?}"));
    });
}

/// Checks that random moves of any size, of one relay or all, do not improve the optimum.
#[test]
fn no_move_is_better() {
    for_scenarios(35, 30, 50, |of, rng| {
        let found = checked(&of, Effort::usual(1));
        for _ in 0..2000 {
            let size = log_uniform(rng, 1e-8, 0.1) * of.link.distance_m;
            let only = rng.random_range(0..2 * of.link.len());
            let moved = found.places.iter().enumerate().map(|(k, place)| {
                let mut by = || size * rng.random_range(-1.0..=1.0);
                if only < of.link.len() && only != k {
                    return *place;
                }
                Place {
                    x_m: (place.x_m + by()).clamp(0.0, of.link.distance_m),
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

#[test]
fn a_band_of_one_altitude_is_the_reference_at_that_altitude() {
    for_scenarios(36, 20, 50, |drawn, _| {
        let mut of = unseparated(drawn);
        of.corridor.most_m = of.corridor.least_m;
        let found = checked(&of, Effort::usual(1)).sir;
        close(found, of.link.optimum().unwrap(), 1e-9, &format!("{of:?}"));
    });
}

#[test]
fn nothing_is_found_where_there_is_nothing() {
    let effort = Effort::usual(1);
    assert_eq!(optimum(&Link::paper(0), PAPER_BAND, &[], effort), None);
    let upside_down = Corridor::plane(300.0, 20.0);
    assert_eq!(optimum(&Link::paper(2), upside_down, &[], effort), None);
    let mut on_rx = Link::paper(2);
    (on_rx.x_i, on_rx.y_i) = (on_rx.distance_m, 0.0);
    assert_eq!(optimum(&on_rx, PAPER_BAND, &[], effort), None);
    let mut crowded = Link::paper(9);
    crowded.min_separation_m = 400.0;
    assert_eq!(optimum(&crowded, PAPER_BAND, &[], effort), None);
}
