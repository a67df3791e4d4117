//! Peers with the key, by the rules of `FORMAT.md`. Neighbours or ground stations, and a relay that has met them.

use std::ops::{Deref, DerefMut};

use blake2::Blake2sMac;
use blake2::digest::consts::U8;
use blake2::digest::{FixedOutput, Mac};
use host_tests::fixtures::{self, paper};
use host_tests::make;
use serde_json::json;
use uav_relay::MAX_FRAME;
use uav_relay::wire::auth::TAG;
use uav_relay::wire::digest::digest;
use uav_relay::{Duration, Event, Instant, Mission, Port, Relay, Settings, Upload, Wiring};
use uav_relay_decode::envelope::{before, sealed, stuffed};

use super::bench::{counted, events};
use super::message::{WireMessage, plain_of};
use super::votes::{ASKS, hello};

pub(crate) const NOW: Instant = Instant::ZERO;

const KEY: [u8; 32] = *b"whoever reads this is not secret";

/// Flag in a frame's header: an authentication tag follows the body.
const SIGNED: u16 = 1;
/// Flag in a frame's header: the body is a handshake.
const HANDSHAKE: u16 = 2;

/// Returns the settings of a relay with the test's network key.
pub(crate) fn settings(wiring: Wiring) -> Settings {
    Settings {
        wiring,
        auth: Some(make::auth(KEY, 9)),
        ..Settings::default()
    }
}

/// Test bench: a relay with a key, and peers that it has authenticated.
#[derive(Clone, Debug)]
pub(crate) struct SignedBench {
    pub(crate) relay: Relay,
    peers: Vec<Peer>,
    /// Digest of the mission that the relay has before flight.
    pub(crate) base: u16,
}

impl Deref for SignedBench {
    type Target = Relay;

    fn deref(&self) -> &Relay {
        &self.relay
    }
}

impl DerefMut for SignedBench {
    fn deref_mut(&mut self) -> &mut Relay {
        &mut self.relay
    }
}

impl SignedBench {
    /// Creates relay `own` of `mission`, which has nothing more to send. It has authenticated each node of `peers` at the given port.
    pub(crate) fn new(
        mission: Mission,
        own: u16,
        settings: Settings,
        peers: &[(u16, Port)],
    ) -> Self {
        let mut met = Self {
            relay: fixtures::relay(mission, own, settings),
            peers: Vec::new(),
            base: digest(&mission),
        };
        for &(node, port) in peers {
            let peer = Peer::authenticate(&mut met.relay, own, node, port);
            met.peers.push(peer);
        }
        met.sent(NOW);
        met.events();
        met
    }

    /// Creates relay 4 of eight in the paper's scenario. Relay 4 has authenticated both neighbours.
    pub(crate) fn fourth() -> Self {
        Self::fourth_with(settings(Wiring::Pair))
    }

    pub(crate) fn fourth_with(settings: Settings) -> Self {
        let mission = Mission::try_new(paper(8)).unwrap();
        let peers = [(3, Port::Upstream), (5, Port::Downstream)];
        Self::new(mission, 4, settings, &peers)
    }

    /// Delivers a message of peer `peer`. Returns the frames that the relay then sends. A mission offer first gets the number of the
    /// relay's current hello, so that it counts as an answer.
    pub(crate) fn receive(
        &mut self,
        peer: usize,
        message: &WireMessage,
    ) -> Vec<(u16, WireMessage)> {
        if message.is("Offer") {
            let answer = self.offer_number(peer, NOW);
            return self.receive_unchanged(
                peer,
                NOW,
                &message.with(json!({ "offer_number": answer })),
            );
        }
        self.receive_unchanged(peer, NOW, message)
    }

    /// Delivers a message of peer `peer` unchanged. Returns the frames that the relay then sends.
    pub(crate) fn receive_unchanged(
        &mut self,
        peer: usize,
        now: Instant,
        message: &WireMessage,
    ) -> Vec<(u16, WireMessage)> {
        self.deliver(peer, now, message);
        self.sent(now)
    }

    fn deliver(&mut self, peer: usize, now: Instant, message: &WireMessage) {
        let peer = &mut self.peers[peer];
        let frame = peer.frame(SIGNED, message.body());
        self.relay.handle_bytes(now, peer.port, &frame);
    }

    /// Returns the offer number in the relay's next hello to peer `peer`. A mission offer must repeat this number.
    pub(crate) fn offer_number(&self, peer: usize, now: Instant) -> u16 {
        let mut asked = self.clone();
        let node = asked.peers[peer].node;
        let asks = hello(asked.base, 0, (asked.base, 0), ASKS);
        asked.deliver(peer, now, &asks);
        let later = now + Duration::from_millis(1);
        let out = [now, later].map(|at| {
            asked.relay.handle_timeout(at);
            frames(&mut asked.relay, at)
        });
        let hello = out.into_iter().flatten().find_map(|(to, flags, body)| {
            let message = WireMessage::read(&body).ok()?;
            ((to, flags) == (node, SIGNED) && message.is("Hello")).then_some(message)
        });
        hello.unwrap().number("offer_number") as u16
    }

    /// Returns the messages that the relay sends at `now`, each with its destination. Handshakes are left out. The
    /// field `offer_number` of each hello is set to 0, so that tests can compare hellos.
    pub(crate) fn sent(&mut self, now: Instant) -> Vec<(u16, WireMessage)> {
        let unnumbered = |message: WireMessage| {
            if !message.is("Hello") {
                return message;
            }
            assert_ne!(message.number("offer_number"), 0.0);
            message.with(json!({ "offer_number": 0 }))
        };
        frames(&mut self.relay, now)
            .into_iter()
            .filter(|(_, flags, _)| *flags == SIGNED)
            .map(|(to, _, body)| (to, unnumbered(WireMessage::read(&body).unwrap())))
            .collect()
    }

    /// Returns the destinations and messages that the relay sends a millisecond after `now`.
    pub(crate) fn sent_after(&mut self, now: Instant) -> Vec<(u16, WireMessage)> {
        let later = now + Duration::from_millis(1);
        self.relay.handle_timeout(later);
        self.sent(later)
    }

    pub(crate) fn events(&mut self) -> Vec<Event> {
        events(&mut self.relay)
    }

    pub(crate) fn counted(&self) -> Vec<&'static str> {
        counted(self.relay.stats())
    }

    /// Returns the digest and version of the stored uploaded mission; `None` without one.
    pub(crate) fn held(&self) -> Option<(u16, u16)> {
        let mission_id = self.relay.upload().map(Upload::id)?;
        Some((mission_id.digest, mission_id.version))
    }
}

/// Simulated neighbour or ground station with its authenticated session.
#[derive(Clone, Debug)]
struct Peer {
    node: u16,
    relay: u16,
    port: Port,
    /// Nonces of the session: the peer's and the relay's.
    nonces: [u64; 2],
    counter: u32,
}

impl Peer {
    /// Creates peer `node`, and authenticates it and `relay` by handshakes.
    fn authenticate(relay: &mut Relay, own: u16, node: u16, port: Port) -> Self {
        let mut peer = Self {
            node,
            relay: own,
            port,
            nonces: [5 << 32 | 1, 0],
            counter: 0,
        };
        // The peer asks, is answered, and confirms the answer.
        peer.handshake(relay, true);
        let answer = frames(relay, NOW)
            .into_iter()
            .find(|(to, flags, _)| (*to, *flags) == (node, SIGNED | HANDSHAKE));
        let (_, _, body) = answer.unwrap();
        assert_eq!(body.len(), 17);
        peer.nonces[1] = u64::from_le_bytes(body[..8].try_into().unwrap());
        peer.handshake(relay, false);
        assert_eq!(relay.stats().rejected(), 0);
        peer
    }

    fn handshake(&mut self, relay: &mut Relay, asks: bool) {
        let mut body = self.nonces.map(u64::to_le_bytes).concat();
        body.push(u8::from(asks));
        let frame = self.frame(SIGNED | HANDSHAKE, &body);
        relay.handle_bytes(NOW, self.port, &frame);
    }

    fn frame(&mut self, flags: u16, body: &[u8]) -> Vec<u8> {
        let header = make::header(self.node, self.relay, self.counter);
        self.counter += 1;
        let mut bytes = before(header, flags, body);
        let mut mac = Blake2sMac::<U8>::new_from_slice(&KEY).unwrap();
        for nonce in self.nonces {
            mac.update(&nonce.to_le_bytes());
        }
        mac.update(&bytes);
        bytes.extend(mac.finalize_fixed());
        stuffed(&sealed(bytes))
    }
}

/// Returns the destination, flags and body of each frame that `relay` sends at `now`.
fn frames(relay: &mut Relay, now: Instant) -> Vec<(u16, u16, Vec<u8>)> {
    let mut out = Vec::new();
    let mut buffer = [0; MAX_FRAME];
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let plain = plain_of(&buffer[..transmit.len]);
        let second = u16::from_le_bytes([plain[2], plain[3]]);
        let body = plain[10..plain.len() - 4 - TAG].to_vec();
        out.push((second & 0x0FFF, second >> 12, body));
    }
    out
}
