//! MAVSDK as the autopilot, over UDP: its own server of telemetry, modes and requests.

use crate::datagrams::Ports;
use crate::flying::ASKED;
use crate::peer::{Peer, ReceivedMessage, agreed, apart_m, on_earth, relay};

#[test]
fn mavsdk_is_led_to_its_position_and_released() {
    let place = agreed();
    let port = Ports::apart(1_000).port;
    let address = format!("udpin://127.0.0.1:{port}");
    let at = on_earth(370.0, 15.0).map(|number| number.to_string());
    let [lat, lon, amsl] = &at;
    let mut drone = Peer::start("mavsdk_autopilot.py", &[&address, lat, lon, amsl]);
    let mut relay = relay(&format!("udp:127.0.0.1:{port}"), "");
    let heartbeat = drone.receive(|heard| heard.is("HEARTBEAT"));
    assert_eq!(heartbeat.0["type"], 18);
    assert!(!relay.has_printed("autopilot: found"), "a generic one");
    drone.order("px4");
    relay.line("autopilot: found a PX4");
    relay.line("autopilot: on the ground, or not armed");
    drone.wait_for_requests(&ASKED[..2]);
    drone.order("arm");
    drone.order("air");
    // MAVSDK sends no `system_status`; a PX4 sends ACTIVE.
    drone.order("active");
    relay.line("autopilot: in the air, and not controlled by the relay");
    let own = drone.receive(ReceivedMessage::is_target);
    let off = apart_m(own.to(), on_earth(370.0, 15.0));
    assert!(off < 0.1, "{off} m off its own place");
    drone.order("mode offboard");
    relay.line("autopilot: setpoint control engaged");
    // A guarded relay has no setpoint before it is engaged.
    relay.line("setpoint: ");
    drone.receive(|heard| heard.is_text("relay: engaged, flies to position"));
    let there = drone.receive(|heard| heard.is_target() && apart_m(heard.to(), place) < 0.05);
    assert_eq!(there.0["from"], serde_json::json!([1, 191]));
    drone.order("mode hold");
    relay.line("autopilot: in the air, and not controlled by the relay");
    drone.receive(|heard| heard.is_text("relay: released, holds position"));
    relay.stopped();
}
