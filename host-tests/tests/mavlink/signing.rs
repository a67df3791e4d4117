//! Signatures compared with pymavlink in both directions, and refused frames.

use host_tests::python;
use sha2::{Digest as _, Sha256};
use uav_relay::Instant;
use uav_relay::flight::autopilot::{Flaw, Signing, Stamp};
use uav_relay::flight::mavlink::frame::{checksum, find_known};
use uav_relay::flight::mavlink::outgoing::Outgoing;

use super::ours::framed;
use super::theirs::written;
use super::*;

const KEY: [u8; 32] = [0x5A; 32];
const OTHER: [u8; 32] = [0xA5; 32];

/// Time of the tests: 2026-11-22 12:00 UTC, as Unix seconds.
const UNIX_S: u64 = 1_795_348_800;
/// Time of the tests in MAVLink's unit: 10 µs since 2015-01-01.
const STAMP: u64 = (UNIX_S - 1_420_070_400) * 100_000;

/// Number of MAVLink time stamp units of 10 µs in a minute.
const MINUTE: u64 = 6_000_000;

fn at(units: u64) -> Instant {
    Instant::from_micros(units * 10)
}

/// Returns a signer that knows the time, with `key`.
fn signing(key: [u8; 32]) -> Signing {
    Signing::new(key, 2, Stamp::of_unix_micros(UNIX_S * 1_000_000), at(0))
}

fn stamp_of(frame: &[u8]) -> u64 {
    let mut bytes = [0; 8];
    bytes[..6].copy_from_slice(&frame[frame.len() - 12..frame.len() - 6]);
    u64::from_le_bytes(bytes)
}

/// Returns a heartbeat frame signed with `key`, by code that is independent of the crate.
fn signed(key: [u8; 32], from: Address, link: u8, stamp: u64) -> Vec<u8> {
    let mut frame = Outgoing::Heartbeat.encode(from, from, 0).to_vec();
    frame.truncate(frame.len() - 2);
    frame[2] = 1;
    let sum = checksum(&frame[1..], find_known(0).unwrap());
    frame.extend(sum.to_le_bytes());
    frame.push(link);
    frame.extend(&stamp.to_le_bytes()[..6]);
    let hash = Sha256::new().chain_update(key).chain_update(&frame);
    frame.extend(&hash.finalize()[..6]);
    frame
}

/// Returns the signer's result for the only frame in `bytes`: accepted, or the flaw of the frame.
fn checked(signing: &mut Signing, now: Instant, bytes: &[u8]) -> Result<(), Flaw> {
    let mut parser = Parser::new();
    let mut all = Vec::new();
    for byte in bytes {
        parser.push(*byte);
        all.extend(parser.next_frame(|read, frame| {
            assert_eq!(frame, bytes);
            signing.check(now, &read, frame)
        }));
    }
    assert_eq!(all.len(), 1, "{bytes:02x?}");
    all[0]
}

#[test]
fn pymavlink_accepts_our_signatures_once_and_with_its_key() {
    let mut ours = signing(KEY);
    let (mut input, mut stamps) = (String::new(), Vec::new());
    for (step, (_, _, bytes)) in (0..).zip(framed()) {
        let bytes = bytes.as_slice().try_into().unwrap();
        // Several frames have the same time.
        let frame = ours.sign(at(step / 3 * 500), bytes);
        stamps.push(stamp_of(&frame));
        input += &(hex(&frame) + "\n");
    }
    assert_eq!(stamps[0], STAMP);
    assert!(stamps.is_sorted_by(|a, b| a < b), "they rise");
    let steps = stamps.len() as u64 / 3 * 500;
    assert!(
        stamps[stamps.len() - 1] < STAMP + steps + 3,
        "with the time"
    );
    let read = |key, stamp: u64, input: &str| {
        python::output(peer(), &["read", &hex(key), &stamp.to_string()], input)
    };
    let said = read(&KEY, STAMP, &input);
    let plain: String = framed()
        .iter()
        .map(|(_, _, bytes)| hex(bytes) + "\n")
        .collect();
    assert_eq!(said, python::output(peer(), &["read"], &plain));
    for (input, key, stamp) in [
        (&input, &OTHER, STAMP),
        (&plain, &KEY, STAMP),
        (&input, &KEY, STAMP + MINUTE + steps + 1_000),
    ] {
        let said = read(key, stamp, input);
        assert!(said.lines().all(|line| line == "refused"));
        assert_eq!(said.lines().count(), stamps.len());
    }
    let twice = read(&KEY, STAMP, &(input.clone() + &input));
    let refused = twice.lines().skip(stamps.len());
    assert!(refused.clone().all(|line| line == "refused"));
    assert_eq!(refused.count(), stamps.len());
}

#[test]
fn pymavlinks_signatures_are_accepted_once_and_with_our_key() {
    let input: String = written().iter().map(|(line, _)| line.as_str()).collect();
    let stamp = STAMP.to_string();
    let frames = python::output(peer(), &["write", &hex(&KEY), &stamp, "9"], &input);
    let frames: Vec<Vec<u8>> = frames.lines().map(unhex).collect();
    let known: Vec<&[u8]> = (frames.iter().map(Vec::as_slice))
        // SYSTEM_TIME is not read.
        .filter(|frame| frame[7] != 2)
        .collect();
    assert!(known.len() > 1_000);
    let (mut ours, mut other) = (signing(KEY), signing(OTHER));
    for frame in &known {
        assert_eq!(checked(&mut ours, at(0), frame), Ok(()));
        assert_eq!(checked(&mut other, at(0), frame), Err(Flaw::Key));
    }
    for frame in &known {
        assert_eq!(checked(&mut ours, at(0), frame), Err(Flaw::Old), "again");
    }
    // Frames with a changed byte and a valid checksum: in the payload, link, stamp and signature.
    let (last, length) = (*known.last().unwrap(), known[known.len() - 1].len());
    for changed in [10, length - 13, length - 9, length - 1] {
        let mut frame = last.to_vec();
        frame[changed] ^= 1;
        let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        let sum = checksum(&frame[1..length - 15], find_known(id).unwrap());
        frame[length - 15..length - 13].copy_from_slice(&sum.to_le_bytes());
        assert_eq!(
            checked(&mut signing(KEY), at(0), &frame),
            Err(Flaw::Key),
            "byte {changed}"
        );
    }
    let plain = python::output(peer(), &["write"], &input);
    let unsigned = unhex(plain.lines().next().unwrap());
    assert_eq!(checked(&mut ours, at(0), &unsigned), Err(Flaw::Unsigned));
}

#[test]
fn a_stamp_must_rise_for_each_sender_and_link() {
    let mut ours = signing(KEY);
    let frame = |from, link, stamp| signed(KEY, from, link, stamp);
    let behind = STAMP - MINUTE;
    let mut check = |frame: Vec<u8>| checked(&mut ours, at(0), &frame);
    assert_eq!(check(frame(AUTOPILOT, 0, behind - 1)), Err(Flaw::Old));
    assert_eq!(check(frame(AUTOPILOT, 0, behind)), Ok(()));
    assert_eq!(check(frame(AUTOPILOT, 0, behind)), Err(Flaw::Old));
    assert_eq!(check(frame(AUTOPILOT, 0, behind + 1)), Ok(()));
    // Each link and sender has its own stamps.
    assert_eq!(check(frame(AUTOPILOT, 1, behind)), Ok(()));
    assert_eq!(check(frame(COMPANION, 0, behind)), Ok(()));
    // A stamp in the future advances the time.
    assert_eq!(check(frame(AUTOPILOT, 0, STAMP + 3 * MINUTE)), Ok(()));
    assert_eq!(check(frame(AUTOPILOT, 2, behind)), Err(Flaw::Old));
    assert_eq!(check(frame(AUTOPILOT, 2, STAMP + 2 * MINUTE)), Ok(()));
    let heartbeat = Outgoing::Heartbeat.encode(COMPANION, AUTOPILOT, 0);
    assert_eq!(
        stamp_of(&ours.sign(at(0), heartbeat)),
        STAMP + 3 * MINUTE,
        "the later one"
    );
}

/// Checks that a signer without a clock adopts the time of its first accepted frame.
#[test]
fn a_board_without_a_clock_takes_the_received_time() {
    let mut ours = Signing::new(KEY, 0, Stamp::UNKNOWN, at(500));
    let heartbeat = || Outgoing::Heartbeat.encode(COMPANION, AUTOPILOT, 0);
    assert_eq!(stamp_of(&ours.sign(at(500), heartbeat())), 1);
    assert_eq!(stamp_of(&ours.sign(at(1_500), heartbeat())), 1_000);
    let theirs = signed(KEY, AUTOPILOT, 0, STAMP);
    assert_eq!(checked(&mut ours, at(2_000), &theirs), Ok(()));
    assert_eq!(stamp_of(&ours.sign(at(2_000), heartbeat())), STAMP);
    assert_eq!(stamp_of(&ours.sign(at(2_000), heartbeat())), STAMP + 1);
    assert_eq!(stamp_of(&ours.sign(at(9_000), heartbeat())), STAMP + 7_000);
    // No frame was received for days.
    let day = 86_400 * 100_000;
    for turn in 1..100 {
        ours.sign(at(9_000 + turn * day / 50), heartbeat());
    }
    assert_eq!(
        stamp_of(&ours.sign(at(9_000 + 2 * day), heartbeat())),
        STAMP + 7_000 + 2 * day
    );
}

/// Checks that many changing senders do not make a signer forget the time stamp of an active sender.
#[test]
fn many_senders_do_not_make_a_replay_acceptable() {
    let mut ours = signing(KEY);
    for turn in 0..1_000_u64 {
        let other = Address {
            system: (turn % 200) as u8,
            component: 154,
        };
        let stamp = STAMP + turn * 1_000;
        let theirs = signed(KEY, AUTOPILOT, 0, stamp);
        assert_eq!(checked(&mut ours, at(0), &theirs), Ok(()));
        assert_eq!(checked(&mut ours, at(0), &theirs), Err(Flaw::Old), "{turn}");
        let others = signed(KEY, other, 0, stamp);
        assert_eq!(checked(&mut ours, at(0), &others), Ok(()));
    }
}

#[test]
fn stamps_begin_in_2015_and_end_with_48_bits() {
    let now = at(0);
    let first = |unix_us| {
        let mut ours = Signing::new(KEY, 0, Stamp::of_unix_micros(unix_us), now);
        let heartbeat = Outgoing::Heartbeat.encode(COMPANION, AUTOPILOT, 0);
        stamp_of(&ours.sign(now, heartbeat))
    };
    assert_eq!(first(0), 1, "above that of a frame that was never sent");
    assert_eq!(first(1_420_070_400 * 1_000_000), 1);
    assert_eq!(first(1_420_070_401 * 1_000_000), 100_000);
    assert_eq!(first(u64::MAX), (1 << 48) - 1);
}

/// Checks that timestamps keep up with time if the time between frames is no multiple of their unit.
#[test]
fn parts_of_a_unit_between_frames_are_not_lost() {
    let mut ours = signing(KEY);
    let heartbeat = Outgoing::Heartbeat.encode(COMPANION, AUTOPILOT, 0);
    for frame in 0..=1_000 {
        // 1.9 units.
        let now = Instant::from_micros(frame * 19);
        let stamp = stamp_of(&ours.sign(now, heartbeat.clone()));
        assert_eq!(stamp, STAMP + frame * 19 / 10);
    }
}
