//! Kinds of attacks, and the counter that each must increment according to `FORMAT.md`.

use chacha20::ChaCha8Rng;
use host_tests::fixtures::NETWORK;
use rand::seq::IndexedRandom;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay::{Port, Stats};
use uav_relay_decode::vectors::Vectors;
use uav_relay_oracle::random::seed;

use super::frames::{HANDSHAKE, HEADER, Plain, SIGNED, TAG, handshake, nonce, plain};
use super::net::{Net, RecordedFrame};

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Kind {
    /// Attack: replay of a frame recorded since the last start of both its sender and its receiver.
    Replayed,
    /// Attack: replay of a frame recorded before the last start of its sender or of its receiver.
    FromBefore,
    /// Attack: a recorded frame with flipped bits and a correct CRC.
    Flipped,
    /// Attack: a recorded frame with a changed header field.
    Header,
    /// Attack: a recorded frame without its authentication tag and without the flag for the tag.
    Stripped,
    /// Attack: a recorded frame with a truncated authentication tag.
    Truncated,
    RandomTag,
    /// Attack: a valid message that is signed with another key.
    OtherKey,
    /// Attack: a handshake that is signed with another key and claims the same or a larger epoch.
    ForgedHandshake,
    RecordedHandshake,
    Noise,
    /// Attack: a valid message of any kind without an authentication tag.
    Untagged,
    /// Attack: a valid message of any kind with a random authentication tag.
    AnyWithRandomTag,
    /// Attack: replay to any relay of a mission offer recorded since the last start of both ends.
    ///
    /// The ends are the sender and the receiver of the recorded offer.
    OfferReplayed,
    /// Attack: replay of a mission offer recorded before the last start of its sender or its receiver.
    OfferFromBefore,
    /// Attack: a recorded mission offer with a changed counter, body or tag.
    OfferAltered,
    /// Attack: a forged offer, in the name of any node, of a mission that was never uploaded.
    OfferForged,
    /// Attack: a valid or recorded message that claims to come from the ground station.
    FromGround,
}

pub(crate) const KINDS: [Kind; 18] = [
    Kind::Replayed,
    Kind::FromBefore,
    Kind::Flipped,
    Kind::Header,
    Kind::Stripped,
    Kind::Truncated,
    Kind::RandomTag,
    Kind::OtherKey,
    Kind::ForgedHandshake,
    Kind::RecordedHandshake,
    Kind::Noise,
    Kind::Untagged,
    Kind::AnyWithRandomTag,
    Kind::OfferReplayed,
    Kind::OfferFromBefore,
    Kind::OfferAltered,
    Kind::OfferForged,
    Kind::FromGround,
];

impl Kind {
    /// Returns true if this kind of attack changes or replays a recorded mission offer.
    fn is_of_an_offer(self) -> bool {
        matches!(
            self,
            Self::OfferReplayed | Self::OfferFromBefore | Self::OfferAltered
        )
    }
}

/// Frame that the attacker sends, its receiver, and the counter that the receiver must increment.
pub(crate) struct Attack {
    pub(crate) to: u16,
    pub(crate) port: Port,
    pub(crate) wire: Vec<u8>,
    pub(crate) raises: &'static str,
}

/// Returns the receive counters, with their names. The test judges attacks by these counters.
pub(crate) fn counters(stats: &Stats) -> [(&'static str, u32); 12] {
    [
        ("received", stats.received),
        ("handshakes", stats.handshakes),
        ("overheard", stats.overheard),
        ("oversized", stats.oversized),
        ("truncated", stats.truncated),
        ("crc", stats.crc),
        ("version", stats.version),
        ("unsigned", stats.unsigned),
        ("forged", stats.forged),
        ("replayed", stats.replayed),
        ("foreign", stats.foreign),
        ("misaddressed", stats.misaddressed),
    ]
}

/// Returns the name of the counter that has increased by one, if it is the only changed counter.
///
/// Only the counters that the function `counters` lists are considered.
pub(crate) fn raised(before: &Stats, after: &Stats) -> Option<&'static str> {
    let (mut name, mut ups) = (None, 0);
    for ((of, before), (_, after)) in counters(before).into_iter().zip(counters(after)) {
        if after != before {
            name = Some(of);
            ups += after - before;
        }
    }
    name.filter(|_| ups == 1)
}

/// Returns the name of the counter that a frame with a wrong tag increments at relay `to`. The frame's CRC is right.
fn refused(frame: &Plain, to: u16, port: Port, relays: u16) -> &'static str {
    let flags = frame.flags();
    if frame.version() != 1 || ![0, SIGNED, SIGNED | HANDSHAKE].contains(&flags) {
        return "version";
    }
    if flags != 0 && frame.0.len() < HEADER + TAG {
        return "truncated";
    }
    if frame.network() != NETWORK {
        return "foreign";
    }
    if port == Port::Shared && frame.destination() != to {
        return "overheard";
    }
    let sender = frame.sender();
    // On a shared channel the four nearest nodes of either side are possible senders, and ground stations up to eight numbers away.
    let is_station = sender == 0 || sender == relays + 1;
    let far = match port {
        Port::Shared if is_station => 8,
        Port::Shared => 4,
        _ => 1,
    };
    // The ground stations are beyond the ends.
    let there = sender <= relays + 1 && sender.abs_diff(to) <= far;
    let before = port != Port::Downstream && there && sender < to;
    let after = port != Port::Upstream && there && sender > to;
    if frame.destination() != to || !(before || after) {
        return "misaddressed";
    }
    if flags == 0 { "unsigned" } else { "forged" }
}

/// Random generator of attacks.
pub(crate) struct Attacker {
    pub(crate) rng: ChaCha8Rng,
    /// Valid messages of every kind, each without a frame's header and CRC.
    pub(crate) messages: Vec<Plain>,
}

impl Attacker {
    pub(crate) fn new(stream: u64) -> Self {
        let vectors = Vectors::load().unwrap().frames.into_iter();
        let messages: Vec<Plain> = vectors.map(|vector| Plain(vector.body)).collect();
        let mut kinds: Vec<u8> = messages.iter().map(|message| message.0[0]).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let all: Vec<u8> = (0..=22).collect();
        assert_eq!(kinds, all);
        let mut rng = ChaCha8Rng::seed_from_u64(seed(1));
        rng.set_stream(stream);
        Self { rng, messages }
    }

    /// Creates an attack of kind `kind`; `None` if no suitable frame has been recorded yet.
    pub(crate) fn attack(&mut self, net: &Net, kind: Kind) -> Option<Attack> {
        let heard = if kind.is_of_an_offer() {
            &net.recorded[*net.offers.choose(&mut self.rng)?]
        } else if kind == Kind::RecordedHandshake {
            &net.recorded[*net.handshakes.choose(&mut self.rng)?]
        } else {
            net.recorded.choose(&mut self.rng)?
        };
        let heard = heard.clone();
        let (from, to, made) = match kind {
            Kind::OfferForged | Kind::FromGround => {
                let (from, to, frame) = self.pretended(net, kind, &heard)?;
                (from, to, Some(frame))
            }
            _ => (heard.from, self.target(net, kind, heard.to)?, None),
        };
        // Usually the port of that sender.
        let port = if self.rng.random_bool(0.9) {
            net.port(from, to)
        } else {
            *[Port::Upstream, Port::Downstream]
                .choose(&mut self.rng)
                .filter(|_| net.port(from, to) != Port::Shared)
                .unwrap_or(&Port::Shared)
        };
        if kind == Kind::Noise {
            return Some(self.noise(to, port));
        }
        let (frame, right) = match made {
            Some(frame) => (frame, "forged"),
            None => self.frame(net, kind, &heard)?,
        };
        let raises = match refused(&frame, to, port, net.len()) {
            "forged" => right,
            other => other,
        };
        Some(Attack {
            to,
            port,
            wire: frame.wire(),
            raises,
        })
    }

    /// Returns an attack's frame, and the counter that the receiver increments if the addresses are valid.
    fn frame(
        &mut self,
        net: &Net,
        kind: Kind,
        heard: &RecordedFrame,
    ) -> Option<(Plain, &'static str)> {
        let RecordedFrame {
            from,
            to,
            epochs: starts,
            wire,
            ..
        } = heard;
        let (from, to) = (*from, *to);
        let now = (net.start_count(from), net.start_count(to));
        let recorded = plain(wire);
        let is_handshake = recorded.is_handshake();
        let frame = match kind {
            Kind::Replayed | Kind::FromBefore | Kind::OfferReplayed | Kind::OfferFromBefore => {
                let since = matches!(kind, Kind::Replayed | Kind::OfferReplayed);
                let fits = since == (*starts == now);
                // Frames in transit have not been accepted yet.
                let usable = fits && !is_handshake && net.has_arrived(heard);
                let raises = if net.is_of_current_starts(heard) {
                    "replayed"
                } else {
                    "forged"
                };
                return usable.then_some((recorded, raises));
            }
            Kind::RecordedHandshake => {
                let usable = is_handshake && net.is_proven(from, to) && net.has_arrived(heard);
                return usable.then_some((recorded, "replayed"));
            }
            Kind::Flipped => self.flipped(recorded),
            Kind::Header => self.header(recorded),
            Kind::Stripped => {
                let mut frame = recorded;
                frame.0.truncate(frame.0.len() - TAG);
                frame.set(2, to);
                frame
            }
            Kind::Truncated => {
                let mut frame = recorded;
                let cut = self.rng.random_range(1..=TAG + 4);
                frame.0.truncate(frame.0.len() - cut);
                frame
            }
            Kind::RandomTag => {
                let mut frame = recorded;
                let tag = frame.0.len() - TAG;
                self.rng.fill_bytes(&mut frame.0[tag..]);
                frame
            }
            Kind::OtherKey => {
                let body = self.messages.choose(&mut self.rng)?.0.clone();
                let mut frame = Plain::new(NETWORK, from, to, SIGNED, self.counter(&recorded));
                frame.0.extend(body);
                frame.signed(&self.rng.random(), [nonce(now.0, 1), nonce(now.1, 1)])
            }
            Kind::ForgedHandshake => {
                let epoch = now.0 + self.rng.random_range(0..3);
                let nonces = [nonce(epoch, self.rng.random_range(0..9)), nonce(now.1, 1)];
                let asks = self.rng.random();
                handshake((NETWORK, from, to), self.counter(&recorded), nonces, asks)
                    .signed(&self.rng.random(), nonces)
            }
            Kind::Untagged | Kind::AnyWithRandomTag => {
                let flags = if kind == Kind::Untagged { 0 } else { SIGNED };
                let body = self.messages.choose(&mut self.rng)?.0.clone();
                let mut frame = Plain::new(NETWORK, from, to, flags, self.counter(&recorded));
                frame.0.extend(body);
                if kind == Kind::AnyWithRandomTag {
                    frame.0.extend(self.rng.random::<[u8; TAG]>());
                }
                frame
            }
            Kind::OfferAltered => self.altered(recorded),
            Kind::OfferForged | Kind::FromGround | Kind::Noise => return None,
        };
        Some((frame, "forged"))
    }

    /// Draws a frame counter: the recorded counter, a slightly larger counter or an arbitrary counter.
    pub(crate) fn counter(&mut self, recorded: &Plain) -> u32 {
        match self.rng.random_range(0..3) {
            0 => recorded.counter(),
            1 => recorded
                .counter()
                .saturating_add(self.rng.random_range(1..100)),
            _ => self.rng.random(),
        }
    }

    fn flipped(&mut self, mut frame: Plain) -> Plain {
        let original = frame.clone();
        while frame == original {
            for _ in 0..self.rng.random_range(1..=8) {
                let at = self.rng.random_range(0..frame.0.len());
                frame.0[at] ^= 1 << self.rng.random_range(0..8);
            }
        }
        frame
    }

    fn header(&mut self, mut frame: Plain) -> Plain {
        let original = frame.clone();
        let number = |rng: &mut ChaCha8Rng| {
            if rng.random() {
                rng.random_range(0..10)
            } else {
                rng.random_range(0..4096)
            }
        };
        while frame == original {
            match self.rng.random_range(0..6) {
                0 => frame.set(0, 0x1000 | number(&mut self.rng)),
                1 => frame.set(2, original.flags() | number(&mut self.rng)),
                2 => {
                    let counter = self.counter(&original);
                    frame.0[6..10].copy_from_slice(&counter.to_le_bytes());
                }
                3 => frame.set(4, self.rng.random()),
                4 => frame.set(
                    2,
                    self.rng.random_range(0..16) << 12 | original.destination(),
                ),
                _ => frame.set(0, self.rng.random_range(0..16) << 12 | original.sender()),
            }
        }
        frame
    }

    /// Draws an attack with random bytes in a COBS frame.
    ///
    /// The frame's length determines the counter that the receiver must increment.
    fn noise(&mut self, to: u16, port: Port) -> Attack {
        let len = self.rng.random_range(1..300);
        let bytes: Vec<u8> = (0..len).map(|_| self.rng.random()).collect();
        let mut wire = cobs::encode_vec(&bytes);
        wire.push(0);
        let most = uav_relay::wire::frame::MAX_DECODED;
        let raises = match len {
            ..14 => "truncated",
            _ if len > most => "oversized",
            _ => "crc",
        };
        Attack {
            to,
            port,
            wire,
            raises,
        }
    }
}
