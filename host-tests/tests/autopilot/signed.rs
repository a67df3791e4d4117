//! MAVLink signing: both sides accept only frames with their key, and each mismatch is reported once.

use sha2::{Digest as _, Sha256};
use uav_relay::flight::autopilot::trust::Mistrust;
use uav_relay::flight::autopilot::{Signing, Stamp};
use uav_relay::flight::mavlink::frame::{checksum, find_known};

use super::*;

pub(crate) const OURS: [u8; 32] = [7; 32];
pub(crate) const OTHER: [u8; 32] = [8; 32];

/// Signing time stamp of the year 2026, in MAVLink's unit of 10 µs.
const STAMP: u64 = 37_527_840_000_000;

/// Signing key of the simulated autopilot, with the time stamps of its signatures.
pub(crate) struct Key {
    bytes: [u8; 32],
    /// Signing time stamp at the simulated autopilot's start.
    zero: u64,
    /// Signing time stamp of the last frame sent.
    last: u64,
    heard: u64,
}

impl Key {
    pub(crate) const fn new(bytes: [u8; 32]) -> Self {
        Self {
            bytes,
            zero: STAMP,
            last: 0,
            heard: 0,
        }
    }

    /// Appends a signature as defined by MAVLink.
    pub(crate) fn sign(&mut self, now: Instant, mut frame: Vec<u8>) -> Vec<u8> {
        self.last = (self.zero + now.as_micros() / 10).max(self.last + 1);
        frame.truncate(frame.len() - 2);
        frame[2] = 1;
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        // The link ignores unknown messages.
        let sum = find_known(id).map_or(0, |known| checksum(&frame[1..], known));
        frame.extend(sum.to_le_bytes());
        frame.push(0);
        frame.extend(&self.last.to_le_bytes()[..6]);
        let tag = self.tag(&frame);
        frame.extend(tag);
        frame
    }

    /// Returns true if a frame of the companion has a valid signature by the autopilot's key.
    pub(crate) fn believes(&mut self, frame: &[u8]) -> bool {
        let Some((covered, tag)) = frame.split_last_chunk::<6>().filter(|_| frame[2] == 1) else {
            return false;
        };
        let mut stamp = [0; 8];
        stamp[..6].copy_from_slice(&covered[covered.len() - 6..]);
        let stamp = u64::from_le_bytes(stamp);
        let is_late = stamp <= self.heard || stamp + 6_000_000 < self.last;
        if is_late || self.tag(covered) != *tag {
            return false;
        }
        self.heard = stamp;
        true
    }

    fn tag(&self, covered: &[u8]) -> [u8; 6] {
        let hash = Sha256::new()
            .chain_update(self.bytes)
            .chain_update(covered)
            .finalize();
        core::array::from_fn(|at| hash[at])
    }
}

fn mistrust(vehicle: &Vehicle) -> Vec<Mistrust> {
    let all = vehicle.events.iter();
    all.filter_map(|event| match event {
        AutopilotEvent::Mistrusted(why) => Some(*why),
        _ => None,
    })
    .collect()
}

/// Creates a simulated vehicle that signs with the key `theirs`, and its autopilot link.
///
/// The autopilot link signs with the key `ours`.
pub(crate) fn keyed(kind: Kind, ours: Option<[u8; 32]>, theirs: Option<[u8; 32]>) -> Vehicle {
    let mut vehicle = Vehicle::new(kind);
    vehicle.key = theirs.map(Key::new);
    if let Some(key) = ours {
        // A board without a clock has no time stamp.
        let signing = Signing::new(key, 0, Stamp::UNKNOWN, vehicle.now);
        vehicle.link.sign(signing);
    }
    vehicle
}

#[test]
fn with_a_common_key_the_drone_flies_to_its_position() {
    for kind in [Kind::Px4, Kind::ArduCopter] {
        let mut vehicle = keyed(kind, Some(OURS), Some(OURS));
        vehicle.fly_off();
        vehicle.setpoint = Some(place(150.0));
        vehicle.engage();
        vehicle.run(20_000);
        assert_eq!(vehicle.link.state(), State::Engaged);
        assert!((vehicle.place.x_m - 150.0).abs() < 0.1, "{kind:?}");
        assert!(vehicle.has_text("relay: engaged, flies to position"));
        assert_eq!(mistrust(&vehicle), []);
        assert_eq!(vehicle.link.refused(), 0);
    }
}

#[test]
fn a_wrong_key_is_reported_once_and_prevents_the_flight() {
    use Mistrust::{NoKey, OtherKey, Unsigned};
    for (ours, theirs, why, is_heard) in [
        (None, Some(OURS), NoKey, true),
        (Some(OURS), None, Unsigned, false),
        (Some(OURS), Some(OTHER), OtherKey, false),
    ] {
        let mut vehicle = keyed(Kind::Px4, ours, theirs);
        vehicle.fly_off();
        vehicle.setpoint = Some(place(150.0));
        vehicle.engage();
        vehicle.run(20_000);
        assert_eq!(mistrust(&vehicle), [why]);
        let state = vehicle.link.state();
        assert_eq!(state != State::Silent, is_heard, "{why:?}");
        assert_eq!(vehicle.link.refused() == 0, is_heard, "{why:?}");
        assert!((vehicle.place.x_m - 100.0).abs() < 0.1, "nobody moves it");
    }
}

/// Checks that two successive heartbeats with a wrong signature raise no event.
///
/// Another vehicle or noise may have caused them.
#[test]
fn a_single_frame_with_a_wrong_signature_is_no_event() {
    let mut vehicle = keyed(Kind::Px4, Some(OURS), Some(OURS));
    vehicle.run(3_000);
    for _ in 0..5 {
        let key = vehicle.key.replace(Key::new(OTHER));
        let before = vehicle.link.refused();
        vehicle.heartbeat();
        vehicle.heartbeat();
        assert_eq!(vehicle.link.refused(), before + 2);
        vehicle.key = key;
        vehicle.heartbeat();
        assert_eq!(vehicle.link.refused(), before + 2);
    }
    vehicle.run(1_000);
    assert_eq!(mistrust(&vehicle), []);
    assert_eq!(vehicle.link.state(), State::Grounded);
}

#[test]
fn a_clock_that_goes_back_is_reported_and_ignored() {
    let mut vehicle = keyed(Kind::Px4, Some(OURS), Some(OURS));
    vehicle.fly_off();
    vehicle.setpoint = Some(place(150.0));
    vehicle.engage();
    vehicle.run(20_000);
    assert_eq!(vehicle.link.state(), State::Engaged);
    let key = vehicle.key.as_mut().unwrap();
    (key.zero, key.last) = (0, 0);
    vehicle.run(10_000);
    assert_eq!(mistrust(&vehicle), [Mistrust::Old]);
    assert_eq!(vehicle.link.state(), State::Silent);
}

/// Checks that frames recorded in flight and replayed on the ground do not start setpoint control.
#[test]
fn replayed_frames_are_refused() {
    let mut vehicle = keyed(Kind::ArduCopter, Some(OURS), Some(OURS));
    vehicle.fly_off();
    vehicle.mode = Mode::Companion;
    let mut recorded = Vec::new();
    for _ in 0..3 {
        let mut heartbeat = vec![0xFD, 9, 0, 0, 0, vehicle::SYSTEM, 1, 0, 0, 0];
        heartbeat.extend([4, 0, 0, 0, 2, 3, 129, 4, 3, 0, 0]);
        let (now, key) = (vehicle.now, vehicle.key.as_mut().unwrap());
        recorded.push(key.sign(now, heartbeat));
        vehicle
            .link
            .handle_bytes(now, &recorded[recorded.len() - 1]);
    }
    vehicle.run(3_000);
    assert_eq!(vehicle.link.state(), State::Engaged);
    vehicle.mode = Mode::Position;
    vehicle.run(3_000);
    assert_eq!(vehicle.link.state(), State::Standby);
    for frame in &recorded {
        vehicle.link.handle_bytes(vehicle.now, frame);
        assert_eq!(vehicle.link.state(), State::Standby);
    }
    assert_eq!(vehicle.link.refused(), 3);
}

/// Checks that RADIO_STATUS of a SiK radio is accepted unsigned, because the radio has no key.
#[test]
fn radio_status_needs_no_signature() {
    let mut vehicle = keyed(Kind::Px4, Some(OURS), Some(OURS));
    vehicle.run(2_000);
    let mut frame = vec![0xFD, 9, 0, 0, 0, b'3', b'D', 109, 0, 0];
    frame.extend([1; 9]);
    let sum = checksum(&frame[1..], find_known(109).unwrap());
    frame.extend(sum.to_le_bytes());
    let before = vehicle.link.counters().frames;
    vehicle.link.handle_bytes(vehicle.now, &frame);
    assert_eq!(vehicle.link.counters().frames, before + 1);
    assert_eq!(vehicle.link.refused(), 0);
}
