//! Parts of several bodies, the ranges of their numbers, and the tags of the messages.
//!
//! A shared type adds no bytes on the wire, and the image has its decoder only once.

use serde::{Deserialize, Serialize, Serializer};

use crate::mission::Profile;
use crate::optimiser::PerTarget;
use crate::place::Placement;

/// Message tags: the first byte of a body, which names the kind of message. There are three kinds of sweeps: `SWEEP`,
/// `MEASURED` with measured interference, and `ASIDE` with a lateral offset.
pub(super) mod tag {
    pub(crate) const SWEEP: u8 = 0x00;
    pub(crate) const VERDICT: u8 = 0x01;
    pub(crate) const BUSY: u8 = 0x02;
    pub(crate) const HEARTBEAT: u8 = 0x03;
    pub(crate) const MEASURED: u8 = 0x04;
    pub(crate) const ASIDE: u8 = 0x05;
    pub(crate) const GATHER: u8 = 0x06;
    pub(crate) const GATHERED: u8 = 0x07;
    pub(crate) const TOKEN: u8 = 0x08;
    pub(crate) const MOVED: u8 = 0x09;
    pub(crate) const HELLO: u8 = 0x0A;
    pub(crate) const PROPOSAL: u8 = 0x0B;
    pub(crate) const DECISION: u8 = 0x0C;
    pub(crate) const FENCE: u8 = 0x0D;
    pub(crate) const OFFER: u8 = 0x0E;
    pub(crate) const PULSE: u8 = 0x0F;
    pub(crate) const PULSED: u8 = 0x10;
    pub(crate) const SENSE: u8 = 0x11;
    pub(crate) const SENSED: u8 = 0x12;
    pub(crate) const LEVEL: u8 = 0x13;
    pub(crate) const CLAIM: u8 = 0x14;
    pub(crate) const WATCH: u8 = 0x15;
    pub(crate) const REPORT: u8 = 0x16;
}

/// 16-bit number in two bytes; postcard would encode a `u16` as a varint.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub(super) struct Word([u8; 2]);

impl Word {
    pub(super) const fn new(number: u16) -> Self {
        Self(number.to_le_bytes())
    }

    pub(super) const fn number(self) -> u16 {
        u16::from_le_bytes(self.0)
    }
}

impl Serialize for Word {
    #[inline(never)] // called from many places
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.0.serialize(serializer)
    }
}

/// Encodes `body` at the start of `buffer`; returns its length, or `None` if it does not fit.
pub(super) fn write<T: Serialize>(body: &T, buffer: &mut [u8]) -> Option<usize> {
    postcard::to_slice(body, buffer)
        .ok()
        .map(|written| written.len())
}

/// Decodes a value from the start of `bytes`; returns the value and the remaining bytes.
pub(super) fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<(T, &'a [u8]), MessageError> {
    postcard::take_from_bytes(bytes).map_err(|_| MessageError::Encoding)
}

pub(super) fn read<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, MessageError> {
    match take(bytes)? {
        (body, []) => Ok(body),
        _ => Err(MessageError::Encoding),
    }
}

/// Decodes a list of one number per target SIR; returns the list and the remaining bytes. The count before the list
/// must be encoded in its shortest form: postcard accepts longer forms up to a limit that depends on the width of
/// `usize`, so nodes could differ in the lists that they accept.
#[inline(never)]
pub(super) fn take_targets(bytes: &[u8]) -> Result<(PerTarget, &[u8]), MessageError> {
    let (numbers, rest): (PerTarget, _) = take(bytes)?;
    if rest.len() + 1 + 4 * numbers.len() == bytes.len() {
        Ok((numbers, rest))
    } else {
        Err(MessageError::Encoding)
    }
}

/// Maximum of the x values and of the slacks (reserves in length of the chain) in a message, m. The hop to Rx is
/// limited to 1e9 m; twice this value leaves room for the sum of a position (at most 1e6 m) and that hop.
pub(super) const FARTHEST_M: f32 = 2e9;

#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
pub(super) struct PassId {
    number: Word,
    digest: Word,
}

impl PassId {
    pub(super) const fn new(number: u16, digest: u16) -> Self {
        Self {
            number: Word::new(number),
            digest: Word::new(digest),
        }
    }

    pub(super) const fn number(self) -> u16 {
        self.number.number()
    }

    pub(super) const fn digest(self) -> u16 {
        self.digest.number()
    }
}

pub(super) fn is_place(at: Placement) -> bool {
    (0.0..=1e6).contains(&at.x_m) && is_beside(at.y_m) && (0.1..=1e5).contains(&at.altitude_m)
}

/// Returns the position of a relay on the vertical plane through Tx and Rx, from its x and altitude, m. `power_w` is
/// the transmit power of the relay, W.
///
/// # Errors
/// [`MessageError::Value`] if one of the three numbers is out of range.
pub(super) fn checked_place(
    [x_m, altitude_m]: [f32; 2],
    power_w: f32,
) -> Result<Placement, MessageError> {
    let place = Placement::on_line(x_m, altitude_m);
    require(is_place(place) && profile(altitude_m, power_w).is_some())?;
    Ok(place)
}

/// Checks a condition on the numbers of a message.
///
/// # Errors
/// [`MessageError::Value`] if the condition is false.
pub(super) const fn require(is_valid: bool) -> Result<(), MessageError> {
    if is_valid {
        Ok(())
    } else {
        Err(MessageError::Value)
    }
}

/// Returns true if the lateral offset `y_m` is within -1e5 to 1e5 m.
pub(super) fn is_beside(y_m: f32) -> bool {
    (-1e5..=1e5).contains(&y_m)
}

pub(super) fn profile(altitude_m: f32, power_w: f32) -> Option<Profile> {
    let profile = Profile {
        altitude_m,
        power_w,
    };
    profile.is_valid().then_some(profile)
}

pub(super) fn in_range(numbers: &[f32], least: f32) -> bool {
    numbers
        .iter()
        .all(|number| (least..=FARTHEST_M).contains(number))
}

/// Reason why the body of a message is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum MessageError {
    /// The encoding is invalid or not the shortest, or bytes are left over.
    Encoding,
    /// A number in the message is not finite or outside its range.
    Value,
}

error_texts!(MessageError {
    Encoding => "the message body is not in the canonical encoding, or has extra bytes",
    Value => "a number in the message is not finite or outside its range",
});
