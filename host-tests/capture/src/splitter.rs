//! Splits a byte stream into frames at the delimiters.

/// Maximum number of bytes kept of a piece of the stream. A piece longer than this cannot be a frame.
pub const MOST: usize = 1_024;

/// Bytes of a stream after one frame delimiter, up to and including the next one: usually a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Piece<'a> {
    /// Bytes of the piece with its delimiter, at most [`MOST`].
    pub bytes: &'a [u8],
    /// Length of the whole piece, bytes. It is larger than `bytes.len()` if the piece was cut to [`MOST`] bytes.
    pub len: usize,
}

/// Splitter of a byte stream into frames. The result does not depend on how the stream is divided into reads.
#[derive(Clone, Debug, Default)]
pub struct FrameSplitter {
    bytes: Vec<u8>,
    len: usize,
}

impl FrameSplitter {
    /// Appends `bytes` to the stream, and passes each complete piece to `take`. Empty pieces are skipped.
    ///
    /// Work is linear in the number of bytes, memory at most [`MOST`].
    ///
    /// # Errors
    /// The first error of `take`. The rest of `bytes` after the piece that was passed to `take` is lost.
    pub fn push<E>(
        &mut self,
        bytes: &[u8],
        mut take: impl FnMut(Piece<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        for &byte in bytes {
            if byte == 0 && self.len == 0 {
                continue;
            }
            self.len += 1;
            if self.bytes.len() < MOST {
                self.bytes.push(byte);
            }
            if byte == 0 {
                let whole = std::mem::take(&mut self.len);
                let taken = take(Piece {
                    bytes: &self.bytes,
                    len: whole,
                });
                self.bytes.clear();
                taken?;
            }
        }
        Ok(())
    }

    /// Returns the incomplete piece at the end of the stream, if any.
    pub fn rest(&self) -> Option<Piece<'_>> {
        (self.len > 0).then_some(Piece {
            bytes: &self.bytes,
            len: self.len,
        })
    }
}
