//! Fitted slots (each as long as its hop needs) by the joint method, compared with the planner.
//!
//! `COUNT` and `SEED` in the environment set the number of scenes and the first seed.

mod flown;
mod scenes;
mod several;

use core::task::Poll;
use host_tests::make;

use uav_relay::optimiser::joint::{Seat, Solver};

use uav_relay::{
    Band, Interference, Listen, Method, Mission, MissionConfig, Placement, SetupError, SlotShares,
};
use uav_relay_scenario::scene::Scene;
use uav_relay_tools::plan::path::{Table, Times};
use uav_relay_tools::plan::solved;

use scenes::{Case, number};

/// Returns the position and the slot shares of every relay, as the solver computes them for `mission`.
fn fitted(mission: &Mission, seat_of: impl Fn(u16) -> Seat) -> Vec<(Placement, SlotShares)> {
    let mut solver = Solver::<100, 10>::new(mission).unwrap();
    while solver.step(mission, &seat_of) == Poll::Pending {}
    (1..=mission.relays())
        .map(|index| solver.fitted(mission, &seat_of, index).unwrap())
        .collect()
}

/// Checks that the relays' positions are in order, separated, and within their ranges.
fn check_limits(mission: &Mission, places: &[Placement]) {
    let config = mission.config();
    for at in places {
        assert!((0.0..=config.distance_m).contains(&at.x_m), "{at:?}");
        assert!(config.lateral.nearest(at.y_m).to_bits() == at.y_m.to_bits());
        assert!(config.band.nearest(at.altitude_m).to_bits() == at.altitude_m.to_bits());
    }
    for pair in places.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|at| [at.x_m, at.y_m, at.altitude_m].map(f64::from));
        let apart = (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt();
        let least = f64::from(config.min_separation_m) - 2e-7 * f64::from(config.distance_m);
        assert!(apart >= least && b[0] > a[0], "{pair:?} {apart}");
    }
}

/// Checks that the data rate with relays on the line is close to that of the planner.
///
/// The rate must be at least 0.999 of the planner's rate in 99.5 % of the scenes, and at least 0.98 in all scenes.
#[test]
fn places_on_the_line_carry_what_the_shortest_path_carries() {
    let first = number("SEED", 1);
    let mut shares = Vec::new();
    for seed in first..first + number("COUNT", 60) {
        let case = Case::draw(seed);
        let mission = case.mission();
        let seat_of = case.seats(&mission);
        let found = fitted(&mission, &seat_of);
        let places: Vec<Placement> = found.iter().map(|(at, _)| *at).collect();
        check_limits(&mission, &places);
        let scene = Scene::new(&case.scenario, case.relays).unwrap();
        let times = Times::new(&scene, &case.radio, case.scenario.reverse);
        let table = Table::new(&times);
        let (best, _) = times.refined(table.start(case.relays).unwrap());
        let x: Vec<f64> = places.iter().map(|at| at.x_m.into()).collect();
        let own = times.total(&x);
        // The predicted rate is the true one.
        let predicted = f64::from(found[0].1.bits_per_hz);
        assert!(
            (predicted * own - 1.0).abs() < 1e-4,
            "SEED={seed}: {predicted} {own}"
        );
        if best / own < 0.999 {
            println!(
                "SEED={seed}: {:.5} of {case:?}\n{x:.1?}\n{:.1?}",
                best / own,
                times.refined(table.start(case.relays).unwrap()).1
            );
        }
        shares.push(best / own);
    }
    shares.sort_by(f64::total_cmp);
    let short = shares.iter().filter(|share| **share < 0.999).count();
    println!(
        "{} scenes: worst {:.5}, 1 % {:.6}, median {:.7}, below 0.999: {short}",
        shares.len(),
        shares[0],
        shares[shares.len() / 100],
        shares[shares.len() / 2]
    );
    assert!(short * 200 <= shares.len() && shares[0] >= 0.98);
}

/// Checks that free altitudes and offsets give at least the data rate of the common altitude.
///
/// The rate must also be at least that at the positions of the best SIR.
#[test]
fn free_places_carry_no_less() {
    let first = number("SEED", 1);
    let (mut by_line, mut by_sir) = (Vec::new(), Vec::new());
    for seed in first..first + number("COUNT", 30) {
        let case = Case::draw(seed);
        let line = case.mission();
        let config = MissionConfig {
            band: make::band(20.0, 300.0),
            lateral: if seed % 2 == 0 {
                Band::NONE
            } else {
                make::band(-300.0, 300.0)
            },
            ..*line.config()
        };
        let free = Mission::try_new(config).unwrap();
        let equal = Mission::try_new(MissionConfig {
            fitted_gap: 0.0,
            ..config
        })
        .unwrap();
        let powers = case.seats(&line);
        let seat_of = |index| Seat {
            power_w: powers(index).power_w,
            ..Seat::common(&free)
        };
        let rate_of = |places: &[Placement]| 1.0 / case.time(places);
        let found = fitted(&free, seat_of);
        let places: Vec<Placement> = found.iter().map(|(at, _)| *at).collect();
        check_limits(&free, &places);
        let rate = rate_of(&places);
        let predicted = f64::from(found[0].1.bits_per_hz);
        assert!(
            (predicted / rate - 1.0).abs() < 1e-4,
            "SEED={seed}: {predicted} {rate} {places:?} {case:?}"
        );
        let on_line: Vec<Placement> = fitted(&line, &powers).iter().map(|(at, _)| *at).collect();
        by_line.push(rate / rate_of(&on_line));
        by_sir.push(rate / rate_of(&solved(&equal, seat_of).unwrap()));
        let [by_line, by_sir] = [&by_line, &by_sir].map(|list| list[list.len() - 1]);
        if by_line < 1.0 || by_sir < 1.0 {
            println!(
                "SEED={seed}: {by_line:.6} of the line, {by_sir:.6} of the best SIR, {case:?}"
            );
        }
    }
    let mut lists = [("line", by_line), ("best SIR", by_sir)];
    for (name, list) in &mut lists {
        list.sort_by(f64::total_cmp);
        let [least, median, most] = [0, list.len() / 2, list.len() - 1].map(|at| list[at]);
        println!("rate over that of the {name}: {least:.5} to {most:.1}, median {median:.3}");
    }
    for (name, list) in &lists {
        assert!(list[0] >= 1.0 - 1e-5, "{name}: {}", list[0]);
    }
}

/// Checks that the solver finds positions for as many relays as the minimum separation permits.
#[test]
fn a_full_line_is_placed() {
    for (relays, min_separation_m) in [(50, 4.0), (100, 4.0), (100, 10.0), (100, 10.1), (2, 999.9)]
    {
        let config = MissionConfig {
            relays,
            min_separation_m,
            ..*Case::draw(3).mission().config()
        };
        let mission = Mission::try_new(config).unwrap();
        let found = fitted(&mission, |_| Seat::common(&mission));
        let places: Vec<Placement> = found.iter().map(|(at, _)| *at).collect();
        check_limits(&mission, &places);
        assert!(found[0].1.bits_per_hz > 0.0, "{relays} {min_separation_m}");
    }
}

/// Checks that relays refuse fitted slots without the joint method, or with an unknown interferer.
///
/// They also refuse fitted slots with the setting `listen`.
#[test]
fn fitted_slots_need_the_joint_method() {
    let config = MissionConfig {
        reverse: 0.0,
        ..*Case::draw(1).mission().config()
    };
    let mission = Mission::try_new(config).unwrap();
    let refused_in = |mission: &Mission, method, listen| {
        let settings = uav_relay::Settings {
            method,
            listen,
            ..Default::default()
        };
        flown::relay(mission, settings).err()
    };
    let refused = |method, listen| refused_in(&mission, method, listen);
    assert_eq!(refused(Method::Joint, None), None);
    assert_eq!(refused(Method::Align, None), Some(SetupError::Fitted));
    assert_eq!(
        refused(Method::Joint, Some(Listen::default())),
        Some(SetupError::Fitted)
    );
    let unknown = Mission::try_new(MissionConfig {
        interference: Interference::Unknown,
        fitted_gap: 1.0,
        ..config
    })
    .unwrap();
    assert!(mission.fitted_gap() > 0.0 && unknown.fitted_gap() == 0.0);
    let refused = refused_in(&unknown, Method::Joint, None);
    assert_eq!(refused, Some(SetupError::Fitted));
    let text = SetupError::Fitted.to_string();
    assert!(text.contains("fitted") && text.contains("Joint"), "{text}");
}
