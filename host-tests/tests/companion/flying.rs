//! Single relay with a pymavlink drone: a flight with an ArduCopter and one with a PX4.

use std::time::Duration;

use crate::files::Files;
use crate::peer::{Peer, ReceivedMessage, Site, agreed, apart_m, relay};
use crate::process::Relay;

/// Ids and intervals, µs, of the messages that the companion requests: position, landed state, target.
pub(crate) const ASKED: [(u64, u64); 3] = [(33, 200_000), (245, 500_000), (87, 500_000)];

/// Take-off position along the line, m: about 20 m from the setpoint.
const START_M: f64 = 380.0;

/// Time for which a test watches for targets; a companion that streams targets sends several in it.
const MOMENT: Duration = Duration::from_millis(1_500);

/// Simulated drone in flight and the relay that controls it.
pub(crate) struct Flight {
    pub(crate) drone: Peer,
    pub(crate) relay: Relay,
    is_px4: bool,
    _files: Files,
}

impl Flight {
    /// Starts a drone and a relay, and waits until the relay has found the drone on the ground.
    pub(crate) fn found(kind: &str, options: &str) -> Self {
        Self::found_by(kind, None, options)
    }

    /// Starts a drone and a relay, and waits until they are in contact.
    ///
    /// If there is a `key`, the drone and the relay sign their frames with it.
    fn found_by(kind: &str, key: Option<&str>, options: &str) -> Self {
        let mut flight = Self::started(kind, [key; 2], options);
        if key.is_some() {
            flight
                .relay
                .line("autopilot: frames to the autopilot are signed");
        }
        let found = flight.relay.line("autopilot: found a");
        assert!(found.to_lowercase().contains(kind), "{found}");
        flight.relay.line("autopilot: on the ground, or not armed");
        flight
    }

    /// Starts a drone with the key `keys[0]`, and a relay with the key `keys[1]` and more `options`.
    pub(crate) fn started(kind: &str, keys: [Option<&str>; 2], options: &str) -> Self {
        let files = Files::new();
        let link = files.text("tty");
        let [theirs, ours] = [("theirs", keys[0]), ("ours", keys[1])]
            .map(|(name, key)| key.map(|key| files.write_key(name, key)));
        let drone = Peer::autopilot(kind, &link, START_M, theirs.as_deref());
        let ours = ours.map_or_else(String::new, |file| format!("--autopilot-key-file {file}"));
        let mut relay = relay(&link, &format!("{ours} {options}"));
        relay.line("autopilot: opened --autopilot");
        Self {
            drone,
            relay,
            is_px4: kind == "px4",
            _files: files,
        }
    }

    /// Arms the drone and takes off under its pilot's control.
    pub(crate) fn takes_off(&mut self) {
        self.drone.takes_off();
        self.relay
            .line("autopilot: in the air, and not controlled by the relay");
    }

    /// Chooses OFFBOARD or GUIDED as the pilot, and waits for setpoint control. A PX4 accepts the mode only while
    /// targets are streamed.
    pub(crate) fn is_engaged(&mut self) {
        // Before that, the companion has seen no other mode.
        self.relay.line("autopilot: ready");
        if self.is_px4 {
            self.drone.receive(ReceivedMessage::is_target);
        }
        self.drone.order("mode companion");
        self.relay.line("autopilot: setpoint control engaged");
        self.drone
            .receive(|heard| heard.is_text("relay: engaged, flies to position"));
    }

    /// Waits until the drone is within a metre of `place`, under setpoint control.
    pub(crate) fn arrives(&self, place: Site) {
        let is_there =
            |heard: &ReceivedMessage| heard.is_any() && apart_m(heard.own(), place) < 1.0;
        let there = self.drone.receive(is_there);
        assert_eq!(there.mode(), "companion");
    }

    /// Changes the flight mode, as a pilot or a failsafe does. Waits until the relay has released the drone.
    pub(crate) fn is_released_by(&mut self, mode: &str) {
        self.drone.order(&format!("mode {mode}"));
        self.relay
            .line("autopilot: in the air, and not controlled by the relay");
        let text = match mode {
            "pilot" => "relay: released, manual mode",
            _ => "relay: released, returns (RTL)",
        };
        self.drone.receive(|heard| heard.is_text(text));
    }

    pub(crate) fn targets_for(&self, span: Duration) -> Vec<ReceivedMessage> {
        let mut heard = self.drone.receive_for(span);
        heard.retain(ReceivedMessage::is_target);
        heard
    }
}

/// Checks that the companion's heartbeats are those of an onboard computer, not of an autopilot.
fn is_an_onboard_computer(drone: &Peer) {
    let from = serde_json::json!([7, 191]);
    let heard = drone.receive(|heard| heard.is("HEARTBEAT") && heard.0["from"] == from);
    let (kind, autopilot) = (&heard.0["type"], &heard.0["autopilot"]);
    assert_eq!((kind, autopilot), (&18.into(), &8.into()));
}

/// Checks that successive targets lead from the drone to `place` without a jump.
fn lead_to(targets: &[ReceivedMessage], place: Site) {
    let mut before = targets[0].own();
    for target in targets {
        assert_eq!(target.mode(), "companion", "{target:?}");
        let step = apart_m(target.to(), before);
        // Half a second at full speed, in case the machine is busy.
        assert!(step < 2.6, "{step} m at once: {target:?}");
        before = target.to();
    }
    let off = apart_m(before, place);
    assert!(off < 0.05, "{off} m off");
}

/// Starts a drone and a relay, engages setpoint control, and waits for the agreed position.
fn led_to_its_place(kind: &str, key: Option<&str>) -> (Flight, Site) {
    let place = agreed();
    let mut flight = Flight::found_by(kind, key, "");
    // A PX4 is not asked for its target because it does not report it.
    let asked = if kind == "px4" { &ASKED[..2] } else { &ASKED };
    flight.drone.wait_for_requests(asked);
    is_an_onboard_computer(&flight.drone);
    assert!(flight.targets_for(MOMENT).is_empty(), "it is on the ground");
    flight.takes_off();
    flight.drone.forget();
    if kind == "px4" {
        flight.drone.receive(ReceivedMessage::is_target);
    }
    flight.relay.line("autopilot: ready");
    flight.drone.order("mode companion");
    flight.relay.line("autopilot: setpoint control engaged");
    let is_there = |heard: &ReceivedMessage| heard.is_any() && apart_m(heard.own(), place) < 0.5;
    let mut all = flight.drone.receive_until(is_there);
    assert!(
        all.iter()
            .any(|heard| heard.is_text("relay: engaged, flies to position"))
    );
    all.extend(flight.drone.receive_for(2 * MOMENT));
    all.retain(|heard| heard.is_target() && heard.mode() == "companion");
    assert!(all.len() > 50, "{} targets", all.len());
    lead_to(&all, place);
    let moving = all.iter().filter(|target| target.has_velocity());
    assert!(moving.count() > 40, "what moves is said with its velocity");
    assert!(!all.last().unwrap().has_velocity(), "the last one stands");
    let line = flight.relay.line("arrived: ");
    assert!(line.contains(" m from its agreed position: x "), "{line}");
    (flight, place)
}

/// Reboots the autopilot on the ground. The autopilot forgets the companion's message requests, and its clock
/// restarts.
fn is_switched_off_and_on(flight: &mut Flight) {
    flight.drone.order("reboot");
    flight.relay.line("autopilot: on the ground, or not armed");
    flight.relay.line(
        "autopilot: rebooted; setpoint control begins when the pilot chooses OFFBOARD or GUIDED again in the air",
    );
    flight.drone.forget();
    assert!(flight.targets_for(MOMENT).is_empty(), "it is on the ground");
}

/// Silences the autopilot for more than 3 s. Checks that the relay reports the silence and sends no targets.
fn falls_silent(flight: &mut Flight) {
    flight.drone.order("mute");
    flight
        .relay
        .line("autopilot: no heartbeat for 3 s: check that the autopilot is switched on, check its cable, and set its port to MAVLink 2 and to the data rate of this relay");
    assert!(flight.targets_for(MOMENT).is_empty(), "nobody is there");
    flight.drone.order("speak");
}

/// Signing key of both the autopilot and the companion.
const KEY: Option<&str> = Some("c0ffee0123456789abcdef00112233445566778899aabbccddeeff0102030405");

#[test]
fn an_arducopter_is_led_to_its_position_and_released() {
    an_arducopter(None);
}

#[test]
fn a_signing_arducopter_is_led_to_its_position_and_released() {
    an_arducopter(KEY);
}

fn an_arducopter(key: Option<&str>) {
    let (mut flight, place) = led_to_its_place("arducopter", key);
    // The ArduCopter has confirmed its target; repeating it would make the drone wobble.
    assert!(flight.targets_for(MOMENT).is_empty(), "it is there");

    // The pilot takes control.
    flight.is_released_by("pilot");
    flight.drone.order("sticks 4 0");
    assert!(flight.targets_for(2 * MOMENT).is_empty(), "it is released");
    // The pilot gives control back: the drone flies from its position to the agreed one.
    flight.drone.forget();
    flight.is_engaged();
    let back = flight.drone.receive(ReceivedMessage::is_target);
    assert!(apart_m(back.to(), back.own()) < 1.0, "{back:?}");
    assert!(apart_m(back.own(), place) > 5.0, "{back:?}");
    flight.arrives(place);

    // The autopilot's failsafe takes control.
    flight.is_released_by("rtl");
    assert!(flight.targets_for(MOMENT).is_empty(), "it is released");
    flight.is_engaged();
    flight.arrives(place);

    // The cable is loose for seconds: the mode is the same, but no pilot has chosen it since.
    falls_silent(&mut flight);
    flight.relay.line(
        "autopilot: setpoint control cannot be engaged: the autopilot was in OFFBOARD or GUIDED",
    );
    assert!(flight.targets_for(MOMENT).is_empty(), "it was not chosen");
    flight.drone.order("sticks 0 0");
    flight.drone.order("mode pilot");
    flight.is_engaged();
    flight.arrives(place);

    is_switched_off_and_on(&mut flight);
}

/// Checks that the relay reports an ArduCopter that flies to another target than the one sent. The report suggests
/// that the setpoint is outside of the autopilot's fence.
#[test]
fn an_arducopter_that_refuses_targets_is_reported() {
    let mut flight = Flight::found("arducopter", "");
    flight.takes_off();
    flight.drone.order("refuse");
    flight.is_engaged();
    flight.relay.line(
        "autopilot: the autopilot flies to a target other than the setpoint that the relay has sent: check whether the setpoint is outside the autopilot's fence",
    );
}

#[test]
fn a_px4_is_led_to_its_position_and_released() {
    a_px4(None);
}

#[test]
fn a_signing_px4_is_led_to_its_position_and_released() {
    a_px4(KEY);
}

fn a_px4(key: Option<&str>) {
    let (mut flight, place) = led_to_its_place("px4", key);
    // A PX4 needs a continuous stream.
    let there = flight.targets_for(MOMENT);
    assert!(there.len() > 4, "{there:?}");
    assert!(
        there
            .iter()
            .all(|target| apart_m(target.to(), place) < 0.05)
    );

    // The pilot takes control: only the drone's own position is streamed, so that the pilot can give it back.
    flight.is_released_by("pilot");
    flight.drone.order("sticks 4 0");
    let own = flight.targets_for(2 * MOMENT);
    assert!(own.len() > 10, "{own:?}");
    assert!(own.iter().all(ReceivedMessage::is_to_own_place), "{own:?}");
    let flown = apart_m(own[own.len() - 1].own(), place);
    assert!(flown > 8.0, "{flown} m from its place");
    flight.is_engaged();
    flight.arrives(place);

    flight.is_released_by("rtl");
    let own = flight.targets_for(MOMENT);
    assert!(own.iter().all(ReceivedMessage::is_to_own_place), "{own:?}");
    flight.is_engaged();
    flight.arrives(place);

    // The cable is loose: the autopilot holds, and would resume OFFBOARD on its own if targets were streamed.
    falls_silent(&mut flight);
    flight
        .relay
        .line("autopilot: setpoint control cannot be engaged: the autopilot is in a failsafe");
    let heard = flight.drone.receive_for(2 * MOMENT);
    assert!(heard.iter().all(|heard| heard.mode() == "hold"));
    assert!(
        !heard.iter().any(ReceivedMessage::is_target),
        "nobody has asked for it"
    );
    // The pilot takes control with the sticks, and gives it back.
    flight.drone.order("sticks 0 0");
    flight.drone.order("mode pilot");
    flight.drone.receive(ReceivedMessage::is_target);
    flight.is_engaged();
    flight.arrives(place);

    is_switched_off_and_on(&mut flight);
}
