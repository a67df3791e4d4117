//! Drone in the air whose receiver moves: the ground station uploads a mission with another site.

use std::time::Duration;

use crate::files::Files;
use crate::flying::Flight;
use crate::medium::{Medium, QUIET};
use crate::peer::{
    RX, ReceivedMessage, Site, TX, agreed, agreed_toward, apart_m, distance_to_m, text,
};
use crate::process::Relay;

/// New position of the receiver: 100 m farther along the old line, 250 m to its right, and higher.
const MOVED: Site = [47.4095, 8.5535, 440.0];

/// Time for which the drone stands still after the upload.
///
/// The motion guard makes the drone wait for a longer time.
const STANDS: Duration = Duration::from_millis(2_500);

#[test]
fn a_drone_waits_and_then_flies_along_the_new_line() {
    for kind in ["arducopter", "px4"] {
        let (before, after) = (agreed(), agreed_toward(MOVED));
        assert!(apart_m(before, after) > 20.0, "it has some way to go");
        let files = Files::new();
        let wire = Medium::new(2, QUIET);
        let own = format!(
            "{} --upstream {}",
            files.signed("key", "epoch"),
            wire.tty(1)
        );
        let mut flight = Flight::started(kind, [None; 2], &own);
        flight.takes_off();
        flight.is_engaged();
        flight.arrives(before);
        flight.drone.forget();
        let (tty, signed, distance) = (
            wire.tty(0),
            files.signed("key", "ground"),
            distance_to_m(RX),
        );
        let upload = format!("--of 1 --yes --version 1 --end tx --tty {tty} {signed}");
        let sites = format!("--site-tx {} --site-rx {}", text(TX), text(RX));
        let new = format!("--distance {distance} --new-site-rx {}", text(MOVED));
        Relay::ground(&format!("{upload} {sites} {new}")).succeeds();
        let adopted = flight.relay.line("adopted: the chain flies version 1");
        let between = "between 47.4000000,8.5400000,420.000 and 47.4095000,8.5535000,440.000";
        assert!(adopted.ends_with(between), "{adopted}");
        // The drone is within a metre of its goal, and all targets are at one point there.
        let targets = flight.targets_for(STANDS);
        for target in &targets {
            let moved = apart_m(target.to(), targets[0].to());
            let off = apart_m(target.to(), before);
            assert!(moved < 0.05 && off < 1.0, "{moved}, {off}: {target:?}");
        }
        flight.arrives(after);
        flight.drone.forget();
        let last = flight
            .drone
            .receive(|heard| ReceivedMessage::is_target(heard) || kind == "arducopter");
        if kind == "px4" {
            let off = apart_m(last.to(), after);
            assert!(off < 1.0, "{off} m off: {last:?}");
        }
    }
}
