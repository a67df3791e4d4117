//! CRC-32C (Castagnoli), the check sequence at the end of every frame.
//!
//! Its Hamming distance is 6 for the lengths used here, where the older CRC-32 has 5. A table of 16 words takes 64 bytes of
//! flash and about a dozen instructions a byte; the usual 256-word table would take 1 KiB. `crc_agrees_with_a_published_one`
//! in `host-tests/tests/wire.rs` holds it against the `crc` crate.

/// The reversed generator polynomial.
const POLYNOMIAL: u32 = 0x82F6_3B78;

const fn remainder(nibble: u32) -> u32 {
    let mut rest = nibble;
    let mut bit = 0;
    while bit < 4 {
        rest = if rest & 1 == 1 {
            (rest >> 1) ^ POLYNOMIAL
        } else {
            rest >> 1
        };
        bit += 1;
    }
    rest
}

static TABLE: [u32; 16] = {
    let mut table = [0; 16];
    let mut nibble = 0;
    #[expect(clippy::indexing_slicing, reason = "evaluated when compiled")]
    while nibble < 16 {
        #[expect(clippy::cast_possible_truncation, reason = "below 16")]
        let entry = remainder(nibble as u32);
        table[nibble] = entry;
        nibble += 1;
    }
    table
};

/// A running CRC-32C.
#[derive(Clone, Debug)]
pub struct Crc32c {
    rest: u32,
}

impl Crc32c {
    /// The CRC of no bytes yet.
    pub const fn new() -> Self {
        Self { rest: u32::MAX }
    }

    /// Takes in `bytes`: constant work a byte.
    pub fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.nibble(byte);
            self.nibble(byte >> 4);
        }
    }

    fn nibble(&mut self, bits: u8) {
        let at = (self.rest ^ u32::from(bits)) & 0xF;
        // `at` is below 16, so there always is an entry; no panic is left to prove away.
        let entry = TABLE.get(at as usize).copied().unwrap_or(0);
        self.rest = (self.rest >> 4) ^ entry;
    }

    /// The CRC of all bytes taken in.
    pub const fn finish(&self) -> u32 {
        !self.rest
    }
}

impl Default for Crc32c {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::Crc32c;

    #[test]
    fn the_check_value_of_the_catalogue() {
        let mut crc = Crc32c::new();
        crc.update(b"1234");
        crc.update(b"56789");
        assert_eq!(crc.finish(), 0xE306_9283);
        assert_eq!(Crc32c::new().finish(), 0);
    }
}
