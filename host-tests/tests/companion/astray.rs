//! Reports of a drone far from its line, for example with latitude and longitude of the sites swapped.

use std::time::Duration;

use crate::files::{Files, status_of, until};
use crate::flying::Flight;
use crate::peer::{Peer, RX, ReceivedMessage, Site, TX, apart_m, between_m, on_earth, text};
use crate::process::Relay;

/// Cause that the companion suggests in its log line about a drone far from the line Tx-Rx.
const SWAPPED: &str = "are latitude and longitude swapped?";

/// Test scene: a drone, and its relay. The positions of Tx and Rx in the relay's settings are far from the drone.
struct Apart {
    drone: Peer,
    relay: Relay,
    files: Files,
}

impl Apart {
    fn start(kind: &str, tx: Site, rx: Site) -> Self {
        let files = Files::new();
        let (link, socket) = (files.text("tty"), files.text("status"));
        let drone = Peer::autopilot(kind, &link, 380.0, None);
        let distance = between_m(tx, rx);
        let sites = format!("--site-tx {} --site-rx {}", text(tx), text(rx));
        let own = format!("--distance {distance} --autopilot {link} --status-socket {socket}");
        let relay = Relay::start(&format!("--index 1 --of 1 {sites} {own}"));
        Self {
            drone,
            relay,
            files,
        }
    }

    fn position(&self) -> serde_json::Value {
        status_of(self.files.path("status"))["autopilot"]["position"].clone()
    }
}

const fn swapped([lat, lon, amsl]: Site) -> Site {
    [lon, lat, amsl]
}

fn is_off_a_swapped_line(kind: &str) {
    let mut apart = Apart::start(kind, swapped(TX), swapped(RX));
    let line = apart.relay.line(SWAPPED);
    let drone = on_earth(380.0, 0.0);
    let ends =
        [TX, RX].map(|end| apart_m([drone[0], drone[1], 0.0], with_height(swapped(end), 0.0)));
    let away_m = ends[0].min(ends[1]);
    let km = (away_m / 1e3).round() as u32;
    let said = format!(
        "autopilot: the drone is {} {:03} km from the line between transmitter and receiver: {SWAPPED}",
        km / 1_000,
        km % 1_000
    );
    // The library's distance is within 0.2 %.
    let digits = |text: &str| -> f64 {
        let words = text.split("the drone is ").nth(1).unwrap();
        let words = words.split(" km").next().unwrap();
        words.replace(' ', "").parse().unwrap()
    };
    let off = digits(&line) / digits(&said) - 1.0;
    assert!(off.abs() < 2e-3, "{line}, and not {said}");
    assert!(line.ends_with(said.split(" km").nth(1).unwrap()), "{line}");
    let operator = |heard: &ReceivedMessage| {
        let text = heard.0["text"].as_str().unwrap_or_default();
        text.starts_with("relay: drone is ") && text.ends_with(" km off the line Tx-Rx")
    };
    apart.drone.receive(operator);
    let position = apart.position();
    assert_eq!(position["outside"], "line", "{position}");
    assert_eq!(position["sites_look_swapped"], true, "{position}");
    let from_m = position["from_line_m"].as_f64().unwrap();
    assert!((from_m / away_m - 1.0).abs() < 2e-3, "{position}");

    // On the ground the event is raised once.
    std::thread::sleep(Duration::from_secs(12));
    assert!(apart.relay.lines_with(SWAPPED).is_empty(), "it was told");
    // In the air the event repeats every ten seconds, and the operator receives it too.
    apart.drone.takes_off();
    apart.relay.line("autopilot: in the air");
    apart.relay.line(SWAPPED);
    apart.drone.forget();
    std::thread::sleep(Duration::from_secs(25));
    let again = apart.relay.lines_with(SWAPPED);
    assert!((1..=3).contains(&again.len()), "{again:?}");
    let texts = apart.drone.so_far().into_iter().filter(operator).count();
    assert!((1..=3).contains(&texts), "{texts} texts");
    // The drone cannot be engaged: the relay has no position, and no targets are streamed.
    // The log gives the reason, and never reports the drone as ready.
    let reason = "autopilot: setpoint control cannot be engaged: the drone's position is unknown, or not near the line between transmitter and receiver: wait for a position, or fly the drone nearer to the line";
    apart.relay.wait_for(reason);
    apart.drone.order("mode companion");
    let heard = apart.drone.receive_for(Duration::from_secs(3));
    assert!(!heard.iter().any(ReceivedMessage::is_target), "{heard:?}");
    for never in ["setpoint control engaged", "autopilot: ready"] {
        assert!(!apart.relay.has_printed(never), "{never}");
    }
}

const fn with_height([lat, lon, _]: Site, amsl: f64) -> Site {
    [lat, lon, amsl]
}

#[test]
fn a_px4_far_from_a_swapped_line_is_reported() {
    is_off_a_swapped_line("px4");
}

#[test]
fn an_arducopter_far_from_a_swapped_line_is_reported() {
    is_off_a_swapped_line("arducopter");
}

/// Checks that a report of a drone far from the line Tx-Rx need not suggest swapped coordinates.
///
/// Here Tx and Rx are configured 0.1 degrees too far south, so the report must not suggest a swap.
#[test]
fn a_drone_far_from_its_line_is_reported_without_a_guess() {
    let moved = |[lat, lon, amsl]: Site| [lat - 0.1, lon, amsl];
    let mut apart = Apart::start("px4", moved(TX), moved(RX));
    let line = apart
        .relay
        .line("from the line between transmitter and receiver");
    let [rx, drone] = [moved(RX), on_earth(380.0, 0.0)];
    let away_m = apart_m(with_height(rx, 0.0), with_height(drone, 0.0));
    let said = format!("the drone is {:.0} km from", away_m / 1e3);
    assert!(line.contains(&said), "{said} is not in {line}");
    assert!(
        line.contains("check the mission's sites (positions of Tx and Rx)"),
        "{line}"
    );
    assert_eq!(apart.position()["sites_look_swapped"], false);
}

/// Checks that a flying drone outside its geofence is reported, even near the line from Tx to Rx.
#[test]
fn a_drone_outside_the_geofence_is_reported_in_the_air() {
    // 380 m along a line that starts 500 m farther on.
    let shifted = |site: Site| {
        let [lat, lon, amsl] = on_earth(500.0, 0.0);
        [
            site[0] + lat - TX[0],
            site[1] + lon - TX[1],
            site[2] + amsl - TX[2],
        ]
    };
    let mut apart = Apart::start("arducopter", shifted(TX), shifted(RX));
    apart.relay.line("autopilot: on the ground");
    let status = apart.files.path("status");
    let said = until(&status, |said| {
        said["autopilot"]["position"]["outside"] == "geofence"
    });
    let from_m = said["autopilot"]["position"]["from_line_m"]
        .as_f64()
        .unwrap();
    assert!((from_m - 120.0).abs() < 1.0, "{from_m}");
    assert!(!apart.relay.has_printed("geofence"), "it is on the ground");
    apart.drone.takes_off();
    let line = apart.relay.line("geofence");
    assert!(
        line.ends_with("the drone is 120 m from the line between transmitter and receiver, 120 m outside the mission's geofence"),
        "{line}"
    );
    std::thread::sleep(Duration::from_secs(8));
    assert!(apart.relay.lines_with("geofence").is_empty(), "10 s");
    apart.relay.line("geofence");
}

#[test]
fn a_drone_at_its_line_is_not_reported() {
    let mut flight = Flight::found("arducopter", "");
    flight.takes_off();
    flight.is_engaged();
    std::thread::sleep(Duration::from_secs(3));
    assert!(!flight.relay.has_printed("from the line between"));
}
