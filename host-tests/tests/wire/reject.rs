//! Refusals of versions, flags, node numbers and encodable values. `mutations.rs` has the ranges.

use uav_relay::optimiser::ladder::Ladder;
use uav_relay::optimiser::{PerTarget, pass::Verdict};
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::frame::{self, FrameError, Header, MAX_FRAME};
use uav_relay::wire::message::{Answer, MAX_BODY, Message, MessageError, OwnSeat, Roster, Sweep};

use super::codec::{plain, sealed};
use super::golden::vectors;

const HEADER: Header = Header {
    network: 7,
    sender: 1,
    destination: 2,
    counter: 3,
};

pub(crate) const ENCODING: Result<(), MessageError> = Err(MessageError::Encoding);
pub(crate) const VALUE: Result<(), MessageError> = Err(MessageError::Value);

/// Returns a receiver's verdict on a message that the crate has encoded.
fn verdict_on(message: &Message) -> Result<(), MessageError> {
    match frame::decode(&plain(HEADER, &written(message))) {
        Ok(_) => Ok(()),
        Err(FrameError::Message(error)) => Err(error),
        Err(other) => panic!("{other:?}"),
    }
}

pub(crate) fn written(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

const NO_MESSAGE: FrameError = FrameError::Message(MessageError::Encoding);

#[test]
fn other_versions_and_flags_are_refused_before_the_body_is_read() {
    // A sweep, long enough for a tag.
    let frames = vectors().frames;
    let good = frames
        .iter()
        .find(|vector| vector.message == "Sweep")
        .unwrap();
    let good = plain(HEADER, &good.body);
    for nibble in 0..=15_u8 {
        for at in [1, 3] {
            let mut bad = good[..good.len() - 4].to_vec();
            bad[at] = bad[at] & 0x0F | nibble << 4;
            // With a tag the last bytes are not the body's, and a handshake is no message.
            let (read, short) = match (at, nibble) {
                (1, 1) | (3, 0) => (Ok(()), NO_MESSAGE),
                (3, 1 | 3) => (Err(NO_MESSAGE), FrameError::Short),
                _ => (Err(FrameError::Version), FrameError::Version),
            };
            let whole = sealed(bad.clone());
            assert_eq!(frame::decode(&whole).map(|_| ()), read, "{at}: {nibble}");
            bad.truncate(10);
            bad.push(0xFF);
            assert_eq!(frame::decode(&sealed(bad)), Err(short), "{at}: {nibble}");
        }
    }
}

#[test]
fn node_numbers_that_do_not_fit_are_not_written() {
    let message = Message::Busy { number: 1 };
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
    let answer = |slack, stand| {
        Message::Verdict(Answer {
            number: 0,
            view_digest: 0,
            verdict: Verdict {
                commit: None,
                slacks: PerTarget::from_slice(&[slack]).unwrap(),
            },
            own: true,
            required_x_m: stand,
        })
    };
    for (slack, stand, fits) in [
        (1.0, None, true),
        (1.0, Some(1.0), true),
        (f32::NAN, None, false),
        (3e9, None, false),
        (1.0, Some(f32::NAN), false),
        (1.0, Some(-1.0), false),
        (1.0, Some(2e6), false),
    ] {
        let read = verdict_on(&answer(slack, stand));
        assert_eq!(read.is_ok(), fits, "{slack} {stand:?}");
    }
    assert!(Ladder::from_parts(1.0, 255, 255).is_none());
}

/// Checks that the receiver refuses out-of-range values, whatever a sender encodes.
#[test]
fn a_sweep_or_seat_written_out_of_range_is_refused() {
    let sweep = |y_m| {
        Message::Sweep(Sweep {
            number: 0,
            view_digest: 0,
            ladder: Ladder::single(1.0),
            relay: Station {
                at: CrossSection {
                    y_m,
                    altitude_m: 20.0,
                },
                power_w: 1.0,
            },
            chosen: true,
            measured_per_w: None,
            reaches: PerTarget::new(),
        })
    };
    for (y_m, expected) in [(1.0, Ok(())), (2e5, VALUE), (f32::NAN, VALUE)] {
        assert_eq!(verdict_on(&sweep(y_m)), expected, "{y_m}");
    }
    for (index, held_m, power_w, expected) in [
        (1, 20.0, 1.0, Ok(())),
        (0, 20.0, 1.0, VALUE),
        (1, f32::NAN, 1.0, VALUE),
        (1, 0.0, 0.0, VALUE),
    ] {
        let seat = OwnSeat {
            index,
            held_m,
            power_w,
        };
        let roster = Roster {
            number: 0,
            view_digest: 0,
            after: 0,
            seats: [seat].into_iter().collect(),
        };
        for message in [Message::Gather(roster.clone()), Message::Gathered(roster)] {
            assert_eq!(verdict_on(&message), expected, "{seat:?}");
        }
    }
}

/// Checks that a chosen position on the line differs from a given one, and excludes measured values.
#[test]
fn a_sweep_by_the_joint_method_is_an_aside_even_on_the_line() {
    let sweep = |chosen, measured_per_w| Sweep {
        number: 1,
        view_digest: 2,
        ladder: Ladder::single(1.5),
        relay: Station {
            at: CrossSection::on_line(20.0),
            power_w: 1.0,
        },
        chosen,
        measured_per_w,
        reaches: PerTarget::new(),
    };
    for (chosen, measured, tag) in [
        (false, None, 0),
        (false, Some(1e9), 4),
        (true, None, 5),
        (true, Some(1e9), 5),
    ] {
        let body = written(&Message::Sweep(sweep(chosen, measured)));
        assert_eq!(body[0], tag);
        let measured = measured.filter(|_| !chosen);
        let read = Message::decode(&body).unwrap();
        assert_eq!(read, Message::Sweep(sweep(chosen, measured)));
    }
}
