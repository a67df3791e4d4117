//! CRC-32C (Castagnoli), the check sequence at the end of every frame.
//!
//! Its Hamming distance is 6 for the lengths used here, where the older CRC-32 has 5. A table of 256 words takes 1 KiB of
//! flash; one of 16 words saves 960 bytes, but a full sweep, which passes the CRC twice, then takes some 690 instructions
//! more and is above its budget. `crc_agrees_with_a_published_one` in `host-tests/tests/wire/` holds it against the `crc`
//! crate.

/// The reversed generator polynomial.
const POLYNOMIAL: u32 = 0x82F6_3B78;

const fn remainder(byte: u32) -> u32 {
    let mut rest = byte;
    let mut bit = 0;
    while bit < 8 {
        rest = if rest & 1 == 1 {
            (rest >> 1) ^ POLYNOMIAL
        } else {
            rest >> 1
        };
        bit += 1;
    }
    rest
}

static TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    #[expect(clippy::indexing_slicing, reason = "evaluated when compiled")]
    while byte < 256 {
        #[expect(clippy::cast_possible_truncation, reason = "below 256")]
        let entry = remainder(byte as u32);
        table[byte] = entry;
        byte += 1;
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
            let [low, ..] = self.rest.to_le_bytes();
            #[expect(
                clippy::indexing_slicing,
                reason = "a u8 always has its entry: no check is left to fail"
            )]
            let entry = TABLE[usize::from(low ^ byte)];
            self.rest = (self.rest >> 8) ^ entry;
        }
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
