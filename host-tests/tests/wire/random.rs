//! Random messages and bytes: the crate and the second codec agree.

use host_tests::make;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::TestRunner;
use uav_relay::optimiser::PerTarget;
use uav_relay::optimiser::ladder::Ladder;
use uav_relay::place::{CrossSection, Station};
use uav_relay::wire::auth::TAG;
use uav_relay::wire::frame::{self, FrameError, MAX_FRAME};
use uav_relay::wire::message::{Message, MessageError, Sweep};
use uav_relay_decode::envelope::{before, sealed, stuffed, unsigned};

use super::config;
use super::golden::{only_frame, written};
use super::meaning::message;
use super::message::{FORMAT, WireMessage};
use super::strategies::{bodies, headers, kinds, messages};

proptest! {
    #![proptest_config(config(4000))]

    /// Checks that both codecs agree on random messages. A frame is longer than its message by 16 bytes: header, CRC,
    /// a stuffing byte and a delimiter.
    #[test]
    fn both_codecs_write_the_same_and_read_each_other(wire_message in messages(), head in headers()) {
        let message = message(&wire_message);
        prop_assert_eq!(written(&message), wire_message.body(), "bytes distinguish -0 from 0");
        let mut frame = [0; MAX_FRAME];
        let len = frame::encode(head, &message, &mut frame);
        prop_assert_eq!(len, wire_message.body().len() + 16);
        prop_assert!(len + TAG <= MAX_FRAME);
        let frame = &frame[..len];
        prop_assert_eq!(frame.iter().position(|&byte| byte == 0), Some(len - 1));
        let plain = unsigned(head, wire_message.body());
        prop_assert_eq!(frame, stuffed(&plain));
        prop_assert_eq!(only_frame(frame), plain.clone());
        let (head_read, message_read) = frame::decode(&plain).unwrap();
        prop_assert_eq!(head_read, head);
        prop_assert_eq!(written(&message_read), wire_message.body());
        prop_assert_eq!(message_read, message);
        let decoded = uav_relay_decode::frame::read(&FORMAT, frame, len);
        prop_assert_eq!((decoded.refusal, decoded.header), (None, Some(head)));
        prop_assert_eq!((decoded.name, decoded.fields), (Some(wire_message.name()), wire_message.fields()));
    }

    #[test]
    fn a_buffer_one_byte_short_is_refused(wire_message in messages()) {
        let message = message(&wire_message);
        let mut body = vec![0; wire_message.body().len()];
        prop_assert_eq!(message.encode(&mut body), Some(body.len()));
        body.pop();
        prop_assert_eq!(message.encode(&mut body), None);
    }

    /// Checks that the longest messages have the documented lengths.
    ///
    /// The longest message, an offer, fills a frame except for the authentication tag.
    #[test]
    fn the_longest_messages_have_the_documented_lengths(
        offer in kinds(&["Offer"]),
        sense in kinds(&["Sense", "Sensed"]),
        head in headers(),
    ) {
        let mut frame = [0; MAX_FRAME];
        prop_assert_eq!(frame::encode(head, &message(&offer), &mut frame), MAX_FRAME - TAG);
        prop_assert_eq!(frame::encode(head, &message(&sense), &mut frame), 122);
    }
}

proptest! {
    #![proptest_config(config(8000))]

    #[test]
    fn any_bytes_with_a_good_crc_are_checked_as_in_the_tables(
        bytes in vec(any::<u8>(), 0..240),
        version in prop_oneof![3 => Just(Some(0x10)), 1 => Just(None)],
        flags in prop_oneof![3 => Just(Some(0)), 1 => Just(Some(0x10)), 1 => Just(None)],
        body in proptest::option::of(bodies()),
    ) {
        let mut bytes = bytes;
        if let Some(body) = &body && bytes.len() >= 10 {
            bytes.truncate(10);
            bytes.extend(body);
        }
        for (at, nibble) in [(1, version), (3, flags)] {
            if let (Some(nibble), Some(byte)) = (nibble, bytes.get_mut(at)) {
                *byte = nibble | *byte & 0x0F;
            }
        }
        let expected = if bytes.len() < 10 {
            Err(FrameError::Short)
        } else if bytes[1] >> 4 != 1 || ![0, 1, 3].contains(&(bytes[3] >> 4)) {
            Err(FrameError::Version)
        } else {
            let tag = if bytes[3] >> 4 == 0 { 0 } else { TAG };
            match bytes[10..].len().checked_sub(tag) {
                None => Err(FrameError::Short),
                Some(_) if bytes[3] >> 4 == 3 => Err(FrameError::Message(MessageError::Encoding)),
                Some(body) => WireMessage::read(&bytes[10..10 + body]).map_err(FrameError::Message),
            }
        };
        let read = frame::decode(&sealed(bytes.clone()));
        match expected {
            Err(error) => prop_assert_eq!(read, Err(error)),
            Ok(wire_message) => {
                let (head, read) = read.unwrap();
                prop_assert_eq!(read, message(&wire_message));
                bytes[3] &= 0x0F;
                prop_assert_eq!(before(head, 0, &[]), &bytes[..10]);
            }
        }
    }
}

#[test]
fn random_bodies_reach_messages_and_both_errors() {
    /// Index under which message bodies without a known tag are counted: the first unused tag.
    const NONE: usize = 23;
    /// Tags of messages in which all, or nearly all, numbers have the range "any".
    const ANY_NUMBER: [usize; 5] = [2, 3, 15, 16, 21];

    let mut runner = TestRunner::new(config(1));
    // Counts for each tag: valid, wrongly encoded, out of range.
    let mut seen = [[0; 3]; NONE + 1];
    for _ in 0..16_000 {
        let body = bodies().new_tree(&mut runner).unwrap().current();
        let tag = body.first().map_or(NONE, |&tag| usize::from(tag).min(NONE));
        let what = match WireMessage::verdict(&body) {
            Ok(()) => 0,
            Err(MessageError::Encoding) => 1,
            Err(_) => 2,
        };
        seen[tag][what] += 1;
    }
    println!("{seen:?}");
    for (tag, [good, encoding, value]) in seen.into_iter().enumerate() {
        assert!(encoding > 50, "tag {tag}: {encoding} wrongly encoded");
        assert!(good > 50 || tag == NONE, "tag {tag}: {good} valid");
        assert!(
            value > 5 || tag == NONE || ANY_NUMBER.contains(&tag),
            "tag {tag}: {value} out of range; add the tag to ANY_NUMBER if (nearly) all numbers of the message have the range any"
        );
    }
}

#[test]
fn node_numbers_out_of_range_are_not_encoded() {
    let message = Message::Busy { number: 1 };
    for (number, fits) in [(4094, true), (4095, false), (4096, false), (65535, false)] {
        for [sender, destination] in [[number, 2], [1, number]] {
            let header = make::header(sender, destination, 3);
            let len = frame::encode(header, &message, &mut [0; MAX_FRAME]);
            assert_eq!(len, if fits { 19 } else { 0 }, "{number}");
        }
    }
}

/// Checks that a sweep of the joint method is encoded as message `Aside`. This message has no measured value.
#[test]
fn joint_sweeps_are_asides_even_on_the_line() {
    let sweep = |chosen, measured_per_w| Sweep {
        number: 1,
        view_digest: 2,
        ladder: Ladder::single(1.5),
        relay: Station {
            cross_section: CrossSection::on_line(20.0),
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
