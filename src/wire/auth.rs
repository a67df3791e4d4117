//! Authentication of frames: the tag, and replay protection by counters.
//!
//! The tag is keyed BLAKE2s (RFC 7693) over the nonces of both ends, the header and the body, with a digest of eight bytes. We
//! use a MAC and not a cipher, because anyone who sees the drones knows their positions, and because a MAC remains secure even if
//! a counter is used twice, which a stream cipher does not.

use super::blake2s::mac;
use crate::features::AUTH;

/// Length of the authentication tag at the end of a signed frame, bytes.
pub const TAG: usize = 8;

/// Number of bytes reserved in a frame for an authentication tag; 0 without the feature `auth`.
pub(crate) const TAG_ROOM: usize = if AUTH { TAG } else { 0 };

/// Secret key that the nodes of a network share, for the authentication of frames.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl Key {
    /// Creates a key from `bytes`, 256 random bits. Do not use a password.
    pub const fn new(bytes: [u8; 32]) -> Self {
        Self(bytes)
    }

    /// Returns the authentication tag for `signed`, the header and body of a frame. `sender` and `receiver` are the
    /// nonces of the frame's sender and receiver.
    ///
    /// Work: two to five blocks of BLAKE2s.
    pub fn tag(&self, sender: u64, receiver: u64, signed: &[u8]) -> [u8; TAG] {
        let both = u128::from(receiver) << 64 | u128::from(sender);
        mac(&self.0, &both.to_le_bytes(), signed)
    }
}

impl core::fmt::Debug for Key {
    /// Formats the key without its bytes, since keys must not appear in logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Key(..)")
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for Key {
    fn format(&self, fmt: defmt::Formatter<'_>) {
        defmt::write!(fmt, "Key(..)");
    }
}

/// Credentials of a relay for signing its frames.
///
/// ```
/// use uav_relay::{Auth, Key, Settings};
///
/// // The network's key, and a number that increases at every start.
/// let auth = Auth { key: Key::new([7; 32]), epoch: 41 };
/// let settings = Settings { auth: Some(auth), ..Settings::default() };
/// # assert!(settings.auth.is_some());
/// ```
#[cfg(feature = "auth")]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Auth {
    /// Secret key that authenticates the frames of the network.
    pub key: Key,
    /// Start counter of this relay, from 1, larger at every start. Use a number in flash that is incremented before
    /// use, or the seconds of a clock that never runs backward. If an epoch is reused, frames that were recorded in
    /// this epoch are accepted again.
    pub epoch: u32,
}

#[cfg(feature = "auth")]
impl Auth {
    pub(crate) const fn parts(self) -> (Key, u32) {
        (self.key, self.epoch)
    }
}

/// Credentials of a relay. The type is uninhabited without the feature `auth`, so that the compiler drops all code
/// that signs.
#[cfg(not(feature = "auth"))]
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Auth {}

#[cfg(not(feature = "auth"))]
impl Auth {
    pub(crate) const fn parts(self) -> (Key, u32) {
        match self {}
    }
}

/// Nonces of a frame's sender and receiver. The upper half of a nonce is the node's epoch (start counter); the lower
/// half counts up from a random number.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct Nonces {
    pub(crate) sender: u64,
    /// Nonce of the receiver; 0 in a handshake whose sender does not know it yet.
    pub(crate) receiver: u64,
}

impl Nonces {
    pub(crate) const fn turned(self) -> Self {
        Self {
            sender: self.receiver,
            receiver: self.sender,
        }
    }
}

/// Key and nonces with which one node signs its frames to a second node.
#[derive(Clone, Copy)]
pub(crate) struct Signer<'a> {
    pub(crate) key: &'a Key,
    pub(crate) nonces: Nonces,
}

impl Signer<'_> {
    pub(crate) fn tag(self, signed: &[u8]) -> [u8; TAG] {
        let Nonces { sender, receiver } = self.nonces;
        self.key.tag(sender, receiver, signed)
    }
}

/// Returns true if two authentication tags are equal, in constant time.
pub(crate) fn is_same(one: [u8; TAG], other: [u8; TAG]) -> bool {
    u64::from_le_bytes(one) ^ u64::from_le_bytes(other) == 0
}

/// Replay protection for one sender: the frame counters that were accepted. The type stores the newest accepted frame
/// counter, and a flag for each of the 63 counters below that one.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[repr(C, packed(4))] // 12 bytes; a relay has eight of them
pub(crate) struct Window {
    /// Largest accepted frame counter of the sender, plus one; 0 if none was accepted.
    next: u32,
    /// Accepted frame counters, as bits: bit i stands for `next` - 1 - i.
    taken: u64,
}

impl Window {
    /// Accepts a frame's `counter` once. Returns false if the counter was accepted before, is below the window, or is
    /// `u32::MAX`.
    pub(crate) const fn accept(&mut self, counter: u32) -> bool {
        let Some(next) = counter.checked_add(1) else {
            return false;
        };
        if next > self.next {
            let ahead = next - self.next;
            self.taken = if ahead < 64 { self.taken << ahead } else { 0 } | 1;
            self.next = next;
            return true;
        }
        let behind = self.next - next;
        if behind >= 64 || self.taken >> behind & 1 == 1 {
            return false;
        }
        self.taken |= 1 << behind;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::Window;
    use std::collections::BTreeSet;

    extern crate std;

    #[test]
    fn each_counter_is_accepted_once_and_up_to_63_late() {
        let mut state = 1_u32;
        let mut random = |below: u32| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) % below
        };
        let (mut window, mut seen, mut largest, mut late) =
            (Window::default(), BTreeSet::new(), 0_u32, 0);
        for _ in 0..200_000 {
            let counter = (largest + random(40)).saturating_sub(random(120));
            let fresh = !seen.contains(&counter) && (seen.is_empty() || counter + 63 >= largest);
            assert_eq!(window.accept(counter), fresh, "{counter} after {largest}");
            if fresh {
                seen.insert(counter);
                late += u32::from(counter < largest);
                largest = largest.max(counter);
            }
        }
        assert!(late > 1000 && seen.len() > 10_000);
    }

    #[test]
    fn the_last_counter_is_never_accepted() {
        let mut window = Window::default();
        assert!(!window.accept(u32::MAX));
        assert!(window.accept(u32::MAX - 1) && !window.accept(u32::MAX - 1));
        assert!(!window.accept(0), "far too old");
    }
}
