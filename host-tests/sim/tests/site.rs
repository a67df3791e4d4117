//! Scenarios with geographic sites.

use uav_relay::Geodetic;
use uav_relay_scenario::{Line, Problem, Scenario, ScenarioError};

const REST: &str =
    "[power]\ntx_w = 80\nuav_w = 1\n[[interferer]]\npower_w = 80\nx_m = 500\ny_m = 400\n";

fn parse(geometry: &str, site: &str) -> Result<Scenario, ScenarioError> {
    let text = format!("[geometry]\naltitude_m = 20\n{geometry}\n{REST}[site]\n{site}\n");
    Scenario::parse("flight.toml", &text)
}

const SITES: &str = "tx = { lat_deg = 47.40, lon_deg = 8.54, amsl_m = 420.0 }\n\
    rx = { lat_deg = 47.41, lon_deg = 8.55, amsl_m = 431.0 }";

#[test]
fn the_distance_follows_from_the_sites() {
    let scenario = parse("", SITES).unwrap();
    let Line { axis, sites, .. } = scenario.line.unwrap();
    assert_eq!(scenario.distance_m.to_bits(), axis.distance_m().to_bits());
    // Reference value by GeographicLib.
    assert!(
        (scenario.distance_m - 1_343.794_9).abs() < 0.001,
        "{}",
        scenario.distance_m
    );
    let rx = Geodetic::from_degrees(47.41, 8.55, 431.0).unwrap();
    assert_eq!(sites[1], rx);
    assert!((f64::from(axis.place(rx).unwrap().x_m) - scenario.distance_m).abs() < 1e-3);
    assert!(parse("distance_m = 1343.8", SITES).is_ok(), "the same one");
}

#[test]
fn errors_of_sites_are_named() {
    let near = SITES.replace("47.41", "47.40").replace("8.55", "8.54");
    let far = SITES.replace("47.41", "48.41");
    let off = SITES.replace("47.41", "97.41");
    let half = SITES.lines().next().unwrap();
    for (geometry, site, problem, parts) in [
        (
            "distance_m = 1000",
            SITES,
            Problem::OtherDistance,
            ["geometry.distance_m = 1000", "1343.795 m"],
        ),
        (
            "",
            &near,
            Problem::OutOfRange,
            ["0.00 m from tx to rx", "10 to 1e5 m"],
        ),
        (
            "",
            &far,
            Problem::OutOfRange,
            ["m from tx to rx", "10 to 1e5 m"],
        ),
        (
            "",
            &off,
            Problem::OutOfRange,
            ["site.rx.lat_deg = 97.41", "-90 to 90 degrees"],
        ),
        (
            "",
            half,
            Problem::Missing,
            ["site.rx.lat_deg", "-90 to 90 degrees"],
        ),
    ] {
        let error = parse(geometry, site).unwrap_err();
        assert_eq!(error.problem, problem, "{error}");
        for part in parts {
            assert!(error.to_string().contains(part), "no {part:?} in: {error}");
        }
    }
}
