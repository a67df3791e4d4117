//! What must be refused although its CRC is right, and with which reason: other versions, bodies that are no message,
//! numbers out of range. `document.rs` has the same for the rows of the document.

use uav_relay::placement::ladder::Ladder;
use uav_relay::placement::{PerTarget, verdict::Verdict};
use uav_relay::wire::frame::{self, FrameError, Header, MAX_FRAME};
use uav_relay::wire::message::{Answer, Message, MessageError};

use super::codec::{Said, plain, sealed};
use super::golden::vectors;
use super::strategies::pad;

const HEADER: Header = Header {
    network: 7,
    sender: 1,
    destination: 2,
    counter: 3,
};

const ENCODING: FrameError = FrameError::Message(MessageError::Encoding);
const VALUE: FrameError = FrameError::Message(MessageError::Value);

/// What a receiver makes of a body in an intact frame.
fn verdict_on(body: &[u8]) -> Result<Message, FrameError> {
    frame::decode(&plain(HEADER, body)).map(|(_, message)| message)
}

fn sweep() -> Said {
    Said::Sweep {
        number: 1,
        mission: 2,
        anchor: 1.5,
        gap: 100,
        growth: 2,
        altitude_m: 20.0,
        power_w: 1.0,
        reaches: vec![100.0, 50.0],
    }
}

fn verdict(commit: Option<u8>, slacks: &[f32]) -> Said {
    Said::Verdict {
        number: 1,
        mission: 2,
        commit,
        slacks: slacks.to_vec(),
    }
}

#[test]
fn other_versions_and_flags_are_refused_before_the_body_is_read() {
    let good = plain(HEADER, &sweep().body());
    for nibble in 0..=15_u8 {
        for at in [1, 3] {
            let mut bad = good[..good.len() - 4].to_vec();
            bad[at] = bad[at] & 0x0F | nibble << 4;
            let expected = nibble == u8::from(at == 1);
            let read = frame::decode(&sealed(bad.clone()));
            assert_eq!(read.is_ok(), expected, "byte {at}: {nibble}");
            bad.truncate(10);
            bad.push(0xFF);
            let error = if expected {
                ENCODING
            } else {
                FrameError::Version
            };
            assert_eq!(frame::decode(&sealed(bad)), Err(error));
        }
    }
}

#[test]
fn bodies_that_are_no_message_are_refused() {
    for vector in vectors().frames {
        let body = vector.message.body();
        assert!(verdict_on(&body).is_ok());
        for len in 0..body.len() {
            assert_eq!(verdict_on(&body[..len]), Err(ENCODING), "{}", vector.name);
        }
        for extra in 0..=u8::MAX {
            let longer = [&body[..], &[extra]].concat();
            assert_eq!(verdict_on(&longer), Err(ENCODING), "{}", vector.name);
        }
        for tag in 4..=u8::MAX {
            let mut other = body.clone();
            other[0] = tag;
            assert_eq!(verdict_on(&other), Err(ENCODING), "{}", vector.name);
        }
    }
    let heartbeat = [3, 0, 0];
    let option = [1, 0, 0, 0, 0];
    for byte in 2..=u8::MAX {
        let bool_byte = [&heartbeat[..], &[byte]].concat();
        assert_eq!(verdict_on(&bool_byte), Err(ENCODING), "bool {byte}");
        let option_byte = [&option[..], &[byte, 0]].concat();
        assert_eq!(verdict_on(&option_byte), Err(ENCODING), "Option {byte}");
        let option_byte = [&option[..], &[byte, 0, 0]].concat();
        assert_eq!(verdict_on(&option_byte), Err(ENCODING), "Option {byte}");
    }
    for count in 17..=127_u8 {
        let mut body = verdict(None, &[]).body();
        body[6] = count;
        body.extend(vec![0; 4 * usize::from(count)]);
        assert_eq!(verdict_on(&body), Err(ENCODING), "{count} slacks");
        let mut body = sweep().body();
        body.truncate(19);
        body.push(count);
        body.extend(vec![0; 4 * usize::from(count)]);
        assert_eq!(verdict_on(&body), Err(ENCODING), "{count} reaches");
    }
}

#[test]
fn padded_varints_are_refused() {
    let bodies = [
        sweep().body(),
        verdict(None, &[]).body(),
        verdict(Some(1), &[2.0, 1.0]).body(),
    ];
    for body in bodies {
        for tag in [true, false] {
            for more in 0..9 {
                let mut padded = body.clone();
                pad(&mut padded, tag, more);
                assert_eq!(padded.len(), body.len() + 1 + more);
                assert_eq!(verdict_on(&padded), Err(ENCODING), "{padded:x?}");
            }
        }
    }
    for body in [Said::Busy { number: 9 }.body(), vec![3, 0, 0, 1]] {
        let mut padded = body.clone();
        pad(&mut padded, true, 0);
        assert_eq!(verdict_on(&padded), Err(ENCODING), "{padded:x?}");
    }
}

/// Puts `number` at `at` of a body.
fn with(said: &Said, at: usize, number: f32) -> Vec<u8> {
    let mut body = said.body();
    body[at..at + 4].copy_from_slice(&number.to_le_bytes());
    body
}

#[test]
fn numbers_are_accepted_up_to_their_bounds_and_no_farther() {
    let single = Said::Sweep {
        number: 1,
        mission: 2,
        anchor: 1.5,
        gap: 0,
        growth: 0,
        altitude_m: 20.0,
        power_w: 1.0,
        reaches: vec![100.0],
    };
    let slack = verdict(None, &[1.0]);
    for (said, at, least, most, what) in [
        (&single, 5, f32::MIN_POSITIVE, f32::MAX, "anchor"),
        (&single, 11, 0.1, 1e5, "altitude"),
        (&single, 15, 1e-6, 1e6, "power"),
        (&single, 20, 0.0, 2e9, "reach"),
        (&slack, 7, -2e9, 2e9, "slack"),
    ] {
        for good in [least, most] {
            assert!(verdict_on(&with(said, at, good)).is_ok(), "{what} {good}");
        }
        for bad in [
            least.next_down(),
            most.next_up(),
            f32::NAN,
            -f32::NAN,
            f32::from_bits(0x7F80_0001),
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MIN,
        ] {
            let read = verdict_on(&with(said, at, bad));
            assert_eq!(read, Err(VALUE), "{what} {bad}");
        }
    }
    for zero in [0.0, -0.0] {
        assert_eq!(verdict_on(&with(&single, 5, zero)), Err(VALUE));
        assert!(verdict_on(&with(&single, 20, zero)).is_ok());
        assert!(verdict_on(&with(&slack, 7, zero)).is_ok());
    }
}

#[test]
fn ladders_that_leave_the_normal_numbers_are_refused() {
    let ladder = |anchor: f32, gap: u8, growth: u8| {
        let mut body = with(&sweep(), 5, anchor);
        body[9..11].copy_from_slice(&[gap, growth]);
        verdict_on(&body).map(|_| ())
    };
    assert_eq!(ladder(1.5, 100, 2), Ok(()));
    assert_eq!(ladder(1.0, 255, 255), Err(VALUE), "overflows");
    assert_eq!(ladder(f32::MAX, 1, 0), Err(VALUE), "overflows at the top");
    assert_eq!(ladder(f32::MIN_POSITIVE, 200, 0), Err(VALUE), "underflows");
    assert_eq!(ladder(1e-30, 255, 0), Err(VALUE), "underflows");
    for anchor in [0.0, -1.5, f32::NAN, f32::INFINITY, f32::from_bits(1)] {
        assert_eq!(ladder(anchor, 100, 2), Err(VALUE), "{anchor}");
    }
}

#[test]
fn a_sweep_has_no_more_reaches_than_targets_and_a_single_target_no_growth() {
    let single = |growth, count: u8| {
        let mut body = sweep().body();
        body[9..11].copy_from_slice(&[0, growth]);
        body.truncate(19);
        body.push(count);
        body.extend(vec![0; 4 * usize::from(count)]);
        verdict_on(&body).map(|_| ())
    };
    assert_eq!(single(0, 0), Ok(()));
    assert_eq!(single(0, 1), Ok(()));
    for count in 2..=16 {
        assert_eq!(single(0, count), Err(VALUE), "{count} reaches");
    }
    for growth in 1..=u8::MAX {
        assert_eq!(single(growth, 1), Err(VALUE), "growth {growth}");
    }
}

#[test]
fn a_commit_names_one_of_sixteen_targets() {
    for target in 0..=u8::MAX {
        let read = verdict_on(&verdict(Some(target), &[]).body());
        assert_eq!(read.is_ok(), target < 16, "{target}");
    }
}

#[test]
fn node_numbers_that_do_not_fit_are_not_written() {
    let message = Message::Busy { sweep: 1 };
    for (number, fits) in [(4094, true), (4095, false), (4096, false), (65535, false)] {
        for header in [
            Header {
                sender: number,
                ..HEADER
            },
            Header {
                destination: number,
                ..HEADER
            },
        ] {
            let mut out = [0; MAX_FRAME];
            let len = frame::encode(header, &message, &mut out);
            assert_eq!(len, if fits { 19 } else { 0 }, "{number}");
        }
    }
}

#[test]
fn what_the_crate_writes_out_of_range_it_refuses_to_read() {
    let answer = |slack| {
        Message::Verdict(Answer {
            number: 0,
            mission: 0,
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::from_slice(&[slack]).unwrap(),
            },
        })
    };
    for (slack, fits) in [(1.0, true), (f32::NAN, false), (3e9, false)] {
        let mut body = [0; 84];
        let len = answer(slack).encode(&mut body).unwrap();
        assert_eq!(Message::decode(&body[..len]).is_ok(), fits, "{slack}");
    }
    assert!(Ladder::from_parts(1.0, 255, 255).is_none());
}
