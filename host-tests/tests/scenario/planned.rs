//! Plan in a scenario file.

use uav_relay_scenario::{PlannedMethod, PlannedPlace};

use super::*;

const PLAN: &str = "[plan]\nuavs = 2\nmethod = \"joint\"\ntolerance = 1e-4\nsir_db = 3.5\n\
                    places = [{ x_m = 1, y_m = -2, altitude_m = 30 }, { x_m = 4, y_m = 5, altitude_m = 6.5 }]\n";

#[test]
fn a_plan_is_read() {
    let plan = parse(&small(PLAN)).unwrap().plan.unwrap();
    assert_eq!((plan.uavs, plan.method), (2, PlannedMethod::Joint));
    assert_eq!((plan.tolerance, plan.sir_db), (1e-4, 3.5));
    let second = PlannedPlace {
        x_m: 4.0,
        y_m: 5.0,
        altitude_m: 6.5,
    };
    assert_eq!(plan.places[1], second);
    assert_eq!(parse(&small("")).unwrap().plan, None);
}

#[test]
fn the_default_scenario_is_that_of_its_file() {
    let file = parse(uav_relay_scenario::DEFAULT).unwrap();
    assert_eq!(file, Scenario::default());
}

#[test]
fn errors_of_a_plan_are_named() {
    let wrong = [
        ("uavs = 2", "uavs = 3"),
        ("uavs = 2", "uavs = 0"),
        ("joint", "jont"),
        ("\"joint\"", "3"),
        ("1e-4", "0.2"),
        ("3.5", "401"),
        ("altitude_m = 30", "altitude_m = 0"),
        ("x_m = 4", "x_m = 1e8"),
        ("sir_db = 3.5\n", ""),
    ];
    let files = wrong.map(|(from, to)| small(&PLAN.replace(from, to)));
    insta::assert_snapshot!(refusals(&files));
}
