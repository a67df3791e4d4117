//! Splits a byte stream into frames at the delimiters.

/// Bytes stored per piece. The longest frame has 145; a longer piece is noise, and only its start is kept.
pub const MOST: usize = 1_024;

/// Bytes between two delimiters, including the final one.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Piece<'a> {
    /// The bytes with the delimiter; of a piece longer than [`MOST`] the first ones.
    pub bytes: &'a [u8],
    /// Length of the piece before truncation.
    pub len: usize,
}

/// Stream splitter. The result does not depend on how the stream is split into reads.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    bytes: Vec<u8>,
    len: usize,
}

impl Cut {
    /// Appends `bytes` and passes each completed piece to `take`; empty pieces are skipped.
    ///
    /// Work is linear in the number of bytes, memory at most [`MOST`].
    ///
    /// # Errors
    /// The first error of `take`; the bytes after that piece are lost.
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
