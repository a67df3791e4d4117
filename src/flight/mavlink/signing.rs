//! MAVLink 2 signatures: authentication and replay protection.
//!
//! | byte after the checksum | content |
//! | --- | --- |
//! | 0 | link id, for a sender with several links |
//! | 1 to 6 | timestamp: 10 µs units since 2015-01-01, little-endian; it rises from frame to frame of a link |
//! | 7 to 12 | first 6 bytes of SHA-256 over the key, the frame up to its checksum, link id and timestamp |
//!
//! A frame is accepted if its signature is right and its timestamp is above the last one of its sender and link. The
//! first timestamp of a sender may be up to a minute behind this link's time. An accepted timestamp advances this
//! link's time, so both ends share one time.
//!
//! *A board without a clock* starts in 2015. Until it has accepted a frame it cannot distinguish an old one from a new
//! one, so a replayed recording may be accepted first. After the first current frame none is. Its frames before that
//! are too old for an autopilot with a clock, which ignores them.

use sha2::{Digest as _, Sha256};

use super::frame::{Address, CHECKSUM, HEADER, SIGNATURE, SIGNED, checksum, find_known};
use super::incoming::Received;
use super::outgoing::FrameBytes;
use crate::time::{Duration, Instant};

/// Length of a signature's truncated hash, bytes.
const TAG: usize = 6;

/// Length of the link id and the timestamp in a signature, bytes.
const STAMPED: usize = SIGNATURE - TAG;

/// Maximum age of a frame from a sender not received before, in timestamp units of 10 µs: one minute.
const BEHIND: u64 = 6_000_000;

/// Maximum timestamp of a signature, in the year 2104.
const LAST: u64 = (1 << 48) - 1;

const UNIT_US: u32 = 10;

/// Time from 1970-01-01 to 2015-01-01, s. The timestamps of signatures count from 2015-01-01.
const BEGIN_S: u64 = 1_420_070_400;

/// Number of senders whose last timestamps are stored: the autopilot and others. The autopilot forwards signed frames
/// of other systems.
const SENDERS: usize = 8;

/// Sender of signed frames, with the minimum timestamp of its next frame, which prevents replays.
///
/// If [`SENDERS`] senders are stored, a new sender replaces the sender with the oldest timestamp. An attacker could
/// then replay recorded frames of the replaced sender, if they are at most a minute old.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
struct Sender {
    from: Address,
    link: u8,
    /// Minimum timestamp of the sender's next frame; 0 for an unused entry.
    next: u64,
}

/// Timestamp of a signature: time since 2015-01-01 in units of 10 µs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Stamp(u64);

impl Stamp {
    /// Timestamp on a board that does not know the date and time.
    pub const UNKNOWN: Self = Self(0);

    /// Returns the timestamp of a Unix time, µs since 1970-01-01.
    pub const fn of_unix_micros(micros: u64) -> Self {
        let units = (micros / UNIT_US as u64).saturating_sub(BEGIN_S * 100_000);
        Self(if units < LAST { units } else { LAST })
    }
}

/// Reason why the signature of a received MAVLink frame is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Flaw {
    /// The received MAVLink frame has no signature.
    Unsigned,
    /// The signature was made with a different key than the link's, or the frame was altered.
    Key,
    /// The signature's timestamp is too old, or not above that of the sender's last accepted frame.
    Old,
}

/// Signing of MAVLink frames: the key, and the state of the timestamps.
#[derive(Clone)]
pub struct Signing {
    key: [u8; 32],
    link: u8,
    /// Timestamp that belongs to the time `at` of this link's clock, in units of 10 µs.
    stamp: u64,
    at: Instant,
    /// Timestamp of the last sent frame, in units of 10 µs.
    sent: u64,
    senders: [Sender; SENDERS],
}

impl core::fmt::Debug for Signing {
    /// Writes a placeholder, because the key must not appear in logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Signing(..)")
    }
}

impl Signing {
    /// Creates the signing state with the key `key` and the link id `link`. `stamp` is the timestamp that belongs to
    /// the time `now`.
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

    /// Advances this link's timestamp toward `now`, by about an hour at most. After a longer time several calls are
    /// needed.
    fn advance(&mut self, now: Instant) {
        let passed = u32::try_from(now.since(self.at).as_micros()).unwrap_or(u32::MAX);
        let units = passed / UNIT_US;
        self.stamp = self.stamp.saturating_add(units.into()).min(LAST);
        self.at = self.at + Duration::from_micros(u64::from(units) * u64::from(UNIT_US));
    }

    /// Returns `frame` with a signature. Work: a checksum and a hash of one frame.
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
            .and_then(find_known)
            .map_or(0, |known| checksum(covered, known));
        // `FrameBytes` has room for the signature.
        let _ = frame.extend_from_slice(&sum.to_le_bytes());
        let _ = frame.push(self.link);
        let [stamp @ .., _, _] = self.sent.to_le_bytes();
        let _ = frame.extend_from_slice(&stamp);
        let tag = self.tag(&frame);
        let _ = frame.extend_from_slice(&tag);
        frame
    }

    /// Checks the signature of a received frame. Work: a hash of one frame.
    ///
    /// # Errors
    /// [`Flaw`] states why the frame is rejected.
    pub fn check(&mut self, now: Instant, received: &Received, frame: &[u8]) -> Result<(), Flaw> {
        if !received.is_signed {
            return Err(Flaw::Unsigned);
        }
        self.advance(now);
        let Some((covered, tag)) = frame.split_last_chunk::<TAG>() else {
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
        // The key is checked first, because a wrong key is more informative than an old timestamp.
        if !is_same(self.tag(covered), *tag) {
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

/// Returns true if two truncated hashes are equal. The comparison takes constant time, against timing attacks.
fn is_same(one: [u8; TAG], other: [u8; TAG]) -> bool {
    let differs = one
        .into_iter()
        .zip(other)
        .fold(0, |all, (a, b)| all | (a ^ b));
    differs == 0
}
