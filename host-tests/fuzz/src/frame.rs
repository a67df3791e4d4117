//! Fuzz target: bytes with a valid CRC. If they decode to a frame, it must encode to the same bytes.

use std::sync::LazyLock;

use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{
    self, FrameError, HEADER, Header, MAX_DECODED, MAX_FRAME, MAX_NODE, VERSION,
};
use uav_relay::wire::message::{Message, MessageError};
use uav_relay::{Identity, Instant, Port, Relay, Stats};
use uav_relay_decode::envelope::{sealed, stuffed};
use uav_relay_decode::format::Format;
use uav_relay_decode::refusal::Refusal;
use uav_relay_decode::walk;

use super::input::Input;
use super::member::Member;
use super::setting;
use super::watch::NETWORK;

const CHECK: usize = 4;

/// Input byte with which `setting::of_chain` returns settings with signed frames.
const SIGNS: u8 = 8;

/// Fuzz target. Reads `data` as header and body of a frame, adds CRC and COBS, and decodes it.
///
/// # Panics
/// The frame changes when it is decoded and encoded, a flipped bit is not detected, a message has two encodings, or
/// the decoder contradicts the tables of `FORMAT.md`.
pub fn frame(data: &[u8]) {
    let plain = sealed(data.to_vec());
    let wire = stuffed(&plain);
    check_round_trip(&plain, &wire);
    check_flipped_bit(&plain);
    check_decoded(&plain);
    check_signed(&plain);
    if let Ok(opened) = frame::open(&plain) {
        check_body(opened.body);
    }
    let Ok((header, message)) = frame::decode(&plain) else {
        return;
    };
    let mut again = [0; MAX_FRAME];
    let len = frame::encode(header, &message, &mut again);
    if header.sender > MAX_NODE || header.destination > MAX_NODE {
        assert_eq!(len, 0, "nobody writes to 4095");
        return;
    }
    // The re-encoded frame has no tag.
    let mut bare = plain.clone();
    if frame::open(&bare).is_ok_and(|opened| opened.tag.is_some()) {
        bare.truncate(bare.len() - TAG - CHECK);
        if let Some(flags) = bare.get_mut(3) {
            *flags &= 0x0F;
        }
        bare = sealed(bare);
    }
    assert_eq!(again.get(..len), Some(&*stuffed(&bare)), "{message:?}");
    let written = again.get(..len).unwrap_or_default();
    assert_eq!(written.iter().position(|&byte| byte == 0), Some(len - 1));
}

/// Checks that `frame::open` splits an intact frame into the parts defined by the format.
fn check_decoded(plain: &[u8]) {
    let opened = frame::open(plain);
    let (Some(checked), Some(&[_, first, _, second])) = (
        plain.len().checked_sub(CHECK),
        plain
            .first_chunk()
            .filter(|_| plain.len() >= HEADER + CHECK),
    ) else {
        return assert_eq!(opened, Err(FrameError::Short));
    };
    let (version, flags) = (first >> 4, second >> 4);
    if version != VERSION || ![0, 1, 3].contains(&flags) {
        return assert_eq!(opened, Err(FrameError::Version));
    }
    let tag = if flags == 0 { 0 } else { TAG };
    let Some(ends) = checked.checked_sub(tag).filter(|&ends| ends >= HEADER) else {
        return assert_eq!(opened, Err(FrameError::Short));
    };
    let Ok(opened) = opened else {
        unreachable!("{opened:?}");
    };
    assert_eq!(Some(opened.body), plain.get(HEADER..ends));
    assert_eq!(Some(opened.signed), plain.get(..ends));
    let told = plain.get(ends..checked).filter(|_| tag > 0);
    assert_eq!(opened.tag.as_ref().map(|tag| &tag[..]), told);
    assert_eq!(opened.handshake, flags == 3);
}

/// Checks that a relay that requires authentication tags verifies the tags.
///
/// A frame with the body of `plain`, valid addresses and a valid tag must be accepted, but only once. With a flipped
/// bit, the frame must be counted as forged.
fn check_signed(plain: &[u8]) {
    let body = plain.get(HEADER..plain.len() - CHECK).unwrap_or_default();
    let Some(HandshakenPair {
        mut relay,
        mut member,
    }) = handshaken_pair()
    else {
        return;
    };
    let header = Header {
        network: NETWORK,
        sender: 1,
        destination: 2,
        counter: 0,
    };
    let right = member.signed(header, body);
    if right.len() > MAX_DECODED {
        return;
    }
    let mut altered = right.clone();
    altered.truncate(right.len() - CHECK);
    let bits = 8 * (altered.len() - HEADER);
    let chosen = plain.last().map_or(0, |&byte| usize::from(byte)) % bits;
    if let Some(byte) = altered.get_mut(HEADER + chosen / 8) {
        *byte ^= 1 << (chosen % 8);
    }
    let altered = sealed(altered);
    let (before, now) = (*relay.stats(), Instant::ZERO);
    for plain in [&altered, &right, &right] {
        relay.handle_bytes(now, Port::Upstream, &stuffed(plain));
    }
    let mut expected = Stats {
        forged: before.forged + 1,
        replayed: before.replayed + 1,
        ..before
    };
    match Message::decode(body) {
        // A Level is accepted only from the ground, and a Claim only without a key.
        Ok(Message::Level { .. } | Message::Claim(_)) => expected.misaddressed += 1,
        Ok(_) => expected.received += 1,
        Err(_) => expected.malformed += 1,
    }
    // Other targets check the effects of messages.
    let after = Stats {
        mission: before.mission,
        view: before.view,
        stale: before.stale,
        misdirected: before.misdirected,
        repeated: before.repeated,
        passes_begun: before.passes_begun,
        ..*relay.stats()
    };
    assert_eq!(after, expected);
}

/// Relay 2 of 3, which requires tags, and its upstream neighbour, after their handshakes.
#[derive(Clone)]
struct HandshakenPair {
    relay: Relay,
    member: Member,
}

fn handshaken_pair() -> Option<HandshakenPair> {
    thread_local! {
        static PAIR: Option<HandshakenPair> = make_handshaken_pair();
    }
    PAIR.with(Clone::clone)
}

fn make_handshaken_pair() -> Option<HandshakenPair> {
    let mut input = Input::new(&[0, 2, SIGNS]);
    let mission = setting::mission(&mut input, 3)?;
    let settings = setting::of_chain(&mut input, &mission);
    let identity = Identity {
        network: NETWORK,
        index: 2,
    };
    let now = Instant::ZERO;
    let mut relay = Relay::new(mission, identity, settings, 1, now).ok()?;
    let mut handshake = [0; MAX_FRAME];
    let transmit = relay.poll_transmit(now, &mut handshake)?;
    let mut member = Member::from_handshake(handshake.get(..transmit.len)?)?;
    let header = Header {
        network: NETWORK,
        sender: 1,
        destination: 2,
        counter: 0,
    };
    relay.handle_bytes(now, Port::Upstream, &stuffed(&member.handshake(header)));
    assert_eq!(relay.stats().rejected(), 0);
    Some(HandshakenPair { relay, member })
}

fn check_round_trip(plain: &[u8], wire: &[u8]) {
    let mut deframer = Deframer::new();
    for &byte in wire {
        let outcome = deframer.push(byte);
        if byte != 0 {
            assert_eq!(outcome, None);
        } else if plain.len() > MAX_DECODED {
            assert_eq!(outcome, Some(Err(DeframeError::Oversized)));
        } else {
            assert_eq!(outcome, Some(Ok(plain)));
        }
    }
}

/// Checks that the CRC detects a flipped bit. The value of the CRC selects the bit.
fn check_flipped_bit(plain: &[u8]) {
    let mut plain = plain.to_vec();
    let bits = plain.len() * 8;
    let chosen = plain
        .last_chunk()
        .map_or(0, |chunk| u32::from_le_bytes(*chunk) as usize % bits);
    if let Some(byte) = plain.get_mut(chosen / 8) {
        *byte ^= 1 << (chosen % 8);
    }
    let refusal = if plain.len() < 14 {
        FrameError::Short
    } else {
        FrameError::Crc
    };
    assert_eq!(frame::decode(&plain), Err(refusal));
}

/// Checks that the decoder accepts exactly the bodies that `FORMAT.md` permits.
fn check_body(body: &[u8]) {
    static FORMAT: LazyLock<Option<Format>> = LazyLock::new(|| Format::load().ok());
    let Some(format) = &*FORMAT else {
        unreachable!("a test loads the tables");
    };
    let by_the_tables = match walk::message(format, body) {
        Ok(_) => Ok(()),
        Err(Refusal::Range) => Err(MessageError::Value),
        Err(_) => Err(MessageError::Encoding),
    };
    assert_eq!(
        Message::decode(body).map(|_| ()),
        by_the_tables,
        "{body:02x?}"
    );
}
