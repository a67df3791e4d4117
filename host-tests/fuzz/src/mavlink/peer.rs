//! Signing autopilot, and an attacker without its key.
//!
//! The expected reaction of a link with a key follows from the definition of MAVLink's signatures.

use sha2::{Digest as _, Sha256};
use uav_relay::Instant;
use uav_relay::flight::autopilot::{Signing, Stamp};
use uav_relay::flight::mavlink::incoming::{Incoming, Parser, Received};

use crate::input::Input;

const KEY: [u8; 32] = *b"the key is the autopilot's alone";
const OTHER: [u8; 32] = *b"somebody without it has this one";

/// Length of a MAVLink signature, bytes: link number, timestamp and tag.
const SIGNATURE: usize = 13;

/// Largest timestamp of a signature, in units of 10 µs since 2015-01-01.
const LAST: u64 = (1 << 48) - 1;
/// A minute in units of 10 µs.
const MINUTE: u64 = 6_000_000;
/// Number of senders that a link remembers.
const SENDERS: usize = 8;

/// Time 2015-01-01, from which timestamps count, µs since 1970-01-01.
const BEGIN_US: u64 = 1_420_070_400_000_000;
/// Timestamp of 2026-11-22 in a signature, in units of 10 µs since 2015-01-01.
const TODAY: u64 = 37_527_840_000_000;

const HISTORY: usize = 32;

/// Sender (system, component and link number), and the timestamp of its last accepted frame.
type Sender = ((u8, u8, u8), u64);

#[derive(Debug)]
pub(super) struct Peer {
    /// Timestamp of the simulated autopilot, in units of 10 µs since 2015-01-01.
    stamp: u64,
    /// Newest signed frames of the autopilot, for replays.
    history: Vec<Vec<u8>>,
    /// Clock that the tested link should have at the time `at`, in units of 10 µs since 2015-01-01.
    time: u64,
    at: Instant,
    /// Senders, with timestamps, that the tested link should remember.
    senders: Vec<Sender>,
    /// Timestamp of the last frame that the tested link sent.
    sent: u64,
    parser: Parser,
    pub(super) refused: u32,
}

impl Peer {
    /// Creates the autopilot's end of a signed link, and the signing settings of the tested link.
    ///
    /// `input` decides if the tested link knows the date at its start.
    pub(super) fn new(input: &mut Input<'_>, now: Instant) -> (Self, Signing) {
        let time = match input.below(4) {
            0 => 0,
            1 => LAST - u64::from(input.word()),
            _ => TODAY,
        };
        let stamp = match time {
            0 => Stamp::UNKNOWN,
            time => Stamp::of_unix_micros(BEGIN_US + 10 * time),
        };
        let peer = Self {
            stamp: TODAY,
            history: Vec::new(),
            time,
            at: now,
            senders: Vec::new(),
            sent: 0,
            parser: Parser::new(),
            refused: 0,
        };
        (peer, Signing::new(KEY, 3, stamp, now))
    }

    /// Signs a frame of the autopilot, in most cases correctly.
    ///
    /// In the other cases the frame stays unsigned, has a wrong key or an old timestamp, is damaged, or is replaced by
    /// an earlier frame.
    pub(super) fn sign_frame(&mut self, input: &mut Input<'_>, frame: &[u8]) -> Vec<u8> {
        let how = input.byte();
        let (key, link) = match how {
            // There are ten link numbers, but the tested link remembers only eight senders.
            160..192 => (KEY, how % 10),
            192..208 => (OTHER, 0),
            208..216 => return frame.to_vec(),
            _ => (KEY, 0),
        };
        self.stamp = match how {
            216..224 => self.stamp.saturating_sub(u64::from(input.long())),
            224..232 => self.stamp.saturating_add(u64::from(input.long())),
            _ => self.stamp.saturating_add(u64::from(how % 4) * 10_000 + 1),
        }
        .min(LAST);
        let mut frame = signed(key, frame, link, self.stamp);
        match how {
            232..240 => {
                let at = frame.len() - 1 - usize::from(input.byte()) % SIGNATURE;
                if let Some(byte) = frame.get_mut(at) {
                    *byte ^= input.byte().max(1);
                }
            }
            240..=255 => {
                if let Some(old) = self.recorded_frame(input) {
                    return old;
                }
            }
            _ => {}
        }
        if self.history.len() == HISTORY {
            self.history.remove(0);
        }
        self.history.push(frame.clone());
        frame
    }

    pub(super) fn recorded_frame(&self, input: &mut Input<'_>) -> Option<Vec<u8>> {
        let at = usize::from(input.byte()) % self.history.len().max(1);
        self.history.get(at).cloned()
    }

    /// Sets the autopilot's clock to a different time.
    ///
    /// The new time is a day earlier or later, near the time of the tested link, or the largest timestamp.
    pub(super) fn set_clock(&mut self, input: &mut Input<'_>) {
        const DAY: u64 = 8_640_000_000;
        self.stamp = match input.below(6) {
            0 => self.stamp.saturating_sub(DAY),
            1 => self.stamp.saturating_add(DAY).min(LAST),
            2 => self.time,
            3 => self.time.saturating_sub(MINUTE),
            4 => self.time.saturating_sub(MINUTE + 1),
            _ => LAST,
        };
    }

    /// Processes the bytes delivered to the tested link. Counts in `refused` the frames that the link must reject.
    pub(super) fn expect_bytes(&mut self, now: Instant, bytes: &[u8]) {
        let mut parser = self.parser.clone();
        for &byte in bytes {
            parser.push(byte);
            while let Some(taken) =
                parser.next_frame(|received, frame| self.accepts(now, &received, frame))
            {
                self.refused = self.refused.saturating_add(u32::from(!taken));
            }
        }
        self.parser = parser;
    }

    fn accepts(&mut self, now: Instant, received: &Received, frame: &[u8]) -> bool {
        match received.message {
            // Unknown messages and messages of a radio need no signature.
            None | Some(Incoming::RadioStatus { .. }) => return true,
            Some(_) => {}
        }
        if !received.is_signed {
            return false;
        }
        self.advance(now);
        let Some((_, [link, stamp @ ..])) = frame.split_last_chunk::<SIGNATURE>() else {
            return false;
        };
        let stamp = read(stamp);
        let sender = (received.from.system, received.from.component, *link);
        let last = self.senders.iter().position(|(known, _)| *known == sender);
        let is_new = match last.and_then(|at| self.senders.get(at)) {
            Some((_, last)) => stamp > *last,
            None => stamp + MINUTE >= self.time,
        };
        let unsigned = frame.get(..frame.len() - SIGNATURE).unwrap_or_default();
        if frame != sealed(KEY, unsigned, *link, stamp) || !is_new {
            return false;
        }
        // If several senders have the same timestamp, the one that was stored first is replaced.
        let oldest = || {
            let places = (0..).zip(&self.senders);
            let oldest = places.min_by_key(|(_, (_, last))| *last);
            oldest.filter(|_| self.senders.len() == SENDERS)
        };
        match last.or_else(|| oldest().map(|(at, _)| at)) {
            Some(at) => {
                if let Some(place) = self.senders.get_mut(at) {
                    *place = (sender, stamp);
                }
            }
            None => self.senders.push((sender, stamp)),
        }
        self.time = self.time.max(stamp);
        true
    }

    /// Advances the expected clock of the tested link to `now`, by at most 71 minutes (2^32 µs).
    ///
    /// The link's clock has the same limit.
    fn advance(&mut self, now: Instant) {
        let passed = now.since(self.at).as_micros().min(u64::from(u32::MAX)) / 10;
        self.time = self.time.saturating_add(passed).min(LAST);
        self.at = self.at + uav_relay::Duration::from_micros(10 * passed);
    }

    /// Checks the signature of a frame sent by the tested link at `now`. Returns the frame without the signature.
    ///
    /// # Panics
    /// The signature is wrong.
    pub(super) fn check_sent(&mut self, now: Instant, frame: &[u8]) -> Vec<u8> {
        self.advance(now);
        let Some((unsigned, [link, stamp @ ..])) = frame.split_last_chunk::<SIGNATURE>() else {
            unreachable!("{frame:?}");
        };
        let stamp = read(stamp);
        assert_eq!(frame, sealed(KEY, unsigned, 3, stamp), "link {link}");
        assert!(stamp > self.sent || stamp == LAST, "{stamp}");
        assert!(
            stamp >= self.time || stamp == LAST,
            "{stamp} is of the past"
        );
        // While the link's clock stands still, its timestamp advances by at most one per frame.
        assert!(
            stamp <= self.time.max(self.sent + 1),
            "{stamp} is of the future"
        );
        self.sent = stamp;
        let mut unsigned = unsigned.to_vec();
        if let Some(flags) = unsigned.get_mut(2) {
            *flags &= !1;
        }
        unsigned
    }
}

fn read(bytes: &[u8]) -> u64 {
    let mut stamp = [0; 8];
    for (to, from) in stamp.iter_mut().zip(bytes.iter().take(6)) {
        *to = *from;
    }
    u64::from_le_bytes(stamp)
}

/// Signs `frame` with link number `link` and timestamp `stamp`.
///
/// The checksum covers the flag of a signed frame, so the checksum is computed anew.
fn signed(key: [u8; 32], frame: &[u8], link: u8, stamp: u64) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame.truncate(frame.len() - 2);
    if let Some(flags) = frame.get_mut(2) {
        *flags |= 1;
    }
    let id = super::wire::id(&frame);
    let covered = frame.get(1..).unwrap_or_default();
    let sum = super::wire::checksum(covered, super::wire::extra(id));
    frame.extend(sum.to_le_bytes());
    sealed(key, &frame, link, stamp)
}

/// Appends the signature (link number, timestamp, tag) to a frame with its checksum.
fn sealed(key: [u8; 32], frame: &[u8], link: u8, stamp: u64) -> Vec<u8> {
    let mut frame = frame.to_vec();
    frame.push(link);
    frame.extend(stamp.to_le_bytes().iter().take(6));
    let hash = Sha256::new()
        .chain_update(key)
        .chain_update(&frame)
        .finalize();
    frame.extend(hash.iter().take(6));
    frame
}
