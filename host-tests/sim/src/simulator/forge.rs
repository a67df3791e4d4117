//! Forged frames of an attacker that knows the format and the mission. It has received all frames sent, and has no key.

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use uav_relay::CRC_32C;
use uav_relay::SetupError;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::digest::{MissionId, digest};
use uav_relay::wire::frame::{self, HEADER, Header, MAX_FRAME};
use uav_relay::wire::message::{Decision, Hello, Message, Poll, Proposal};
use uav_relay::{
    Auth, Identity, Instant, Interference, Interferer, Key, Mission, MissionConfig, Relay,
    Settings, Upload, Wiring,
};
use uav_relay::{View, ViewId};

/// Network number of every simulated relay.
pub(super) use uav_relay_scenario::deployment::NETWORK;

/// Header flags: a tag follows; the body is a handshake.
const SIGNED: u8 = 0x10;
const HANDSHAKE: u8 = 0x20;

const CHECK: usize = 4;

const HELLO_BODY: usize = 17;

/// Claimed sender and destination of a forged frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Way {
    pub(super) from: u16,
    pub(super) to: u16,
}

/// Returns a frame forged by a random method.
///
/// Methods: untagged false message, false message with a guessed tag, recorded frame with one changed byte and a valid CRC,
/// handshake with a guessed tag, handshake of a relay with another key.
pub(super) fn forge(
    mission: &Mission,
    way: Way,
    heard: Option<&[u8]>,
    rng: &mut ChaCha8Rng,
) -> Vec<u8> {
    let heard = heard.and_then(unsealed);
    match (rng.random_range(0..6), heard) {
        (0, heard) => lie(mission, way, heard, rng),
        (1, heard) => {
            let lie = lie(mission, way, heard, rng);
            let mut plain = unsealed(&lie).unwrap_or_default();
            flag(&mut plain, SIGNED);
            plain.extend(rng.random::<[u8; TAG]>());
            sealed(plain)
        }
        (2 | 3, Some(plain)) => sealed(altered(plain, rng)),
        (4, _) => stranger(mission, way, rng)
            .ok()
            .filter(|said| !said.is_empty())
            .unwrap_or_else(|| guessed_handshake(mission, way, rng)),
        _ => guessed_handshake(mission, way, rng),
    }
}

/// Changes one byte after the header's first eight: of the counter, the body or the tag.
fn altered(mut plain: Vec<u8>, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let at = rng.random_range(HEADER - 2..plain.len().max(HEADER));
    if let Some(byte) = plain.get_mut(at) {
        *byte ^= rng.random_range(1..=u8::MAX);
    }
    plain
}

/// Returns a well-formed, untagged false message: a twisted recorded pass or a new message.
fn lie(mission: &Mission, way: Way, heard: Option<Vec<u8>>, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let twisted = heard.and_then(|plain| twisted(plain, rng));
    twisted.unwrap_or_else(|| made_up(mission, way, rng))
}

/// Returns a recorded pass or reply with false values and a similar number; `None` for other messages.
fn twisted(plain: Vec<u8>, rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
    let whole = with_check(plain);
    let (header, message) = frame::decode(&whole).ok()?;
    let later = |number: u16, rng: &mut ChaCha8Rng| number.wrapping_add(rng.random_range(0..=8));
    let message = match message {
        Message::Sweep(mut sweep) => {
            sweep.number = later(sweep.number, rng);
            // The end of the chain would notice large changes; small ones pass.
            let share = if rng.random() {
                rng.random_range(0.2..1.2)
            } else {
                rng.random_range(0.999..1.001)
            };
            sweep.reaches.iter_mut().for_each(|reach| *reach *= share);
            Message::Sweep(sweep)
        }
        Message::Verdict(mut answer) => {
            answer.number = later(answer.number, rng);
            answer.verdict.commit = Some(0);
            Message::Verdict(answer)
        }
        Message::Gather(mut roster) => {
            roster.number = later(roster.number, rng);
            roster.seats.iter_mut().for_each(|seat| seat.power_w *= 0.5);
            Message::Gather(roster)
        }
        Message::Gathered(mut roster) => {
            roster.number = later(roster.number, rng);
            roster.seats.iter_mut().for_each(|seat| seat.held_m = 50.0);
            Message::Gathered(roster)
        }
        _ => return None,
    };
    let mut frame = [0; MAX_FRAME];
    let len = frame::encode(header, &message, &mut frame);
    Some(frame.get(..len)?.to_vec())
}

/// Returns a false message that needs no recorded frame.
fn made_up(mission: &Mission, way: Way, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let digest = digest(mission);
    let mission_id = MissionId { version: 0, digest };
    let view =
        ViewId::from_bits(rng.random_range(1..=40) << 10 | u32::from(way.from.clamp(1, 1000)));
    let loaded = View {
        id: ViewId::LOADED,
        relays: mission.relays(),
    };
    let place = rng.random_range(1..=mission.relays());
    let message = match (rng.random_range(0..6), better(mission, rng)) {
        (0, _) => Message::Heartbeat {
            mission: digest,
            request: rng.random(),
            reply: rng.random(),
        },
        (1, _) => Message::Busy {
            number: rng.random(),
        },
        (2, _) => Message::Hello(Hello {
            mission: digest,
            latest_view: view,
            neighbour: way.to,
            requests_reply: true,
            requests_view: true,
            fresh: rng.random(),
            ready: true,
            hears: 0x0F,
            behind: place,
            latest_mission: mission_id,
            active: true,
            active_in_view: rng.random(),
            refused: rng.random(),
            offer_number: rng.random(),
        }),
        (3, _) => Message::Proposal(Proposal {
            mission_id,
            proposed_view: view,
            place,
            poll: Poll {
                agreed: loaded,
                votes: place,
                proposer: true,
                lease_left: 0,
                earlier_lease_left: 0,
                successor: None,
            },
        }),
        (4, Some(upload)) => Message::Offer {
            upload,
            offer_number: rng.random(),
        },
        _ => Message::Decision(Decision {
            mission_id,
            proposed_view: view,
            place,
            reached: place,
            base: loaded,
            accepted: rng.random::<bool>().then_some(View {
                id: view,
                relays: rng.random_range(1..=mission.relays()),
            }),
            usable_in: 0,
        }),
    };
    let mut frame = [0; MAX_FRAME];
    let len = frame::encode(header(way, rng), &message, &mut frame);
    frame.get(..len).unwrap_or_default().to_vec()
}

/// Returns a newer-looking mission with another interferer position. `None` in a field, where uploads do not exist.
fn better(mission: &Mission, rng: &mut ChaCha8Rng) -> Option<Upload> {
    let config = mission.config();
    let at = mission.interferer()?;
    let interferer = Interferer {
        power_w: at.power_w,
        x_m: rng.random_range(0.0..=config.distance_m),
        y_m: at.y_m * rng.random_range(0.5..2.0),
    };
    let config = MissionConfig {
        interference: Interference::Source(interferer),
        ..*config
    };
    Upload::new(mission, rng.random_range(1..=3), config).ok()
}

/// Returns a handshake with random nonces and tag.
fn guessed_handshake(mission: &Mission, way: Way, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut plain = unsealed(&made_up(mission, way, rng)).unwrap_or_default();
    plain.truncate(HEADER);
    flag(&mut plain, SIGNED | HANDSHAKE);
    let mut rest = [0; HELLO_BODY + TAG];
    rng.fill_bytes(&mut rest);
    if let Some(asks) = rest.get_mut(HELLO_BODY - 1) {
        *asks = 1;
    }
    plain.extend(rest);
    sealed(plain)
}

/// Returns the first handshake of a relay with another key; empty if it has no neighbour.
fn stranger(mission: &Mission, way: Way, rng: &mut ChaCha8Rng) -> Result<Vec<u8>, SetupError> {
    let settings = Settings {
        wiring: Wiring::Shared,
        auth: Some(Auth {
            key: Key::new(rng.random()),
            epoch: rng.random_range(1..=9),
        }),
        ..Settings::default()
    };
    let identity = Identity {
        network: NETWORK,
        index: way.from,
    };
    let mut relay = Relay::new(*mission, identity, settings, rng.random(), Instant::ZERO)?;
    let mut frame = [0; MAX_FRAME];
    let mut said = Vec::new();
    // One handshake per neighbour; the last one is used.
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(Instant::ZERO, &mut frame) {
        said = frame.get(..transmit.len).unwrap_or_default().to_vec();
    }
    Ok(said)
}

/// Returns the destination node of a frame; `None` for an invalid frame.
pub(super) fn destination(bytes: &[u8]) -> Option<u16> {
    let plain = unsealed(bytes)?;
    let [_, _, low, high, ..] = *plain.first_chunk::<HEADER>()?;
    Some(u16::from_le_bytes([low, high]) & 0x0FFF)
}

fn header(way: Way, rng: &mut ChaCha8Rng) -> Header {
    Header {
        network: NETWORK,
        sender: way.from,
        destination: way.to,
        counter: rng.random(),
    }
}

fn flag(plain: &mut [u8], flags: u8) {
    if let Some(byte) = plain.get_mut(3) {
        *byte |= flags;
    }
}

/// Removes COBS and the CRC; `None` for an invalid frame.
fn unsealed(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut deframer = Deframer::new();
    for &byte in bytes {
        if let Some(frame) = deframer.push(byte) {
            let plain = frame.ok()?;
            return plain
                .split_last_chunk::<CHECK>()
                .map(|(plain, _)| plain.to_vec());
        }
    }
    None
}

/// Appends the CRC, encodes with COBS and appends the delimiter. Accepts at most 249 bytes.
fn sealed(plain: Vec<u8>) -> Vec<u8> {
    let plain = with_check(plain);
    let mut bytes = Vec::with_capacity(plain.len() + 2);
    for run in plain.split(|byte| *byte == 0) {
        bytes.push(u8::try_from(run.len() + 1).unwrap_or(u8::MAX));
        bytes.extend(run);
    }
    bytes.push(0);
    bytes
}

fn with_check(mut plain: Vec<u8>) -> Vec<u8> {
    plain.extend(CRC_32C.checksum(&plain).to_le_bytes());
    plain
}
