//! Emulated drones that choose altitudes, and drones in a field, where passes start at relay N.

use std::time::Instant;

use host_tests::make;
use uav_relay::{Adjust, Method};
use uav_relay_scenario::{BetaPoint, Field, Interference, Noise, Scenario};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::block::Flight;

use crate::chain::{BAD_DAY, simulated};
use crate::fleet::{Fleet, Image};

/// Returns a flight of five relays past an interferer at (500, `y_m`) m. Lateral offsets are up to `aside_m`. `held`
/// has the number and the altitude of a relay that keeps this altitude.
fn past(y_m: f64, aside_m: f64, held: Option<(u16, f64)>, method: Method) -> Flight {
    let own = |(index, altitude)| {
        let own = make::relay_override(Some(altitude), None);
        (index, own)
    };
    let scenario = Scenario {
        relays: held.into_iter().map(own).collect(),
        altitude_max_m: 300.0,
        lateral_min_m: -aside_m,
        lateral_max_m: aside_m,
        interference: Interference::Sources(vec![make::source(80.0, 500.0, y_m)]),
        ..Scenario::default()
    };
    Flight::new(&scenario, 5, 1e-4, 7).unwrap().by(method)
}

/// Returns a flight in a field of interference that is strongest at two thirds of the line.
pub(crate) fn field() -> Flight {
    let beta = [
        (0.0, 2.0, 3.0),
        (300.0, 3.0, 2.5),
        (650.0, 6.0, 1.5),
        (1000.0, 2.5, 2.0),
    ];
    let beta = beta.map(|(x_m, alpha, beta)| BetaPoint { x_m, alpha, beta });
    let scenario = Scenario {
        interference: Interference::Field(Field {
            i_max_w: 1e-6,
            beta: beta.to_vec(),
        }),
        ..Scenario::default()
    };
    Flight::new(&scenario, 5, 1e-4, 7).unwrap()
}

/// Returns a flight of the paper's scenario with receiver noise: 20 MHz and a noise figure of 60 dB.
fn noisy(method: Method, most_m: f64) -> Flight {
    let scenario = Scenario {
        altitude_max_m: most_m,
        noise: Noise {
            bandwidth_hz: 20e6,
            figure_db: 60.0,
            ..Noise::default()
        },
        ..Scenario::default()
    };
    Flight::new(&scenario, 5, 1e-4, 7).unwrap().by(method)
}

/// Checks that emulated drones and the simulation agree on bit-identical positions with receiver noise.
#[test]
fn five_drones_in_noise_settle_like_the_simulation() {
    let silent = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    let flight = noisy(Method::Align, 20.0);
    assert_ne!(simulated(&flight), simulated(&silent));
    settles(&flight);
    settles(&noisy(Method::Joint, 300.0));
}

/// Checks that emulated drones agree on the simulated chain's positions, with and without faults.
fn settles(flight: &Flight) {
    let expected = simulated(flight);
    for (faults, seed) in [(Faults::default(), 1), (BAD_DAY, 2)] {
        let begun = Instant::now();
        let mut fleet = Fleet::of(Image::Wires, flight, faults, seed);
        fleet.settle_at(&expected);
        println!(
            "{:?} {faults:?}: {:?}, {:?}",
            flight.method(),
            begun.elapsed(),
            fleet.injected()
        );
        for drone in 1..=5 {
            let counters = fleet.counters(drone);
            assert_eq!(counters.counter("misaddressed"), Some(0), "{counters:?}");
            assert_eq!(counters.counter("mission"), Some(0), "{counters:?}");
        }
        assert_eq!(fleet.places(), expected, "{faults:?}");
    }
}

#[test]
fn five_drones_choose_the_simulations_altitudes() {
    let flight = past(50.0, 0.0, None, Method::Joint);
    let low = 20.0_f32.to_bits();
    let places = simulated(&flight);
    assert!(places.iter().all(|[.., altitude]| *altitude != low));
    settles(&flight);
    // One relay has a fixed altitude.
    let flight = past(50.0, 0.0, Some((4, 200.0)), Method::Joint);
    let held = simulated(&flight);
    assert_eq!(held[3][2], 200.0_f32.to_bits());
    assert_ne!(held, places);
    settles(&flight);
}

/// Checks that drones that may have lateral offsets move to the side away from the interferer.
#[test]
fn five_drones_go_to_the_side_like_the_simulation() {
    let flight = past(150.0, 280.0, None, Method::Joint);
    let places = simulated(&flight);
    assert!(places.iter().all(|[_, y, _]| f32::from_bits(*y) < -1.0));
    settles(&flight);
}

/// Checks that a relay that keeps a fixed altitude moves to the side with the others.
#[test]
fn five_drones_go_to_the_side_around_a_fixed_altitude() {
    let flight = past(150.0, 280.0, Some((3, 100.0)), Method::Joint);
    let places = simulated(&flight);
    let metres = |[_, y, altitude]: [u32; 3]| (f32::from_bits(y), f32::from_bits(altitude));
    for (relay, (y_m, altitude_m)) in (1..).zip(places.iter().copied().map(metres)) {
        assert!(y_m < -1.0, "relay {relay}: y = {y_m}");
        assert_eq!(
            altitude_m == 100.0,
            relay == 3,
            "relay {relay}: {altitude_m}"
        );
    }
    assert_ne!(places, simulated(&past(150.0, 280.0, None, Method::Joint)));
    settles(&flight);
}

#[test]
fn five_drones_adjust_like_the_simulation() {
    settles(&past(
        50.0,
        0.0,
        Some((2, 35.0)),
        Method::Adjust(Adjust {
            rounds: 3,
            ..Adjust::default()
        }),
    ));
}

#[test]
fn five_drones_in_a_field_settle_like_the_simulation() {
    settles(&field());
}
