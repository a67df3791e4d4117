//! A stream of bytes cut into frames at the delimiters.

/// Bytes of one piece that are kept. The longest frame has 137; a longer piece is noise, whose begin is enough.
pub const MOST: usize = 1_024;

/// What stands between two delimiters, and the one that ends it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Piece<'a> {
    /// Its bytes, the delimiter last; of a piece longer than [`MOST`] the first ones.
    pub bytes: &'a [u8],
    /// How many there were.
    pub len: usize,
}

/// Collects one piece at a time. How the stream is cut into reads makes no difference.
#[derive(Clone, Debug, Default)]
pub struct Cut {
    bytes: Vec<u8>,
    len: usize,
}

impl Cut {
    /// Takes in `bytes`, and hands every piece that is whole by then to `take`. Delimiters in a row are no pieces. Work linear in the number of
    /// bytes, memory of [`MOST`].
    ///
    /// # Errors
    /// The first of `take`; what follows that piece is lost.
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

    /// What the stream ends in, if that is not a delimiter.
    pub fn rest(&self) -> Option<Piece<'_>> {
        (self.len > 0).then_some(Piece {
            bytes: &self.bytes,
            len: self.len,
        })
    }
}
