//! Chains of emulated drones with a wire to each neighbour, compared with the simulated chain.

use uav_relay::Method;
use uav_relay_scenario::Scenario;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_tools::provision::block::Flight;

use crate::fleet::{Fleet, Image};

/// Random faults of the frames between drones: loss, corruption, duplication and reordering.
pub(crate) const BAD_DAY: Faults = Faults {
    loss: 0.3,
    corrupt: 0.15,
    duplicate: 0.1,
    reorder: 0.1,
};

pub(crate) fn paper(uavs: u16) -> Flight {
    Flight::new(&Scenario::default(), uavs, 1e-4, 7).unwrap()
}

/// Returns the f32 bits of the positions on which the simulated chain agrees.
pub(crate) fn simulated(flight: &Flight) -> Vec<[u32; 3]> {
    let mut setup = Setup::new(*flight.mission());
    setup.profiles = flight.profiles().to_vec();
    setup.held = flight.held().to_vec();
    setup.settings.method = flight.method();
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    outcome
        .relays
        .iter()
        .map(|relay| {
            let place = relay.setpoint.unwrap();
            [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits)
        })
        .collect()
}

/// Maximum number of flights until a flight has no damaged frame.
///
/// The emulator is not real time, so on a busy host it loses a byte now and then. A fault of the port driver would
/// show in every flight.
const FLIGHTS: usize = 3;

#[test]
fn five_drones_settle_like_the_simulation() {
    let flight = paper(5);
    let mut damaged = Vec::new();
    for _ in 0..FLIGHTS {
        let mut fleet = Fleet::of(Image::Wires, &flight, Faults::default(), 1);
        assert_eq!(fleet.places(), simulated(&flight));
        let before = damaged.len();
        for drone in 1..=5 {
            // The emulator has no clock tree: the firmware keeps running on the HSI.
            let begins = [
                "started, cause of the reset: unknown",
                "clock 16 MHz, from the internal oscillator: the PLL did not start; do not fly, baud rates may be wrong by 8 %",
            ];
            let begins = begins.map(str::to_owned).into_iter();
            let begins = begins.chain([format!("relay {drone} of 5, network 7")]);
            let said = fleet.of_drone(drone).map(|line| line.text.clone());
            assert!(said.take(3).eq(begins));
            let counters = fleet.counters(drone);
            for name in ["malformed", "misaddressed"] {
                assert_eq!(counters.counter(name), Some(0), "{}", counters.text);
            }
            let lost = ["crc", "truncated"].map(|name| counters.counter(name));
            if lost != [Some(0); 2] {
                fleet.wait("counters of both links", |lines| {
                    let mine = lines.iter().filter(|line| line.drone == drone);
                    mine.filter(|line| line.text.starts_with("link ")).count() == 2
                });
                damaged.extend(fleet.of_drone(drone).cloned());
            }
        }
        if damaged.len() == before {
            return;
        }
    }
    panic!("damaged frames in each of {FLIGHTS} flights: {damaged:#?}");
}

#[test]
fn five_drones_settle_like_the_simulation_with_faults() {
    let flight = paper(5);
    let expected = simulated(&flight);
    for seed in 1..=3 {
        let mut fleet = Fleet::of(Image::Wires, &flight, BAD_DAY, seed);
        assert_eq!(fleet.places(), expected, "seed {seed}");
        let injected = fleet.injected();
        let damaged: u64 = (1..=5)
            .map(|drone| {
                let counters = fleet.counters(drone);
                let of = |name| counters.counter(name).unwrap();
                of("crc") + of("truncated") + of("oversized")
            })
            .sum();
        println!("seed {seed}: {injected:?}, {damaged} damaged frames refused");
        assert!(injected.lost > 0 && injected.corrupted > 0, "{injected:?}");
        assert!(damaged > 0, "no drone has met a damaged frame");
    }
}

/// Checks that drones with the smallest image agree on the simulated chain's positions. This image has no feature but
/// the log.
#[test]
fn five_of_the_smallest_image_settle_like_the_simulation() {
    let flight = paper(5);
    for faults in [Faults::default(), BAD_DAY] {
        let mut fleet = Fleet::of(Image::Smallest, &flight, faults, 1);
        assert_eq!(fleet.places(), simulated(&flight));
        for drone in 1..=5 {
            let counters = fleet.counters(drone);
            for name in ["malformed", "misaddressed"] {
                assert_eq!(counters.counter(name), Some(0), "{}", counters.text);
            }
        }
    }
}

/// Checks that drones with the runner of `uav_relay::asynch` agree on the simulated chain's positions.
#[test]
fn five_on_async_ports_settle_like_the_simulation() {
    let flight = paper(5);
    let expected = simulated(&flight);
    for faults in [Faults::default(), BAD_DAY] {
        let mut fleet = Fleet::of(Image::Asynchronous, &flight, faults, 1);
        assert_eq!(fleet.places(), expected, "{faults:?}");
        for drone in 1..=5 {
            let counters = fleet.counters(drone);
            for name in ["malformed", "misaddressed"] {
                assert_eq!(counters.counter(name), Some(0), "{}", counters.text);
            }
        }
    }
}

/// Checks that an image without the configured method refuses the configuration and has no setpoint.
#[test]
fn the_smallest_image_refuses_unsupported_methods() {
    let flight = paper(2).by(Method::Joint);
    let mut fleet = Fleet::of(Image::Smallest, &flight, Faults::default(), 1);
    fleet.wait("refusals", |lines| {
        [1, 2].iter().all(|drone| {
            let mut lines = lines.iter().filter(|line| line.drone == *drone);
            lines.any(|line| {
                line.text == "configuration refused: not supported by this image: the method cannot be used: a mission with an interference field needs Align; Joint needs the cargo feature `altitude` and at most 100 relays; Adjust needs the cargo feature `adjust`"
            })
        })
    });
    assert!(fleet.lines.iter().all(|line| line.setpoint().is_none()));
}

#[test]
#[ignore = "on demand: a chain of 20"]
fn twenty_drones_settle_like_the_simulation() {
    let flight = paper(20);
    let mut fleet = Fleet::of(Image::Wires, &flight, Faults::default(), 1);
    assert_eq!(fleet.places(), simulated(&flight));
    drop(fleet);
    let mut fleet = Fleet::of(Image::Wires, &flight, BAD_DAY, 1);
    assert_eq!(fleet.places(), simulated(&flight));
}
