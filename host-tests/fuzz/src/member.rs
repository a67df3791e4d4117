//! Neighbour with the network's key. It makes handshakes and signs arbitrary frames.
//!
//! Written from the format, independently of the crate. A handshake has the sender's nonce, the receiver's nonce if
//! known (8 bytes each, little-endian), and a flag that requests an answer.

use blake2::Blake2sMac;
use blake2::digest::consts::U8;
use blake2::digest::{FixedOutput, Mac};
use uav_relay::wire::deframe::Deframer;
use uav_relay::wire::frame::{self, Header, Opened};
use uav_relay_decode::envelope::{before, sealed};

use super::setting::KEY;

/// Header flag of a frame with an authentication tag.
const SIGNED: u16 = 1;

/// Header flag of a handshake.
const HANDSHAKE: u16 = 2;

const NONCE: usize = 8;

/// Length of a handshake's body, bytes: two nonces and a flag.
const HANDSHAKE_BODY: usize = 2 * NONCE + 1;

/// Simulated neighbour that signs frames to the tested relay.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Member {
    key: [u8; 32],
    /// Nonce of this neighbour. It is larger after each restart.
    own: Vec<u8>,
    relay: Vec<u8>,
    counter: u32,
}

impl Member {
    /// Creates a neighbour from the tested relay's handshake `frame`; `None` if `frame` is no handshake.
    pub fn from_handshake(frame: &[u8]) -> Option<Self> {
        let mut deframer = Deframer::new();
        let mut ended = None;
        for &byte in frame {
            if let Some(Ok(plain)) = deframer.push(byte) {
                ended = handshake_in(plain);
            }
        }
        let body = ended.filter(|body| body.len() == HANDSHAKE_BODY)?;
        Some(Self {
            key: KEY,
            own: incremented(&[0; NONCE]),
            relay: body.get(..NONCE)?.to_vec(),
            counter: 0,
        })
    }

    /// Creates a neighbour that has neither sent nor received a handshake.
    pub fn unknown() -> Self {
        Self {
            key: KEY,
            own: incremented(&[0; NONCE]),
            relay: vec![0; NONCE],
            counter: 0,
        }
    }

    /// Returns this neighbour after a restart, with a larger nonce and the frame counter 0.
    pub fn restarted(&self) -> Self {
        Self {
            own: incremented(&self.own),
            counter: 0,
            ..self.clone()
        }
    }

    /// Returns this neighbour with a wrong signing key.
    pub fn with_other_key(&self) -> Self {
        let mut other = self.clone();
        for byte in &mut other.key {
            *byte ^= 1;
        }
        other
    }

    /// Returns this neighbour's next signed frame before COBS.
    pub fn signed(&mut self, header: Header, body: &[u8]) -> Vec<u8> {
        let relay = self.relay.clone();
        self.frame(header, SIGNED, &relay, body)
    }

    /// Returns this neighbour's handshake before COBS. The handshake requests an answer if the tested relay's nonce is
    /// unknown.
    pub fn handshake(&mut self, header: Header) -> Vec<u8> {
        let asks = u8::from(self.relay.iter().all(|&byte| byte == 0));
        let body = [&*self.own, &*self.relay, &[asks]].concat();
        let to = self.relay.clone();
        self.frame(header, SIGNED | HANDSHAKE, &to, &body)
    }

    fn frame(&mut self, header: Header, flags: u16, to: &[u8], body: &[u8]) -> Vec<u8> {
        let counter = self.counter;
        let mut plain = before(Header { counter, ..header }, flags, body);
        self.counter += 1;
        let tag = self.tag(to, &plain);
        plain.extend_from_slice(&tag);
        sealed(plain)
    }

    /// Returns the tag of a frame: keyed BLAKE2s over both nodes' nonces and `signed`, cut to 8 bytes.
    ///
    /// `signed` has the signed bytes, which are header and body of the frame.
    fn tag(&self, to: &[u8], signed: &[u8]) -> [u8; 8] {
        let Ok(mut mac) = Blake2sMac::<U8>::new_from_slice(&self.key) else {
            unreachable!("a key of 32 bytes");
        };
        mac.update(&self.own);
        mac.update(to);
        mac.update(signed);
        mac.finalize_fixed().into()
    }
}

fn handshake_in(plain: &[u8]) -> Option<Vec<u8>> {
    let Opened {
        body, handshake, ..
    } = frame::open(plain).ok()?;
    handshake.then(|| body.to_vec())
}

/// Returns a little-endian number of any length, plus one.
fn incremented(number: &[u8]) -> Vec<u8> {
    let mut carry = true;
    let up = number.iter().map(|&byte| {
        let (sum, over) = byte.overflowing_add(u8::from(carry));
        carry = over;
        sum
    });
    up.collect()
}
