//! Signatures of MAVLink 2: who has the key, and that a frame is not an old one.
//!
//! | byte behind the checksum | what |
//! | --- | --- |
//! | 0 | link: a sender with several links numbers them |
//! | 1 to 6 | stamp: 10 µs since 2015-01-01, little-endian; it rises from frame to frame of a link |
//! | 7 to 12 | the first 6 bytes of SHA-256 over the key, the frame up to its checksum, link and stamp |
//!
//! A frame is taken if its signature is right and its stamp above the last of its sender and link. The first of a sender may be a minute
//! behind the own stamp. What is taken moves the own stamp forward, so two that hear each other have one time.
//!
//! *A board without a clock* begins in 2015. Until it has taken a frame it cannot tell an old one from a new one: one that was recorded may
//! be the first it takes, and those recorded behind it; from the first true one on none is. What it says before that is too old for an autopilot that has
//! the time, which ignores it.

use sha2::{Digest as _, Sha256};

use super::frame::{Address, CHECKSUM, HEADER, SIGNATURE, SIGNED, checksum};
use super::outgoing::FrameBytes;
use super::parser::Received;
use super::table;
use crate::time::{Duration, Instant};

/// Bytes of the hash that are sent.
const TAG: usize = 6;

/// Bytes of link and stamp.
const STAMPED: usize = SIGNATURE - TAG;

/// A minute, in units of a stamp: so far the first frame of a sender may be behind.
const BEHIND: u64 = 6_000_000;

/// The last stamp there is, in the year 2104.
const LAST: u64 = (1 << 48) - 1;

/// Microseconds of a unit.
const UNIT_US: u32 = 10;

/// Seconds from 1970-01-01 to 2015-01-01, where stamps begin.
const BEGIN_S: u64 = 1_420_070_400;

/// Senders that are remembered: what an autopilot passes on from others is signed by them.
const SENDERS: usize = 8;

/// Who has sent, and when last. A sender that is new takes the place of the one whose last frame is the oldest: of that one, frames of the
/// last minute could be played again.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Sender {
    from: Address,
    link: u8,
    /// The least stamp of its next frame; 0 where there is no sender.
    next: u64,
}

/// The time by stamps, on the relay's clock.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stamp(u64);

impl Stamp {
    /// That of a board without a clock.
    pub const UNKNOWN: Self = Self(0);

    /// That of a Unix time.
    pub const fn of_unix_micros(micros: u64) -> Self {
        let units = (micros / UNIT_US as u64).saturating_sub(BEGIN_S * 100_000);
        Self(if units < LAST { units } else { LAST })
    }
}

/// What is wrong with a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flaw {
    /// It is not signed.
    Unsigned,
    /// It is signed with another key.
    Key,
    /// It is of the past, or was taken before.
    Old,
}

/// A key, and what has been signed with it so far.
#[derive(Clone)]
pub struct Signing {
    key: [u8; 32],
    link: u8,
    /// The time by stamps at `at`, and that of the last frame sent.
    stamp: u64,
    at: Instant,
    sent: u64,
    senders: [Sender; SENDERS],
}

impl core::fmt::Debug for Signing {
    /// Without the key, which does not belong into logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Signing(..)")
    }
}

impl Signing {
    /// Signs and checks with `key` on link number `link`; at `now` it is `stamp`.
    pub const fn new(key: [u8; 32], link: u8, stamp: Stamp, now: Instant) -> Self {
        const NOBODY: Sender = Sender {
            from: Address {
                system: 0,
                component: 0,
            },
            link: 0,
            next: 0,
        };
        Self {
            key,
            link,
            stamp: stamp.0,
            at: now,
            sent: 0,
            senders: [NOBODY; SENDERS],
        }
    }

    /// Moves the time on to `now`. An hour at once, of a caller that was away for longer: a division of 64 bits is a kilobyte of flash.
    fn advance(&mut self, now: Instant) {
        let passed = u32::try_from(now.since(self.at).as_micros()).unwrap_or(u32::MAX);
        let units = passed / UNIT_US;
        self.stamp = self.stamp.saturating_add(units.into()).min(LAST);
        self.at = self.at + Duration::from_micros(u64::from(units) * u64::from(UNIT_US));
    }

    /// The same frame, signed. Work: a checksum and a hash of one frame.
    pub fn sign(&mut self, now: Instant, frame: FrameBytes) -> FrameBytes {
        self.advance(now);
        self.sent = self.stamp.max(self.sent.saturating_add(1)).min(LAST);
        let mut frame = frame;
        frame.truncate(frame.len().saturating_sub(CHECKSUM));
        if let Some(flags) = frame.get_mut(2) {
            *flags |= SIGNED;
        }
        let id = frame.first_chunk::<HEADER>().map(|header| {
            let [.., a, b, c] = *header;
            u32::from_le_bytes([a, b, c, 0])
        });
        let covered = frame.get(1..).unwrap_or_default();
        let sum = id
            .and_then(table::find)
            .map_or(0, |known| checksum(covered, known));
        // There is room for it: see `FrameBytes`.
        let _ = frame.extend_from_slice(&sum.to_le_bytes());
        let _ = frame.push(self.link);
        let [stamp @ .., _, _] = self.sent.to_le_bytes();
        let _ = frame.extend_from_slice(&stamp);
        let tag = self.tag(&frame);
        let _ = frame.extend_from_slice(&tag);
        frame
    }

    /// Checks a whole frame. Work: a hash of one frame.
    ///
    /// # Errors
    /// [`Flaw`] says why it is not to be taken.
    pub fn check(&mut self, now: Instant, received: &Received, frame: &[u8]) -> Result<(), Flaw> {
        if !received.is_signed {
            return Err(Flaw::Unsigned);
        }
        self.advance(now);
        let Some((covered, told)) = frame.split_last_chunk::<TAG>() else {
            return Err(Flaw::Key);
        };
        let Some((_, &[link, a, b, c, d, e, f])) = covered.split_last_chunk::<STAMPED>() else {
            return Err(Flaw::Key);
        };
        let stamp = u64::from_le_bytes([a, b, c, d, e, f, 0, 0]);
        let is_it = |sender: &&mut Sender| {
            sender.next > 0 && (sender.from, sender.link) == (received.from, link)
        };
        let known = self.senders.iter_mut().find(is_it).map(|it| it.next);
        let is_new = match known {
            Some(next) => stamp >= next,
            None => stamp.saturating_add(BEHIND) >= self.stamp,
        };
        // First: that the key is another one says more than that the frame is old.
        if !is_same(self.tag(covered), *told) {
            return Err(Flaw::Key);
        }
        if !is_new {
            return Err(Flaw::Old);
        }
        let entry = Sender {
            from: received.from,
            link,
            next: stamp + 1,
        };
        let place = match known {
            Some(_) => self.senders.iter_mut().find(is_it),
            None => self.senders.iter_mut().min_by_key(|it| it.next),
        };
        if let Some(place) = place {
            *place = entry;
        }
        self.stamp = self.stamp.max(stamp);
        Ok(())
    }

    fn tag(&self, covered: &[u8]) -> [u8; TAG] {
        let mut hash = Sha256::new();
        hash.update(self.key);
        hash.update(covered);
        let hash = hash.finalize();
        core::array::from_fn(|at| hash.get(at).copied().unwrap_or_default())
    }
}

/// In the same time wherever they differ.
fn is_same(one: [u8; TAG], other: [u8; TAG]) -> bool {
    let differs = one
        .into_iter()
        .zip(other)
        .fold(0, |all, (a, b)| all | (a ^ b));
    differs == 0
}
