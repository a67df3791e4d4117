//! Verifies authentication tags with the network key and the nonces of captured handshakes.

use std::collections::{HashMap, VecDeque};

use uav_relay::Key;

use crate::frame::Frame;
use crate::value::Value;

/// Result of verifying the authentication tag of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TagCheck {
    /// The tag is right.
    Right,
    /// The tag is wrong.
    Wrong,
    /// The tag was not checked, because the network key is unknown.
    NoKey,
    /// The tag was not checked, because no handshake between sender and destination was captured.
    NoHandshake,
}

impl TagCheck {
    /// Returns the result of the tag's check as a sentence for people.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Right => "tag right",
            Self::Wrong => "tag wrong",
            Self::NoKey => "tag not checked: give --key",
            Self::NoHandshake => "tag not checked: the capture has no handshake of these two nodes",
        }
    }

    /// Returns the result of the tag's check as one word, for programs.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Wrong => "wrong",
            Self::NoKey => "no_key",
            Self::NoHandshake => "no_handshake",
        }
    }
}

/// Number of newest nonces stored for a node. A tag counts as right if it is right with any of them.
///
/// The newest nonce alone is not enough: a frame signed before a handshake can arrive after the handshake.
const TRIED: usize = 4;

/// Key under which nonces are stored: the numbers of network, sender and destination.
type Pair = (u16, u16, u16);

/// Verifier of authentication tags, with the nonces of all captured handshakes.
#[derive(Debug, Default)]
pub struct TagVerifier {
    key: Option<Key>,
    nonces: HashMap<Pair, VecDeque<u64>>,
}

impl TagVerifier {
    /// Creates a verifier without nonces. `key` is the network key, if known.
    pub fn new(key: Option<[u8; 32]>) -> Self {
        Self {
            key: key.map(Key::new),
            nonces: HashMap::new(),
        }
    }

    /// Returns true if the network key is known.
    pub const fn has_key(&self) -> bool {
        self.key.is_some()
    }

    /// Verifies the tag of `frame`, if it has one. Stores the nonces of valid handshakes.
    pub fn check(&mut self, frame: &Frame<'_>) -> Option<TagCheck> {
        let (signed, tag) = frame.tag.as_ref()?;
        let Some(key) = &self.key else {
            return Some(TagCheck::NoKey);
        };
        let header = frame.header?;
        let ahead = (header.network, header.sender, header.destination);
        let back = (header.network, header.destination, header.sender);
        if frame.handshake {
            let nonce = |name| match frame.fields.get(name) {
                Some(Value::Unsigned(nonce)) => *nonce,
                _ => 0,
            };
            let (own, other) = (nonce("sender_nonce"), nonce("receiver_nonce"));
            if key.tag(own, other, signed) != *tag {
                return Some(TagCheck::Wrong);
            }
            self.learn(ahead, own);
            self.learn(back, other);
            return Some(TagCheck::Right);
        }
        let (Some(own), Some(others)) = (self.nonces.get(&ahead), self.nonces.get(&back)) else {
            return Some(TagCheck::NoHandshake);
        };
        let right = own.iter().rev().any(|own| {
            let mut others = others.iter().rev();
            others.any(|other| key.tag(*own, *other, signed) == *tag)
        });
        Some(if right {
            TagCheck::Right
        } else {
            TagCheck::Wrong
        })
    }

    fn learn(&mut self, pair: Pair, nonce: u64) {
        let known = self.nonces.entry(pair).or_default();
        if nonce == 0 || known.contains(&nonce) {
            return;
        }
        if known.len() >= TRIED {
            known.pop_front();
        }
        known.push_back(nonce);
    }
}
