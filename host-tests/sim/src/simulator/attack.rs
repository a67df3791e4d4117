//! Attacker without the key: receives every frame, and sends forged and replayed frames to any relay.

use std::collections::{BTreeMap, VecDeque};

use chacha20::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::wire::auth::TAG;
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::digest::{MissionId, digest};
use uav_relay::wire::frame;
use uav_relay::wire::frame::{HEADER, Header, MAX_FRAME, MAX_SWEEP};
use uav_relay::wire::message::{Decision, Hello, Message, Poll, Proposal};
use uav_relay::{
    Auth, CRC_32C, Identity, Instant, Interference, Interferer, Key, Mission, MissionConfig, Port,
    Relay, Settings, SetupError, Stats, Upload, View, ViewId, Wiring,
};
pub(super) use uav_relay_scenario::deployment::NETWORK;

use super::faults::LinkSpec;

/// Attack on the chain: number of frames of each kind, and time of the last frame.
///
/// The attacker does not know the network key. One half of the frames is sent back to back from the start of the run,
/// the other half at random times.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Attack {
    /// Number of forged frames that the attacker sends.
    pub forged: u32,
    /// Number of recorded frames that the attacker sends again.
    pub replayed: u32,
    /// Time of the attack's last frame. Frames that are sent back to back may end slightly later.
    pub until: Instant,
}

/// Kind of a frame that the attacker sends.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum AttackKind {
    /// A frame that the attacker made or changed.
    Forge,
    /// A recorded frame of a relay, sent again without a change.
    Replay,
}

/// Counts of the attacker's frames by how the receiving relays classified them.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct AttackCounts {
    /// Number of the attacker's frames, by kind and by the counter in [`Stats`] that a frame incremented.
    ///
    /// The counter is one of the receiving relay. The counter `received` counts accepted frames, which the relay
    /// mistook for frames of a neighbour.
    pub counted: BTreeMap<(AttackKind, &'static str), u64>,
}

#[derive(Clone, Debug)]
pub(super) struct Recorded {
    /// Time at which the recorded frame arrives at its receiver; the attacker does not replay it earlier.
    pub(super) arrived: Instant,
    /// Port at which the receiver gets the recorded frame.
    pub(super) port: Port,
    pub(super) bytes: Vec<u8>,
}

#[derive(Debug)]
pub(super) struct Attacker {
    pub(super) attack: Attack,
    /// Random-number generator of the attacker. Its draws do not change those of relays and links.
    pub(super) rng: ChaCha8Rng,
    recorded: VecDeque<Recorded>,
}

const ATTACKER: u64 = 2;

/// Largest number of frames that the attacker records; it discards the oldest.
const MEMORY: usize = 65_536;

/// Number of random picks of a recorded frame, after which the attacker gives up. A pick fails if the frame has not
/// arrived at its receiver yet.
const TRIES: usize = 64;

impl Attacker {
    pub(super) fn new(attack: Attack, seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        rng.set_stream(ATTACKER);
        Self {
            attack,
            rng,
            recorded: VecDeque::new(),
        }
    }

    /// Draws the time and the kind of every frame of the attack; the list is not sorted by time.
    ///
    /// Frames that are sent back to back have intervals equal to the time that `link` needs for a message of maximum
    /// length.
    pub(super) fn plan(&mut self, link: &LinkSpec) -> Vec<(Instant, AttackKind)> {
        let Attack {
            forged,
            replayed,
            until,
        } = self.attack;
        let pause = link.line_time(MAX_SWEEP);
        let mut free = Instant::ZERO;
        let kinds = [(AttackKind::Forge, forged), (AttackKind::Replay, replayed)];
        let all = kinds
            .into_iter()
            .flat_map(|(kind, count)| (0..count).map(move |number| (kind, number)));
        let mut plan = Vec::new();
        for (kind, number) in all {
            let at = if number % 2 == 0 && free < until {
                free = free + pause;
                free
            } else {
                Instant::from_micros(self.rng.random_range(0..=until.as_micros()))
            };
            plan.push((at, kind));
        }
        plan
    }

    pub(super) fn record(&mut self, frame: Recorded) {
        if self.recorded.len() >= MEMORY {
            self.recorded.pop_front();
        }
        self.recorded.push_back(frame);
    }

    /// Returns a random recorded frame that arrived before `now`; `None` if [`TRIES`] picks find none.
    pub(super) fn recall(&mut self, now: Instant) -> Option<Recorded> {
        if self.recorded.is_empty() {
            return None;
        }
        for _ in 0..TRIES {
            let pick = self.rng.random_range(0..self.recorded.len());
            let frame = self.recorded.get(pick)?;
            if frame.arrived < now {
                return Some(frame.clone());
            }
        }
        None
    }
}

/// Returns the name of the counter that a frame has increased from `before` to `after`.
///
/// This counter shows how the receiver classified the frame. If the frame has increased two counters, the result is the
/// reason of the rejection.
pub(super) fn incremented_counter(before: &Stats, after: &Stats) -> &'static str {
    type Counter = (&'static str, fn(&Stats) -> u32);
    // A received but rejected frame increments two counters; the reason for the rejection comes first.
    let counters: [Counter; 16] = [
        ("forged", |stats| stats.forged),
        ("unsigned", |stats| stats.unsigned),
        ("replayed", |stats| stats.replayed),
        ("handshakes", |stats| stats.handshakes),
        ("version", |stats| stats.version),
        ("malformed", |stats| stats.malformed),
        ("foreign", |stats| stats.foreign),
        ("overheard", |stats| stats.overheard),
        ("misaddressed", |stats| stats.misaddressed),
        ("misdirected", |stats| stats.misdirected),
        ("mission", |stats| stats.mission),
        ("view", |stats| stats.view),
        ("stale", |stats| stats.stale),
        ("truncated", |stats| stats.truncated),
        ("crc", |stats| stats.crc),
        ("received", |stats| stats.received),
    ];
    counters
        .into_iter()
        .find(|(_, count)| count(after) > count(before))
        .map_or("oversized", |(name, _)| name)
}

/// Flag in the header of a frame with a tag (signature).
const SIGNED: u8 = 0x10;
/// Flag in the header of a frame that is a handshake.
const HELLO: u8 = 0x20;

const CHECK: usize = 4;

const HELLO_BODY: usize = 17;

/// Sender and destination that a forged frame claims.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct ForgedRoute {
    pub(super) from: u16,
    pub(super) to: u16,
}

/// Returns a frame forged by a random method. `heard` is a recorded frame, if any.
///
/// Methods: false message without a tag; false message with a random tag; recorded frame with one changed byte and a
/// valid CRC; handshake with a random tag; handshake signed with a wrong key.
pub(super) fn forge(
    mission: &Mission,
    way: ForgedRoute,
    heard: Option<&[u8]>,
    rng: &mut ChaCha8Rng,
) -> Vec<u8> {
    let heard = heard.and_then(unsealed);
    match (rng.random_range(0..6), heard) {
        (0, heard) => false_message(mission, way, heard, rng),
        (1, heard) => {
            let lie = false_message(mission, way, heard, rng);
            let mut plain = unsealed(&lie).unwrap_or_default();
            flag(&mut plain, SIGNED);
            plain.extend(rng.random::<[u8; TAG]>());
            sealed(plain)
        }
        (2 | 3, Some(plain)) => sealed(with_altered_byte(plain, rng)),
        (4, _) => foreign_handshake(mission, way, rng)
            .ok()
            .filter(|said| !said.is_empty())
            .unwrap_or_else(|| guessed_handshake(mission, way, rng)),
        _ => guessed_handshake(mission, way, rng),
    }
}

/// Changes one random byte of a frame: in the frame counter, the body or the tag.
///
/// The first eight bytes are not changed.
fn with_altered_byte(mut plain: Vec<u8>, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let at = rng.random_range(HEADER - 2..plain.len().max(HEADER));
    if let Some(byte) = plain.get_mut(at) {
        *byte ^= rng.random_range(1..=u8::MAX);
    }
    plain
}

/// Returns a false message, well-formed and without a tag.
///
/// It is a changed copy of the recorded frame `heard` if that is suitable, otherwise an invented message.
fn false_message(
    mission: &Mission,
    way: ForgedRoute,
    heard: Option<Vec<u8>>,
    rng: &mut ChaCha8Rng,
) -> Vec<u8> {
    let copy = heard.and_then(|plain| altered_copy(plain, rng));
    copy.unwrap_or_else(|| random_message(mission, way, rng))
}

/// Returns a recorded message with changed values, as a new frame. The message keeps its pass number or gets a slightly
/// higher one.
///
/// `None` unless the message is one of a pass along the chain (a sweep or relay profiles), or a reply to it.
fn altered_copy(plain: Vec<u8>, rng: &mut ChaCha8Rng) -> Option<Vec<u8>> {
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

/// Returns a frame with an invented message of a random kind. No recorded frame is needed.
fn random_message(mission: &Mission, way: ForgedRoute, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let digest = digest(mission);
    let mission_id = MissionId { version: 0, digest };
    let view =
        ViewId::from_bits(rng.random_range(1..=40) << 10 | u32::from(way.from.clamp(1, 1000)));
    let loaded = View {
        id: ViewId::LOADED,
        relays: mission.relays(),
    };
    let place = rng.random_range(1..=mission.relays());
    let message = match (rng.random_range(0..6), forged_upload(mission, rng)) {
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
            outside: rng.random(),
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

/// Returns a forged upload: a newer mission in which the interferer is different.
///
/// `None` unless the mission has an interferer, as missions with a random field cannot be uploaded.
fn forged_upload(mission: &Mission, rng: &mut ChaCha8Rng) -> Option<Upload> {
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

/// Returns a handshake with random nonces and a random tag.
fn guessed_handshake(mission: &Mission, way: ForgedRoute, rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut plain = unsealed(&random_message(mission, way, rng)).unwrap_or_default();
    plain.truncate(HEADER);
    flag(&mut plain, SIGNED | HELLO);
    let mut rest = [0; HELLO_BODY + TAG];
    rng.fill_bytes(&mut rest);
    if let Some(asks) = rest.get_mut(HELLO_BODY - 1) {
        *asks = 1;
    }
    plain.extend(rest);
    sealed(plain)
}

/// Returns the handshake of a relay that starts with a random key. Empty if the chain has only one relay.
fn foreign_handshake(
    mission: &Mission,
    way: ForgedRoute,
    rng: &mut ChaCha8Rng,
) -> Result<Vec<u8>, SetupError> {
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

/// Returns the number of the node to which a frame is addressed; `None` for an invalid frame.
pub(super) fn destination(bytes: &[u8]) -> Option<u16> {
    let plain = unsealed(bytes)?;
    let [_, _, low, high, ..] = *plain.first_chunk::<HEADER>()?;
    Some(u16::from_le_bytes([low, high]) & 0x0FFF)
}

fn header(way: ForgedRoute, rng: &mut ChaCha8Rng) -> Header {
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

/// Decodes a frame from COBS and removes its CRC; `None` for an invalid frame.
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

/// Appends the CRC to a frame, encodes it with COBS and appends the delimiter. Accepts at most 249 bytes.
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
