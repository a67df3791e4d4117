//! A fuzzer's bytes, read as choices, numbers in a range, and pieces of a stream.
//!
//! Reads past the end return zeros, so every byte string is an input, and a truncated one has nearly the same effect.

use uav_relay_scenario::number::narrow;

/// Unread bytes of the fuzzer.
#[derive(Clone, Debug)]
pub struct Input<'a> {
    rest: &'a [u8],
}

impl<'a> Input<'a> {
    /// Creates the input from the fuzzer's `bytes`.
    pub const fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    /// Returns true if all bytes have been read.
    pub const fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Returns the unread bytes.
    pub const fn rest(&self) -> &'a [u8] {
        self.rest
    }

    /// Reads one byte; returns 0 at the end of the input.
    pub const fn byte(&mut self) -> u8 {
        match self.rest {
            [first, rest @ ..] => {
                self.rest = rest;
                *first
            }
            [] => 0,
        }
    }

    /// Reads two bytes as a little-endian number; missing bytes count as 0.
    pub const fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte(), self.byte()])
    }

    /// Reads four bytes as a little-endian number; missing bytes count as 0.
    pub const fn long(&mut self) -> u32 {
        u32::from_le_bytes([self.byte(), self.byte(), self.byte(), self.byte()])
    }

    /// Reads a byte; returns true if it is odd.
    pub const fn flag(&mut self) -> bool {
        self.byte() % 2 == 1
    }

    /// Reads a number from 0 to `count` - 1; `count` must be above 0.
    pub fn below(&mut self, count: u8) -> u8 {
        self.byte() % count.max(1)
    }

    /// Reads one byte as a length, and returns as many of the following bytes, at most all of the rest.
    pub fn piece(&mut self) -> &'a [u8] {
        let len = usize::from(self.byte()).min(self.rest.len());
        let (piece, rest) = self.rest.split_at_checked(len).unwrap_or((self.rest, &[]));
        self.rest = rest;
        piece
    }

    /// Reads any f32, including NaN and the infinities.
    pub const fn any_number(&mut self) -> f32 {
        f32::from_bits(self.long())
    }

    /// Reads a number from `low` to `high` inclusive, in 65 536 even steps.
    pub fn even(&mut self, low: f32, high: f32) -> f32 {
        let part = f64::from(self.word()) / f64::from(u16::MAX);
        narrow(f64::from(low) + f64::from(high - low) * part).clamp(low, high)
    }

    /// Reads a number from `low` to `high` inclusive, both above 0, in 65 536 even steps of its logarithm.
    pub fn scaled(&mut self, low: f32, high: f32) -> f32 {
        let part = f64::from(self.word()) / f64::from(u16::MAX);
        let ratio = f64::from(high) / f64::from(low);
        narrow(f64::from(low) * ratio.powf(part)).clamp(low, high)
    }

    /// Reads any f32 with a probability of 1/16; otherwise returns the result of `usual`.
    pub fn mostly(&mut self, usual: impl FnOnce(&mut Self) -> f32) -> f32 {
        if self.byte() % 16 == 15 {
            self.any_number()
        } else {
            usual(self)
        }
    }
}
