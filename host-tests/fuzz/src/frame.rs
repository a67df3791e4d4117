//! Fuzz target: arbitrary bytes with a valid CRC. A frame that can be decoded is encoded identically.

use uav_relay::sensing::belief::Belief;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::{DeframeError, Deframer};
use uav_relay::wire::frame::{self, FrameError, HEADER, MAX_DECODED, MAX_FRAME, MAX_NODE, VERSION};
use uav_relay::wire::message::{Message, Successor};
use uav_relay::{Identity, Instant, Mission, Port, Relay, Stats, ViewId};

use super::cobs::stuffed;
use super::input::Input;
use super::member::Member;
use super::message::{Header, sealed};
use super::setting;
use super::watch::NETWORK;

const CHECK: usize = 4;

/// Method byte of a chain with signed frames.
const SIGNS: u8 = 8;

/// Reads `data` as the header and body of a frame, adds the CRC and COBS, and decodes it.
///
/// # Panics
/// The frame changes on its way, a flipped bit is not detected, a message has two encodings, or a message has a number out of its
/// range.
pub fn frame(data: &[u8]) {
    let mut plain = data.to_vec();
    sealed(&mut plain);
    let wire = stuffed(&plain);
    comes_through(&plain, &wire);
    flipped(&plain);
    taken_apart(&plain);
    signed(&plain);
    let Ok((header, message)) = frame::decode(&plain) else {
        return;
    };
    look_at(&message);
    let mut again = [0; MAX_FRAME];
    let len = frame::encode(header, &message, &mut again);
    if header.sender > MAX_NODE || header.destination > MAX_NODE {
        assert_eq!(len, 0, "nobody writes to 4095");
        return;
    }
    // A frame loses its tag when it is encoded again.
    let mut bare = plain.clone();
    if frame::open(&bare).is_ok_and(|opened| opened.tag.is_some()) {
        bare.truncate(bare.len() - TAG - CHECK);
        if let Some(flags) = bare.get_mut(3) {
            *flags &= 0x0F;
        }
        sealed(&mut bare);
    }
    assert_eq!(again.get(..len), Some(&*stuffed(&bare)), "{message:?}");
    let written = again.get(..len).unwrap_or_default();
    assert_eq!(written.iter().position(|&byte| byte == 0), Some(len - 1));
}

/// Checks that the parts of an intact frame are those of the format.
fn taken_apart(plain: &[u8]) {
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

/// Checks a relay that requires tags. The body with valid addresses and tag is accepted once, and rejected as forged with a
/// flipped bit.
fn signed(plain: &[u8]) {
    let body = plain.get(HEADER..plain.len() - CHECK).unwrap_or_default();
    let Some(Met {
        mut relay,
        mut member,
    }) = met()
    else {
        return;
    };
    let header = Header {
        network: NETWORK,
        sender: 1,
        destination: 2,
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
    sealed(&mut altered);
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
        // A Level is accepted only from the ground, a Claim only without a key.
        Ok(Message::Level { .. } | Message::Claim(_)) => expected.misaddressed += 1,
        Ok(_) => expected.received += 1,
        Err(_) => expected.malformed += 1,
    }
    // Effects of messages are checked by other targets.
    let after = Stats {
        mission: before.mission,
        view: before.view,
        stale: before.stale,
        misdirected: before.misdirected,
        repeated: before.repeated,
        sweeps: before.sweeps,
        ..*relay.stats()
    };
    assert_eq!(after, expected);
}

/// Relay 2 of 3 that requires tags, and its upstream neighbour, after their handshake.
#[derive(Clone)]
struct Met {
    relay: Relay,
    member: Member,
}

fn met() -> Option<Met> {
    thread_local! {
        static MET: Option<Met> = meet();
    }
    MET.with(Clone::clone)
}

fn meet() -> Option<Met> {
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
    let mut member = Member::greeted(handshake.get(..transmit.len)?)?;
    let header = Header {
        network: NETWORK,
        sender: 1,
        destination: 2,
    };
    relay.handle_bytes(now, Port::Upstream, &stuffed(&member.handshake(header)));
    assert_eq!(relay.stats().rejected(), 0);
    Some(Met { relay, member })
}

fn comes_through(plain: &[u8], wire: &[u8]) {
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

/// Checks that a flipped bit, chosen by the CRC, is detected.
fn flipped(plain: &[u8]) {
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

fn look_at(message: &Message) {
    match message {
        Message::Sweep(sweep) => {
            let targets = sweep.ladder.targets();
            assert_eq!(targets.len(), sweep.ladder.len());
            let rising = targets.is_sorted();
            assert!(
                rising && targets.iter().all(|&sir| is_target(sir)),
                "{targets:?}"
            );
            assert!(sweep.reaches.len() <= targets.len());
            assert!(is_beside(sweep.relay.at.y_m) && is_flown(sweep.relay.at.altitude_m));
            assert!((1e-6..=1e6).contains(&sweep.relay.power_w));
            let across = sweep.chosen || sweep.relay.at.y_m.to_bits() == 0;
            assert!(across && !(sweep.chosen && sweep.measured_per_w.is_some()));
        }
        Message::Gather(roster) | Message::Gathered(roster) => {
            let indices = roster.seats.iter().map(|seat| seat.index);
            assert!(indices.clone().is_sorted_by(|a, b| a < b));
            assert!(
                indices
                    .clone()
                    .all(|index| index > roster.after && index <= Mission::MAX_RELAYS)
            );
            for seat in &roster.seats {
                assert!(seat.held_m.to_bits() == 0 || is_flown(seat.held_m));
                assert!((1e-6..=1e6).contains(&seat.power_w));
            }
        }
        Message::Sense(hearing) | Message::Sensed(hearing) => {
            assert!(hearing.sums.count() >= 0.0 && hearing.sums.age_s() >= 0.0);
            if let Belief::Source { source, receiver_w } = hearing.told.belief {
                assert!(source.is_valid() && receiver_w >= 0.0);
            }
        }
        Message::Token(token) => {
            assert!(token.place.x_m.is_finite() && token.place.altitude_m > 0.0);
        }
        Message::Moved(moved) => {
            assert!(moved.place.x_m.is_finite() && moved.place.altitude_m > 0.0);
        }
        Message::Verdict(answer) => {
            assert!(answer.verdict.slacks.iter().all(|slack| slack.is_finite()));
            assert!(answer.stand.is_none_or(|x_m| (0.0..=1e6).contains(&x_m)));
        }
        Message::Hello(hello) => {
            assert!(
                hello.neighbour <= Mission::MAX_RELAYS && hello.hears < 16,
                "{hello:?}"
            );
        }
        Message::Proposal(proposal) => {
            let poll = proposal.poll;
            let agreed = poll.agreed;
            assert!(is_count(proposal.place) && is_proposed(proposal.view));
            assert!(agreed.id == ViewId::LOADED || is_proposed(agreed.id));
            assert!(
                is_count(agreed.relays) && poll.votes <= agreed.relays,
                "{poll:?}"
            );
            if let Some(Successor { proposal, view }) = poll.successor {
                assert!(is_proposed(proposal) && is_proposed(view.id) && is_count(view.relays));
            }
        }
        Message::Decision(decision) => {
            assert!(is_count(decision.place) && is_proposed(decision.proposal));
            let base = decision.base;
            assert!(is_count(decision.there) && is_count(base.relays));
            assert!(base.id == ViewId::LOADED || is_proposed(base.id));
            let view = decision.view;
            assert!(view.is_none_or(|view| is_proposed(view.id) && is_count(view.relays)));
        }
        Message::Pulse(pulse) => assert!(pulse.lease > 0),
        Message::Fence { fence, .. } => {
            let across = fence.across;
            let places = [fence.x_m, fence.target_m, across.y_m, across.altitude_m];
            assert!(fence.association != 0 && places.iter().all(|place| place.abs() <= 1e7));
            assert!((0.0..=1e5).contains(&fence.apart_m) && fence.flags < 128);
        }
        Message::Offer { upload, .. } => {
            let same = Mission::try_new(*upload.config()).is_ok();
            assert!(same && upload.version() > 0, "{upload:?}");
        }
        Message::Level { power_w, .. } => assert!((1e-30..=1e6).contains(power_w)),
        Message::Busy { .. }
        | Message::Heartbeat { .. }
        | Message::Pulsed(_)
        | Message::Claim(_) => {}
    }
}

fn is_count(relays: u16) -> bool {
    (1..=Mission::MAX_RELAYS).contains(&relays)
}

fn is_proposed(view: ViewId) -> bool {
    view.number() > 0 && is_count(view.proposer())
}

fn is_target(sir: f32) -> bool {
    (f32::MIN_POSITIVE..=f32::MAX).contains(&sir)
}

fn is_beside(y_m: f32) -> bool {
    y_m.abs() <= 1e5
}

fn is_flown(altitude_m: f32) -> bool {
    (0.1..=1e5).contains(&altitude_m)
}
