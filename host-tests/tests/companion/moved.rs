//! Drone in the air whose receiver moves: the ground station uploads a mission with another site.

use std::time::Duration;

use crate::flying::Flight;
use crate::medium::{Medium, QUIET};
use crate::peer::{Heard, RX, Site, TX, agreed, agreed_toward, apart_m, distance_m};
use crate::process::{Ended, Relay};
use crate::signed::Files;

/// Site about 200 m beyond the old receiver and to the right, on higher ground.
const MOVED: Site = [47.4095, 8.5535, 440.0];

/// Time shorter than the guard's wait for the drone to stop.
const STANDS: Duration = Duration::from_millis(2_500);

fn text([lat, lon, amsl]: Site) -> String {
    format!("{lat},{lon},{amsl}")
}

#[test]
fn a_drone_stays_where_it_is_and_then_flies_along_the_new_line() {
    for kind in ["arducopter", "px4"] {
        let (before, after) = (agreed(), agreed_toward(MOVED));
        assert!(apart_m(before, after) > 20.0, "it has some way to go");
        let files = Files::new();
        let wire = Medium::new(2, QUIET);
        let own = files.options("key", "epoch");
        let mut options: Vec<&str> = own.iter().map(String::as_str).collect();
        options.extend(["--upstream", wire.tty(1)]);
        let mut flight = Flight::started_with(kind, 380.0, [None; 2], &options);
        flight.takes_off();
        flight.is_engaged();
        flight.arrives(before);
        flight.drone.forget();
        let (tx, rx, moved) = (text(TX), text(RX), text(MOVED));
        let distance = distance_m().to_string();
        let own = files.options("key", "ground");
        let mut ground = vec![
            "--of",
            "1",
            "--yes",
            "--version",
            "1",
            "--end",
            "tx",
            "--tty",
            wire.tty(0),
        ];
        ground.extend(["--site-tx", &tx, "--site-rx", &rx, "--distance", &distance]);
        ground.extend(["--new-site-rx", &moved]);
        ground.extend(own.iter().map(String::as_str));
        let Ended { status, stderr, .. } = Relay::ground(&ground).end();
        assert_eq!((status, &stderr[..]), (Some(0), &[][..]));
        let adopted = flight.relay.line("adopted: flies version 1");
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
            .hears(|heard| Heard::is_target(heard) || kind == "arducopter");
        if kind == "px4" {
            let off = apart_m(last.to(), after);
            assert!(off < 1.0, "{off} m off: {last:?}");
        }
    }
}
