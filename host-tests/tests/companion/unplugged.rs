//! Autopilot whose port vanishes in flight and returns under the same name.

use std::time::Duration;

use crate::flying::{ASKED, Flight};
use crate::peer::{ReceivedMessage, agreed};

#[test]
fn a_port_that_vanishes_is_opened_again() {
    let place = agreed();
    let mut flight = Flight::found("arducopter", "");
    flight.takes_off();
    flight.is_engaged();
    flight.drone.receive(ReceivedMessage::is_target);
    for _ in 0..2 {
        let (_, sleeps) = flight.relay.cost();
        flight.drone.order("unplug");
        let line = flight.relay.line(
            "the device was disconnected; check the cable of the device: the program opens the port again as soon as the device is back",
        );
        assert!(line.contains("port lost: --autopilot /"), "{line}");
        flight.relay.line("autopilot: no heartbeat");
        std::thread::sleep(Duration::from_millis(1_500));
        let (_, after) = flight.relay.cost();
        assert!(after - sleeps < 500, "{} wake-ups", after - sleeps);
        assert!(
            flight.relay.lines_with("is open again").is_empty(),
            "it is not"
        );
        flight.drone.order("plug");
        flight.relay.line("is open again");
        // The autopilot is still in GUIDED, and its pilot has to choose that mode again.
        flight
            .relay
            .line("autopilot: setpoint control cannot be engaged");
        flight.drone.order("mode pilot");
        flight.is_engaged();
        flight.drone.receive(ReceivedMessage::is_target);
    }
    flight.arrives(place);
    let gone = flight.relay.lines_with("the device was disconnected");
    assert!(gone.is_empty(), "once each: {gone:?}");

    // Messages are requested again from an autopilot that was switched off with its port.
    flight.drone.order("unplug");
    flight
        .relay
        .line("the device was disconnected; check the cable of the device: the program opens the port again as soon as the device is back");
    flight.drone.order("reboot");
    flight.drone.forget();
    flight.drone.order("plug");
    flight.relay.line("is open again");
    flight.drone.wait_for_requests(&ASKED);
}
