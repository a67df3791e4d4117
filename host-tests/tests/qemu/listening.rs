//! Emulated drones that find the interferer by their radios, compared with the simulated chain.

use host_tests::firmware::emulator::Life;
use host_tests::make;
use mavlink::dialects::common::MavLandedState;
use uav_relay::flight::autopilot::Kind;
use uav_relay::flight::mavlink::incoming::noise_w;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Interference, Placement, Sample};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_sim::simulator::true_interference::TrueInterference;
use uav_relay_tools::provision::block::Flight;

use crate::fleet::Fleet;
use crate::log::Line;
use crate::vehicle::{Vehicle, apart};

/// Scenario in which the speed of the emulated drones' clocks has no effect on the measurements.
///
/// For this, the first query for measurements comes late, and old measurements do not lose weight.
const LISTENING: &str = "[geometry]\naltitude_m = 30\nmin_separation_m = 4\n[power]\ntx_w = 80\nuav_w = 1\n\
    [site]\ntx = { lat_deg = 47.40, lon_deg = 8.54, amsl_m = 420.0 }\n\
    rx = { lat_deg = 47.41, lon_deg = 8.55, amsl_m = 431.0 }\n\
    [listen]\nevery_s = 60\nhalf_life_s = 1e12\nrelative_error = 0.1\n";

/// Section of a scenario file with the true interferer. The relays do not read this section.
///
/// Only the noise values that the simulated radios report depend on this interferer.
const SOURCE: &str = "[[interferer]]\npower_w = 80\nx_m = 900\ny_m = 350\n";

const RELAYS: u16 = 3;

fn unknown() -> Scenario {
    Scenario::parse("listening.toml", LISTENING).unwrap()
}

fn scene() -> Scene {
    let known = Scenario::parse("source.toml", &format!("{LISTENING}{SOURCE}")).unwrap();
    Scene::new(&known, RELAYS).unwrap()
}

/// Returns the three positions to which a drone's pilot flies it for measurements.
fn places(drone: u16) -> [Placement; 3] {
    let x_m = 336.0 * f32::from(drone);
    [[-60.0, 70.0, 30.0], [20.0, -50.0, 45.0], [90.0, 10.0, 60.0]]
        .map(|[x, y_m, altitude_m]| make::placement(x_m + x, y_m, altitude_m))
}

/// Returns the noise value in a SiK radio's unit that a radio reports at a position.
fn noise(at: Placement) -> u8 {
    let dbm = 10.0 * scene().interference_w(at).log10() + 30.0;
    ((dbm + 127.0) * 1.9).round() as u8
}

/// Runs the simulated chain with the measurements that the radios make at the drones' positions.
fn simulated(flight: &Flight) -> Outcome {
    let axis = unknown().line.unwrap().axis;
    let mut setup = Setup::new(*flight.mission());
    setup.settings.listen = flight.listen();
    let mut true_interference = TrueInterference::of(scene());
    for drone in 1..=RELAYS {
        true_interference.handed.extend(places(drone).map(|place| {
            let at = axis.place(axis.point(place).unwrap()).unwrap();
            let power_w = noise_w(noise(at)).unwrap();
            (drone, Sample::Heard { at, power_w })
        }));
    }
    setup.true_interference = Some(true_interference);
    run(setup).unwrap()
}

fn bits(place: Placement) -> [u32; 3] {
    [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits)
}

fn last_setpoint(lines: &[Line], drone: u16) -> Option<[u32; 3]> {
    let mut lines = lines.iter().rev().filter(|line| line.drone == drone);
    lines.find_map(Line::setpoint)
}

#[test]
fn three_drones_locate_an_interferer_like_the_simulation() {
    let flight = Flight::new(&unknown(), RELAYS, 1e-4, 7).unwrap();
    assert_eq!(
        flight.mission().config().interference,
        Interference::Unknown
    );
    let outcome = simulated(&flight);
    let to: Vec<[u32; 3]> = outcome
        .relays
        .iter()
        .map(|relay| bits(relay.setpoint.unwrap()))
        .collect();
    let told = outcome.snapshots.last().unwrap().believed;
    let InterferenceEstimate::Source { source, .. } = told.estimate else {
        panic!("{told:?}");
    };
    println!("{told:?}");
    assert!((source.x_m - 900.0).hypot(source.y_m - 350.0) < 60.0);
    assert!((0.5..2.0).contains(&(source.power_w / 80.0)));

    let axis = unknown().line.unwrap().axis;
    // Real time is needed: at ten times the speed, three autopilots stepped in turn would send late positions.
    let mut fleet = Fleet::in_real_time(&flight);
    let mut vehicles: Vec<Vehicle> = (1..)
        .zip(fleet.autopilots.drain(..))
        .map(|(drone, socket)| {
            let [first, ..] = places(drone);
            let mut vehicle = Vehicle::new(Kind::ArduCopter, socket, axis, first, Life::Real);
            vehicle.armed = true;
            vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR;
            vehicle
        })
        .collect();

    // The pilots fly the drones, which measure; there is no estimate yet.
    let in_air = "autopilot: in the air, and not controlled by the relay";
    together(&mut fleet, &mut vehicles, "flight by the pilots", |lines| {
        (1..=RELAYS).all(|drone| {
            let mut lines = lines.iter().filter(|line| line.drone == drone);
            lines.any(|line| line.text == in_air)
        })
    });
    for which in 0..places(1).len() {
        for (drone, vehicle) in (1..).zip(&mut vehicles) {
            vehicle.place = places(drone)[which];
            let at = axis.place(axis.point(vehicle.place).unwrap()).unwrap();
            vehicle.send_noise(noise(at));
        }
        let began = vehicles[0].now();
        while vehicles[0].now() < began + 1_000 {
            vehicles.iter_mut().for_each(Vehicle::step);
        }
    }
    fleet.listen();
    let found = |line: &Line| line.text.starts_with("estimate: interferer");
    assert!(!fleet.lines.iter().any(found), "all is heard before");

    // The pilots give control to the relays, and the leader collects the measurements.
    for vehicle in &mut vehicles {
        vehicle.granted = true;
    }
    together(
        &mut fleet,
        &mut vehicles,
        "flight to these places",
        |lines| {
            (1..)
                .zip(&to)
                .all(|(drone, place)| last_setpoint(lines, drone) == Some(*place))
        },
    );
    let expected = [source.power_w, source.x_m, source.y_m].map(f32::to_bits);
    for drone in 1..=RELAYS {
        let believed = fleet.of_drone(drone).filter(|line| found(line)).last();
        let said = believed.unwrap().after("estimate: interferer").unwrap();
        for bits in expected {
            assert!(said.contains(&format!("(0x{bits:08x})")), "{said}");
        }
    }
    // The drones arrive.
    let goals: Vec<Placement> = to
        .iter()
        .map(|place| {
            let [x_m, y_m, altitude_m] = place.map(f32::from_bits);
            make::placement(x_m, y_m, altitude_m)
        })
        .collect();
    for (vehicle, goal) in vehicles.iter_mut().zip(&goals) {
        vehicle.until("arrival", |vehicle| apart(vehicle.place, *goal) < 1.0);
    }
}

/// Runs all vehicles until `done` is true for the log lines.
fn together(
    fleet: &mut Fleet,
    vehicles: &mut [Vehicle],
    what: &str,
    done: impl Fn(&[Line]) -> bool,
) {
    let end = std::time::Instant::now() + crate::fleet::PATIENCE;
    while !done(&fleet.lines) {
        if std::time::Instant::now() > end {
            fleet.give_up(what);
        }
        fleet.listen();
        vehicles.iter_mut().for_each(Vehicle::step);
    }
}
