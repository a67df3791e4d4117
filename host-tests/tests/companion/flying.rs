//! A chain of one with a drone of pymavlink's: a flight with an ArduCopter, and one with a PX4.

use std::time::Duration;

use tempfile::TempDir;

use crate::peer::{Heard, Peer, Site, agreed, apart_m, on_earth, relay};
use crate::process::Relay;

/// What the companion asks for: position, in the air or not, target; µs.
pub(crate) const ASKED: [(u64, u64); 3] = [(33, 200_000), (245, 500_000), (87, 500_000)];

/// Where the drone takes off, along the line, m: some 20 m from where it is wanted.
const START_M: f64 = 380.0;

/// A moment in which a companion that sends targets sends some.
const MOMENT: Duration = Duration::from_millis(1_500);

/// A drone, its relay, and where that wants it.
pub(crate) struct Flight {
    pub(crate) drone: Peer,
    pub(crate) relay: Relay,
    is_px4: bool,
    _folder: TempDir,
}

impl Flight {
    /// A drone on the ground at `x_m` along the line, and a relay that has found it.
    pub(crate) fn found(kind: &str, x_m: f64) -> Self {
        Self::found_by(kind, x_m, None)
    }

    /// The same, with a relay that has those options, too.
    pub(crate) fn listening(kind: &str, more: &[&str]) -> Self {
        let mut flight = Self::started_with(kind, START_M, [None; 2], more);
        flight.relay.line("autopilot: found a");
        flight.relay.line("autopilot: on the ground, or not armed");
        flight
    }

    /// Of which both sign with that key, where there is one.
    fn found_by(kind: &str, x_m: f64, key: Option<&str>) -> Self {
        let mut flight = Self::started(kind, x_m, [key; 2]);
        if key.is_some() {
            flight.relay.line("autopilot: frames are signed");
        }
        let found = flight.relay.line("autopilot: found a");
        assert!(found.to_lowercase().contains(kind), "{found}");
        flight.relay.line("autopilot: on the ground, or not armed");
        flight
    }

    /// The two, the drone with the first key and the relay with the second.
    pub(crate) fn started(kind: &str, x_m: f64, keys: [Option<&str>; 2]) -> Self {
        Self::started_with(kind, x_m, keys, &[])
    }

    /// The same, whose relay is given `options` more.
    pub(crate) fn started_with(
        kind: &str,
        x_m: f64,
        keys: [Option<&str>; 2],
        options: &[&str],
    ) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let file = |name: &str, key: Option<&str>| {
            let name = path(name);
            key.map(|key| crate::signed::write_key(&name, key))?;
            Some(name)
        };
        let (link, [theirs, ours]) = (path("tty"), keys);
        let (theirs, ours) = (file("theirs", theirs), file("ours", ours));
        let at = on_earth(x_m, 0.0).map(|number| number.to_string());
        let [lat, lon, amsl] = &at;
        let mut arguments = vec![kind, &link, lat, lon, amsl];
        arguments.extend(theirs.as_deref());
        let drone = Peer::start("autopilot.py", &arguments);
        let more = ours.iter().flat_map(|file| ["--autopilot-key-file", file]);
        let more: Vec<&str> = more.chain(options.iter().copied()).collect();
        let mut relay = relay(&link, &more);
        relay.line("autopilot: by --autopilot");
        Self {
            drone,
            relay,
            is_px4: kind == "px4",
            _folder: folder,
        }
    }

    /// Armed, and in the air by its pilot.
    pub(crate) fn takes_off(&mut self) {
        self.drone.order("arm");
        self.drone.order("takeoff");
        self.relay
            .line("autopilot: in the air, not flown by the relay");
    }

    /// The pilot chooses the companion's mode, which a PX4 grants to one that streams.
    pub(crate) fn is_engaged(&mut self) {
        // Before, the companion has seen no other mode.
        self.relay.line("autopilot: ready");
        if self.is_px4 {
            self.drone.hears(Heard::is_target);
        }
        self.drone.order("mode companion");
        self.relay.line("autopilot: flies to the relay's setpoints");
        self.drone
            .hears(|heard| heard.says("relay: flies to its place"));
    }

    /// Waits until the drone is at `place`.
    pub(crate) fn arrives(&self, place: Site) {
        let there = self
            .drone
            .hears(|heard| heard.0["own"].is_object() && apart_m(heard.own(), place) < 1.0);
        assert_eq!(there.mode(), "companion");
    }

    /// The mode changes, by the pilot or by the autopilot itself.
    pub(crate) fn is_released_by(&mut self, mode: &str) {
        self.drone.order(&format!("mode {mode}"));
        self.relay
            .line("autopilot: in the air, not flown by the relay");
        let text = match mode {
            "pilot" => "relay: released to the sticks",
            _ => "relay: released, returns (RTL)",
        };
        self.drone.hears(|heard| heard.says(text));
    }

    pub(crate) fn targets_for(&self, span: Duration) -> Vec<Heard> {
        let mut heard = self.drone.hears_for(span);
        heard.retain(Heard::is_target);
        heard
    }
}

/// Whom it speaks as, once it knows the drone's number: a computer of that drone, and nobody's autopilot.
fn is_an_onboard_computer(drone: &Peer) {
    let from = serde_json::json!([7, 191]);
    let heard = drone.hears(|heard| heard.is("HEARTBEAT") && heard.0["from"] == from);
    let (kind, autopilot) = (&heard.0["type"], &heard.0["autopilot"]);
    assert_eq!((kind, autopilot), (&18.into(), &8.into()));
}

/// They lead from the drone to the place, without a jump.
fn lead_to(targets: &[Heard], place: Site) {
    let mut before = targets[0].own();
    for target in targets {
        assert_eq!(target.mode(), "companion", "{target:?}");
        let step = apart_m(target.to(), before);
        // Half a second of the greatest speed, where the machine is so busy.
        assert!(step < 2.6, "{step} m at once: {target:?}");
        before = target.to();
    }
    let off = apart_m(before, place);
    assert!(off < 0.05, "{off} m off");
}

/// Found, off the ground, engaged and led to its place, where the drone then is.
fn led_to_its_place(kind: &str, key: Option<&str>) -> (Flight, Site) {
    let place = agreed();
    let mut flight = Flight::found_by(kind, START_M, key);
    // A PX4 is not asked for what it flies to: it does not say it.
    let asked = if kind == "px4" { &ASKED[..2] } else { &ASKED };
    flight.drone.is_asked_for(asked);
    is_an_onboard_computer(&flight.drone);
    assert!(flight.targets_for(MOMENT).is_empty(), "it is on the ground");
    flight.takes_off();
    flight.drone.forget();
    if kind == "px4" {
        flight.drone.hears(Heard::is_target);
    }
    flight.relay.line("autopilot: ready");
    flight.drone.order("mode companion");
    flight
        .relay
        .line("autopilot: flies to the relay's setpoints");
    let mut all = flight
        .drone
        .hears_until(|heard| heard.0["own"].is_object() && apart_m(heard.own(), place) < 0.5);
    assert!(
        all.iter()
            .any(|heard| heard.says("relay: flies to its place"))
    );
    all.extend(flight.drone.hears_for(2 * MOMENT));
    all.retain(|heard| heard.is_target() && heard.mode() == "companion");
    assert!(all.len() > 50, "{} targets", all.len());
    lead_to(&all, place);
    let moving = all.iter().filter(|target| target.has_velocity());
    assert!(moving.count() > 40, "what moves is said with its velocity");
    assert!(!all.last().unwrap().has_velocity(), "the last one stands");
    let line = flight.relay.line("arrived: ");
    assert!(line.contains(" m from the agreed position, x "), "{line}");
    (flight, place)
}

/// The autopilot is switched off and on, on the ground: it forgets what it was asked for, and its clock begins anew.
fn is_switched_off_and_on(flight: &mut Flight) {
    flight.drone.order("reboot");
    flight.relay.line("autopilot: on the ground, or not armed");
    flight.relay.line("autopilot: was switched off and on");
    flight.drone.forget();
    assert!(flight.targets_for(MOMENT).is_empty(), "it is on the ground");
}

/// Nothing comes from it for more than 3 s; then it is there again.
fn falls_silent(flight: &mut Flight) {
    flight.drone.order("mute");
    flight
        .relay
        .line("autopilot: silent; look at the cable, the baud rate and MAVLink 2");
    assert!(flight.targets_for(MOMENT).is_empty(), "nobody is there");
    flight.drone.order("speak");
}

/// What both sign with.
const KEY: Option<&str> = Some("c0ffee0123456789abcdef00112233445566778899aabbccddeeff0102030405");

#[test]
fn an_arducopter_is_led_to_its_place_and_let_go() {
    an_arducopter(None);
}

#[test]
fn an_arducopter_that_signs_is_led_to_its_place_and_let_go() {
    an_arducopter(KEY);
}

fn an_arducopter(key: Option<&str>) {
    let (mut flight, place) = led_to_its_place("arducopter", key);
    // It has said that it flies there: to repeat it would make it wobble.
    assert!(flight.targets_for(MOMENT).is_empty(), "it is there");

    // The pilot takes over.
    flight.is_released_by("pilot");
    flight.drone.order("sticks 4 0");
    assert!(flight.targets_for(2 * MOMENT).is_empty(), "it is released");
    // And hands over: from where the drone is, back to the place.
    flight.drone.forget();
    flight.is_engaged();
    let back = flight.drone.hears(Heard::is_target);
    assert!(apart_m(back.to(), back.own()) < 1.0, "{back:?}");
    assert!(apart_m(back.own(), place) > 5.0, "{back:?}");
    flight.arrives(place);

    // Its own failsafe.
    flight.is_released_by("rtl");
    assert!(flight.targets_for(MOMENT).is_empty(), "it is released");
    flight.is_engaged();
    flight.arrives(place);

    // The cable is loose for some seconds. The mode has stayed, but nobody has chosen it since.
    falls_silent(&mut flight);
    flight
        .relay
        .line("autopilot: cannot be engaged: it is in OFFBOARD or GUIDED");
    assert!(flight.targets_for(MOMENT).is_empty(), "it was not chosen");
    flight.drone.order("sticks 0 0");
    flight.drone.order("mode pilot");
    flight.is_engaged();
    flight.arrives(place);

    is_switched_off_and_on(&mut flight);
}

/// A fence: the place is not taken, and the relay says so.
#[test]
fn an_arducopter_that_refuses_is_told_of() {
    let mut flight = Flight::found("arducopter", START_M);
    flight.takes_off();
    flight.drone.order("refuse");
    flight.is_engaged();
    flight
        .relay
        .line("autopilot: does not fly where it is told to; is the place outside its fence?");
}

#[test]
fn a_px4_is_led_to_its_place_and_let_go() {
    a_px4(None);
}

#[test]
fn a_px4_that_signs_is_led_to_its_place_and_let_go() {
    a_px4(KEY);
}

fn a_px4(key: Option<&str>) {
    let (mut flight, place) = led_to_its_place("px4", key);
    // It wants to hear of it all the while.
    let there = flight.targets_for(MOMENT);
    assert!(there.len() > 4, "{there:?}");
    assert!(
        there
            .iter()
            .all(|target| apart_m(target.to(), place) < 0.05)
    );

    // The pilot takes over: no more than its own place, so that the pilot can hand over.
    flight.is_released_by("pilot");
    flight.drone.order("sticks 4 0");
    let own = flight.targets_for(2 * MOMENT);
    assert!(own.len() > 10, "{own:?}");
    assert!(own.iter().all(Heard::is_to_own_place), "{own:?}");
    let flown = apart_m(own[own.len() - 1].own(), place);
    assert!(flown > 8.0, "{flown} m from its place");
    flight.is_engaged();
    flight.arrives(place);

    flight.is_released_by("rtl");
    let own = flight.targets_for(MOMENT);
    assert!(own.iter().all(Heard::is_to_own_place), "{own:?}");
    flight.is_engaged();
    flight.arrives(place);

    // The cable is loose: the autopilot holds by itself, and would go back to the companion by itself if that streamed.
    falls_silent(&mut flight);
    flight
        .relay
        .line("autopilot: cannot be engaged: the autopilot is in a failsafe");
    let heard = flight.drone.hears_for(2 * MOMENT);
    assert!(heard.iter().all(|heard| heard.mode() == "hold"));
    assert!(
        !heard.iter().any(Heard::is_target),
        "nobody has asked for it"
    );
    // The pilot takes it with the sticks, and hands over.
    flight.drone.order("sticks 0 0");
    flight.drone.order("mode pilot");
    flight.drone.hears(Heard::is_target);
    flight.is_engaged();
    flight.arrives(place);

    is_switched_off_and_on(&mut flight);
}
