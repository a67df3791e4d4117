//! Whether tags are right: with the key of the network, and the nonces that the handshakes have told.

use std::collections::{HashMap, VecDeque};

use uav_relay::Key;

use crate::frame::Frame;
use crate::value::Value;

/// What is known of a tag.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum TagCheck {
    /// It is right.
    Right,
    /// It is not.
    Wrong,
    /// There is no key.
    NoKey,
    /// The handshakes of these two have not been seen.
    NoHandshake,
}

impl TagCheck {
    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Right => "tag right",
            Self::Wrong => "tag wrong",
            Self::NoKey => "tag not checked: no --key",
            Self::NoHandshake => "tag not checked: no handshake of the two was seen",
        }
    }

    /// One word for it, for programs.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::Wrong => "wrong",
            Self::NoKey => "no_key",
            Self::NoHandshake => "no_handshake",
        }
    }
}

/// How many of the latest nonces of a node toward another are tried: frames of the one before may still be on the way.
const TRIED: usize = 4;

/// What one node is to another in a network.
type Pair = (u16, u16, u16);

/// The nonces of all that have shaken hands.
#[derive(Debug, Default)]
pub struct Members {
    key: Option<Key>,
    nonces: HashMap<Pair, VecDeque<u64>>,
}

impl Members {
    /// Those of a network with this key, if it is known.
    pub fn new(key: Option<[u8; 32]>) -> Self {
        Self {
            key: key.map(Key::new),
            nonces: HashMap::new(),
        }
    }

    /// Whether there is a key.
    pub const fn has_key(&self) -> bool {
        self.key.is_some()
    }

    /// What is known of the tag of `frame`; `None` if it has none. Nonces of a handshake that is right are remembered.
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
