//! Encoding and decoding of frames by the rules of `FORMAT.md`. CRC, COBS and BLAKE2s are of other crates.

use blake2::Blake2sMac;
use blake2::digest::consts::U8;
use blake2::digest::{FixedOutput, Mac};
use crc::{CRC_32_ISCSI, Crc, Table};

pub(crate) const HEADER: usize = 10;
pub(crate) const TAG: usize = 8;
pub(crate) const SIGNED: u16 = 0x1000;
pub(crate) const HANDSHAKE: u16 = 0x2000;

static CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISCSI);

/// Decoded frame: its bytes without COBS encoding, delimiter and CRC.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Plain(pub(crate) Vec<u8>);

/// Decodes an intact frame; panics on a damaged frame.
pub(crate) fn plain(wire: &[u8]) -> Plain {
    let mut bytes = cobs::decode_vec(&wire[..wire.len() - 1]).unwrap();
    let checked = bytes.len() - 4;
    let crc = bytes.split_off(checked);
    assert_eq!(crc, CRC.checksum(&bytes).to_le_bytes());
    Plain(bytes)
}

impl Plain {
    pub(crate) fn new(network: u16, from: u16, to: u16, flags: u16, counter: u32) -> Self {
        let mut bytes = Vec::new();
        bytes.extend((0x1000 | from).to_le_bytes());
        bytes.extend((flags | to).to_le_bytes());
        bytes.extend(network.to_le_bytes());
        bytes.extend(counter.to_le_bytes());
        Self(bytes)
    }

    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.0[at], self.0[at + 1]])
    }

    pub(crate) fn set(&mut self, at: usize, word: u16) {
        self.0[at..at + 2].copy_from_slice(&word.to_le_bytes());
    }

    pub(crate) fn version(&self) -> u16 {
        self.word(0) >> 12
    }

    pub(crate) fn sender(&self) -> u16 {
        self.word(0) & 0x0FFF
    }

    pub(crate) fn flags(&self) -> u16 {
        self.word(2) & 0xF000
    }

    pub(crate) fn destination(&self) -> u16 {
        self.word(2) & 0x0FFF
    }

    pub(crate) fn network(&self) -> u16 {
        self.word(4)
    }

    pub(crate) fn counter(&self) -> u32 {
        u32::from_le_bytes(self.0[6..10].try_into().unwrap())
    }

    pub(crate) fn is_handshake(&self) -> bool {
        self.flags() == SIGNED | HANDSHAKE
    }

    /// Returns the two nonces of a handshake: the sender's and the receiver's.
    pub(crate) fn nonces(&self) -> [u64; 2] {
        [10, 18].map(|at| u64::from_le_bytes(self.0[at..at + 8].try_into().unwrap()))
    }

    /// Appends the authentication tag for `key` and the nonces of sender and receiver.
    pub(crate) fn signed(mut self, key: &[u8; 32], nonces: [u64; 2]) -> Self {
        let tag = tag(key, nonces, &self.0);
        self.0.extend(tag);
        self
    }

    /// Encodes the frame with its CRC.
    pub(crate) fn wire(&self) -> Vec<u8> {
        let mut bytes = self.0.clone();
        bytes.extend(CRC.checksum(&self.0).to_le_bytes());
        let mut wire = cobs::encode_vec(&bytes);
        wire.push(0);
        wire
    }
}

pub(crate) fn tag(key: &[u8; 32], nonces: [u64; 2], signed: &[u8]) -> [u8; TAG] {
    let mut mac = Blake2sMac::<U8>::new_from_slice(key).unwrap();
    for nonce in nonces {
        mac.update(&nonce.to_le_bytes());
    }
    mac.update(signed);
    mac.finalize_fixed().into()
}

/// Creates a handshake frame as a relay does. `addresses` are network, sender and receiver; `asks` requests an
/// answer.
pub(crate) fn handshake(
    addresses: (u16, u16, u16),
    counter: u32,
    nonces: [u64; 2],
    asks: bool,
) -> Plain {
    let (network, from, to) = addresses;
    let mut handshake = Plain::new(network, from, to, SIGNED | HANDSHAKE, counter);
    for nonce in nonces {
        handshake.0.extend(nonce.to_le_bytes());
    }
    handshake.0.push(asks.into());
    handshake
}

/// Returns a handshake nonce: the epoch in the upper half, the number `made` in the lower half.
///
/// `made` is the number of nonces that the node has made before.
pub(crate) fn nonce(epoch: u32, made: u32) -> u64 {
    u64::from(epoch) << 32 | u64::from(made)
}
