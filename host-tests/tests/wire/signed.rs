//! Peer with the key, by the rules of `FORMAT.md`: a neighbour or a ground station.

use blake2::Blake2sMac;
use blake2::digest::consts::U8;
use blake2::digest::{FixedOutput, Mac};
use host_tests::fixtures::{NETWORK, paper};
use uav_relay::MAX_FRAME;
use uav_relay::wire::auth::{Auth, Key, TAG};
use uav_relay::wire::digest::digest;
use uav_relay::{Duration, Identity, Instant, Mission, Port, Relay, Settings, Wiring};

use super::codec::{Greeting, Said, header, sealed, wire};
use super::stream::unstuffed;
use super::votes::{ASKS, unnumbered};
use uav_relay::wire::frame::Header;

const KEY: [u8; 32] = *b"whoever reads this is not secret";

/// Flags in byte 3: a tag follows, and the body is a handshake.
const SIGNED: u8 = 0x10;
const HANDSHAKE: u8 = 0x20;

/// Returns relay `index` of eight in the paper's scenario, with the key.
pub(crate) fn with_key(index: u16, wiring: Wiring) -> Relay {
    let mission = Mission::try_new(paper(8)).unwrap();
    let (identity, settings) = set(index, wiring);
    Relay::new(mission, identity, settings, 1, Instant::ZERO).unwrap()
}

/// Returns the identity and settings of relay `index` with the key.
pub(crate) fn set(index: u16, wiring: Wiring) -> (Identity, Settings) {
    let identity = Identity {
        network: NETWORK,
        index,
    };
    let settings = Settings {
        wiring,
        auth: Some(Auth {
            key: Key::new(KEY),
            epoch: 9,
        }),
        ..Settings::default()
    };
    (identity, settings)
}

/// Peer node with its session.
#[derive(Clone, Debug)]
pub(crate) struct Peer {
    node: u16,
    relay: u16,
    port: Port,
    /// Nonces of the peer and the relay.
    nonces: [u64; 2],
    counter: u32,
    /// Digest of the mission loaded at the relay.
    base: u16,
}

impl Peer {
    /// Creates a peer `node` and authenticates it with `relay`.
    pub(crate) fn meets(relay: &mut Relay, own: u16, node: u16, port: Port) -> Self {
        let mut peer = Self {
            node,
            relay: own,
            port,
            nonces: [5 << 32 | 1, 0],
            counter: 0,
            base: digest(relay.mission()),
        };
        // The peer asks, is answered, and confirms the answer.
        peer.handshake(relay, true);
        let answer = frames(relay, Instant::ZERO)
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
        let mut body: Vec<u8> = self
            .nonces
            .iter()
            .copied()
            .flat_map(u64::to_le_bytes)
            .collect();
        body.push(u8::from(asks));
        let frame = self.frame(SIGNED | HANDSHAKE, &body);
        relay.handle_bytes(Instant::ZERO, self.port, &frame);
    }

    fn frame(&mut self, flags: u8, body: &[u8]) -> Vec<u8> {
        let mut bytes = header(Header {
            network: NETWORK,
            sender: self.node,
            destination: self.relay,
            counter: self.counter,
        });
        self.counter += 1;
        bytes[3] |= flags;
        bytes.extend(body);
        let mut mac = Blake2sMac::<U8>::new_from_slice(&KEY).unwrap();
        for nonce in self.nonces {
            mac.update(&nonce.to_le_bytes());
        }
        mac.update(&bytes);
        bytes.extend(mac.finalize_fixed());
        wire(&sealed(bytes))
    }

    /// Sends a message to the relay; an offer answers the relay's current hello.
    pub(crate) fn says(&mut self, relay: &mut Relay, now: Instant, said: &Said) {
        let mut said = said.clone();
        if let Said::Offer(offer) = &mut said {
            offer.offer_number = self.clone().number(relay.clone(), now);
        }
        self.says_as_it_is(relay, now, &said);
    }

    /// Returns the number of the hello with which `relay` answers a request.
    pub(crate) fn number(&mut self, mut relay: Relay, now: Instant) -> u16 {
        let mission = self.base;
        let asks = Said::Hello(Greeting {
            mission,
            neighbour: 0,
            behind: 1,
            latest_view: 0,
            latest_mission: (mission, 0),
            offer_number: 0,
            hears: 0,
            flags: ASKS,
        });
        self.says_as_it_is(&mut relay, now, &asks);
        let later = now + Duration::from_millis(1);
        let out = [now, later].map(|at| {
            relay.handle_timeout(at);
            frames(&mut relay, at)
        });
        let hello =
            out.into_iter()
                .flatten()
                .find_map(|(to, flags, body)| match Said::read(&body) {
                    Ok(Said::Hello(hello)) if (to, flags) == (self.node, SIGNED) => Some(hello),
                    _ => None,
                });
        hello.unwrap().offer_number
    }

    /// Sends a message unchanged.
    pub(crate) fn says_as_it_is(&mut self, relay: &mut Relay, now: Instant, said: &Said) {
        let frame = self.frame(SIGNED, &said.body());
        relay.handle_bytes(now, self.port, &frame);
    }
}

/// Returns destination, flags and body of all frames that `relay` sends at `now`.
fn frames(relay: &mut Relay, now: Instant) -> Vec<(u16, u8, Vec<u8>)> {
    let mut out = Vec::new();
    let mut buffer = [0; MAX_FRAME];
    relay.persist(|_| true);
    while let Some(transmit) = relay.poll_transmit(now, &mut buffer) {
        let plain = unstuffed(&buffer[..transmit.len - 1]).unwrap();
        let to = u16::from_le_bytes([plain[2], plain[3]]) & 0x0FFF;
        let body = plain[10..plain.len() - 4 - TAG].to_vec();
        out.push((to, plain[3] & 0xF0, body));
    }
    out
}

/// Returns the messages that `relay` sends at `now`, without handshakes and hello numbers.
pub(crate) fn said(relay: &mut Relay, now: Instant) -> Vec<(u16, Said)> {
    frames(relay, now)
        .into_iter()
        .filter(|(_, flags, _)| *flags == SIGNED)
        .map(|(to, _, body)| (to, unnumbered(Said::read(&body).unwrap())))
        .collect()
}
