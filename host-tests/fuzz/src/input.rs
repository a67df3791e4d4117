//! What a fuzzer's bytes are read as: choices, numbers of a range, pieces of a stream.
//!
//! A read past the end gives zeros, so every byte string is an input, and one that is cut short means nearly the same.

use uav_relay_scenario::number::narrow;

/// The bytes that are left to read.
#[derive(Clone, Debug)]
pub struct Input<'a> {
    rest: &'a [u8],
}

impl<'a> Input<'a> {
    /// All of `bytes`.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Whether nothing is left.
    pub const fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// All that is left.
    pub const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// One byte.
    pub const fn byte(&mut self) -> u8 {
        match self.rest {
            [first, rest @ ..] => {
                self.rest = rest;
                *first
            }
            [] => 0,
        }
    }

    /// Two bytes.
    pub const fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Four bytes.
    pub const fn long(&mut self) -> u32 {
        u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])
    }

    /// Whether the next byte is odd.
    pub const fn flag(&mut self) -> bool {
        self.byte() % 2 == 1
    }

    /// A choice from 0 to `count` - 1; `count` above 0.
    pub fn below(&mut self, count: u8) -> u8 {
        self.byte() % count.max(1)
    }

    /// A piece of what is left: up to 255 bytes, as many as its first byte says.
    pub fn piece(&mut self) -> &'a [u8] {
        let len = usize::from(self.byte()).min(self.rest.len());
        let (piece, rest) = self.rest.split_at_checked(len).unwrap_or((self.rest, &[]));
        self.rest = rest;
        piece
    }

    /// Any f32 at all, NaN and the infinities among them.
    pub const fn any_number(&mut self) -> f32 {
        f32::from_bits(self.long())
    }

    /// A number from `low` to `high`, both among them, in 65 536 even steps.
    pub fn even(&mut self, low: f32, high: f32) -> f32 {
        let part = f64::from(self.word()) / f64::from(u16::MAX);
        narrow(f64::from(low) + f64::from(high - low) * part).clamp(low, high)
    }

    /// A number from `low` to `high`, both among them and above 0, in 65 536 even steps of its logarithm.
    pub fn scaled(&mut self, low: f32, high: f32) -> f32 {
        let part = f64::from(self.word()) / f64::from(u16::MAX);
        let ratio = f64::from(high) / f64::from(low);
        narrow(f64::from(low) * ratio.powf(part)).clamp(low, high)
    }

    /// One time in sixteen any number at all, else what `usual` gives.
    pub fn mostly(&mut self, usual: impl FnOnce(&mut Self) -> f32) -> f32 {
        if self.byte() % 16 == 15 {
            self.any_number()
        } else {
            usual(self)
        }
    }
}
