//! Relays that find their interferer: by a FIFO, and by a SiK radio on the autopilot's link.

use std::fmt::Write as _;
use std::time::Duration;

use host_tests::make;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;

use crate::files::{Files, write};
use crate::flying::Flight;
use crate::process::{Relay, bits};

const LISTENING: &str = "--listen --interferer unknown --listen-every 0.5";

/// Checks that a relay finds the interferer from positions and powers that it reads from a FIFO.
#[test]
fn a_relay_locates_the_interferer_by_samples_from_a_fifo() {
    let scene = Scene::new(&Scenario::default(), 1).unwrap();
    let files = Files::new();
    let fifo = files.fifo("positions");
    let mut relay = Relay::start(&format!("--index 1 --of 1 --positions {fifo} {LISTENING}"));
    relay.line("guarded: ");
    let mut lines = String::from("1 2 3 0\nreceiver\nreceiver -1\n");
    for [x_m, y_m, altitude_m] in [
        [100.0, 30.0, 20.0],
        [300.0, -40.0, 30.0],
        [500.0, 50.0, 40.0],
        [700.0, -30.0, 20.0],
        [900.0, 40.0, 50.0],
    ] {
        let at = make::placement(x_m, y_m, altitude_m);
        let power_w = scene.interference_w(at);
        writeln!(lines, "{x_m} {y_m} {altitude_m} {power_w:e}").unwrap();
    }
    let receiver_dbm = 10.0 * scene.interference_rx_w().log10() + 30.0;
    writeln!(lines, "receiver {receiver_dbm} dBm").unwrap();
    write(&fifo, &lines);
    relay.line("position: invalid line \"1 2 3 0\" in --positions is ignored: \"0\" is not a power in W without the unit, within 1e-30 to 1e6, or in dBm with the unit, for example -95 dBm; a valid line is one of `x_m y_m altitude_m [POWER]`, `receiver POWER`, `endurance SECONDS HOME` (remaining time of flight, and time of the way home, both in s); ");
    let believed = relay.line("estimate: interferer ");
    let [power_w, x_m, y_m] = bits(&believed)[..3] else {
        panic!("{believed}");
    };
    let found = [power_w, x_m, y_m].map(f32::from_bits);
    for (found, true_) in found.into_iter().zip([80.0_f32, 500.0, 400.0]) {
        assert!((found / true_ - 1.0).abs() < 0.02, "{believed}");
    }
    assert!(!believed.ends_with("0.000e0 W"), "{believed}");
}

/// Checks that a relay in the air uses the noise measurements of its radio.
///
/// The evidence is the relay's log line that the relays will spread to measure at other positions.
#[test]
fn noise_of_a_radio_on_the_autopilots_link_is_used() {
    let mut flight = Flight::found("arducopter", LISTENING);
    flight.takes_off();
    flight.drone.order("noise 150");
    flight.relay.line(
        "estimate: interference unknown; the relays spread toward the transmitter to measure it",
    );
    assert!(flight.targets_for(Duration::from_millis(100)).is_empty());
}
