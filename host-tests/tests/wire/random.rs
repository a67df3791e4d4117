//! Random messages and bytes: the crate and the second codec agree.

use proptest::collection::vec;
use proptest::prelude::*;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::frame::{self, FrameError, MAX_FRAME};
use uav_relay::wire::message::{MAX_BODY, Message, MessageError};

use super::codec::{self, FORMAT, Said, plain, sealed, wire};
use super::config;
use super::golden::only_frame;
use super::offered::offers;
use super::strategies::{asides, headers, measured, messages, sweeps};
use super::stream_strategies::bodies;
use super::view_strategies::heard;

/// Encodes a message, because bytes distinguish -0 from 0.
fn body_of(message: &Message) -> Vec<u8> {
    let mut body = [0; MAX_BODY];
    let len = message.encode(&mut body).unwrap();
    body[..len].to_vec()
}

proptest! {
    #![proptest_config(config(4000))]

    #[test]
    fn both_codecs_write_the_same_and_read_each_other(said in messages(), head in headers()) {
        let message = said.message();
        let mut frame = [0; MAX_FRAME];
        let len = frame::encode(head, &message, &mut frame);
        let written = plain(head, &said.body());
        prop_assert_eq!(&frame[..len], wire(&written));
        prop_assert_eq!(Said::read(&body_of(&message)).unwrap().body(), said.body());
        let (head_read, message_read) = frame::decode(&written).unwrap();
        prop_assert_eq!(head_read, head);
        prop_assert_eq!(body_of(&message_read), said.body());
        prop_assert_eq!(message_read, message);
        let decoded = uav_relay_decode::frame::read(&FORMAT, &frame[..len], len);
        prop_assert_eq!((decoded.refusal, decoded.header), (None, Some(head)));
        let fields = Said::of(decoded.name.unwrap(), &decoded.fields);
        prop_assert_eq!(fields.body(), said.body());
    }

    /// Checks the overhead: header, CRC, a byte of stuffing and the delimiter.
    #[test]
    fn every_frame_takes_16_bytes_more_than_its_body_with_one_zero(said in messages(), head in headers()) {
        let mut frame = [0; MAX_FRAME];
        let len = frame::encode(head, &said.message(), &mut frame);
        prop_assert_eq!(len, said.body().len() + 16);
        prop_assert!(len + TAG <= MAX_FRAME);
        prop_assert_eq!(frame[..len].iter().position(|&byte| byte == 0), Some(len - 1));
        prop_assert_eq!(only_frame(&frame[..len]).len(), len - 2);
    }

    #[test]
    fn an_offer_fills_a_frame_but_for_its_tag_and_the_longest_others_do_not(
        offer in offers(),
        heard in heard(),
        sweep in prop_oneof![measured(sweeps(16)), asides(sweeps(16))],
        head in headers(),
    ) {
        let mut frame = [0; MAX_FRAME];
        prop_assert_eq!(frame::encode(head, &offer.message(), &mut frame), MAX_FRAME - TAG);
        prop_assert_eq!(frame::encode(head, &heard.message(), &mut frame), 122);
        prop_assert_eq!(frame::encode(head, &sweep.message(), &mut frame), 104);
    }

    #[test]
    fn a_buffer_one_byte_short_is_refused(said in messages()) {
        let mut body = vec![0; said.body().len()];
        prop_assert_eq!(said.message().encode(&mut body), Some(body.len()));
        body.pop();
        prop_assert_eq!(said.message().encode(&mut body), None);
    }
}

proptest! {
    #![proptest_config(config(8000))]

    #[test]
    fn any_body_is_read_or_refused_as_the_rules_say(body in bodies()) {
        let read = Message::decode(&body);
        match Said::read(&body) {
            Ok(said) => {
                prop_assert_eq!(said.body(), &*body, "one encoding a message");
                prop_assert_eq!(read.as_ref().map(body_of), Ok(body.clone()));
                prop_assert_eq!(read, Ok(said.message()));
            }
            Err(error) => prop_assert_eq!(read, Err(error)),
        }
    }

    #[test]
    fn any_bytes_with_a_good_crc_are_read_or_refused_as_the_rules_say(
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
                Some(body) => Said::read(&bytes[10..10 + body]).map_err(FrameError::Message),
            }
        };
        let sealed = sealed(bytes.clone());
        let read = frame::decode(&sealed);
        match expected {
            Err(error) => prop_assert_eq!(read, Err(error)),
            Ok(said) => {
                let (head, message) = read.unwrap();
                prop_assert_eq!(message, said.message());
                bytes[3] &= 0x0F;
                prop_assert_eq!(codec::header(head), &bytes[..10]);
            }
        }
    }

    #[test]
    fn any_bytes_at_all_are_refused(bytes in vec(any::<u8>(), 0..300)) {
        // A valid CRC among random ones has probability 2^-32; these draws have none.
        let expected = if bytes.len() < 14 { FrameError::Short } else { FrameError::Crc };
        prop_assert_eq!(frame::decode(&bytes), Err(expected));
        let said = Said::read(&bytes);
        let read = said.as_ref().map(Said::message).map_err(|error| *error);
        prop_assert_eq!(Message::decode(&bytes), read);
    }
}

#[test]
fn the_draws_reach_messages_and_both_refusals() {
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;

    /// First tag without a message, for it and all later ones.
    const NONE: usize = 20;

    let mut runner = TestRunner::new(config(1));
    // Counts for each tag: valid, wrongly encoded, out of range.
    let mut seen = [[0; 3]; 21];
    for _ in 0..16_000 {
        let body = bodies().new_tree(&mut runner).unwrap().current();
        let tag = body.first().map_or(NONE, |&tag| usize::from(tag).min(NONE));
        let what = match Said::read(&body) {
            Ok(_) => 0,
            Err(MessageError::Encoding) => 1,
            Err(_) => 2,
        };
        seen[tag][what] += 1;
    }
    println!("{seen:?}");
    for (tag, [good, encoding, value]) in seen.into_iter().enumerate() {
        assert!(encoding > 50, "{tag}");
        assert!(good > 50 || tag == NONE, "{tag}");
        assert!(value > 5 || [2, 3, 15, 16, NONE].contains(&tag), "{tag}");
    }
}
