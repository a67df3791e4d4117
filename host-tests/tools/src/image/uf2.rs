//! UF2: the file format of USB mass-storage boot loaders. Each block of 512 bytes carries its own flash address.
//!
//! | byte of a block | type | content |
//! | --- | --- | --- |
//! | 0 | 2 u32 | [`MAGIC`] |
//! | 8 | u32 | flags: 0x2000, a family ID is present |
//! | 12 | u32 | address of the first byte, a multiple of [`PAGE`] |
//! | 16 | u32 | payload size: [`PAGE`] |
//! | 20 | u32 | block number, from 0 |
//! | 24 | u32 | number of blocks |
//! | 28 | u32 | [`Family`] |
//! | 32 | 476 bytes | a page, and zeros |
//! | 508 | u32 | [`END`] |
//!
//! All numbers are little-endian.

use std::collections::BTreeMap;

use super::elf::{BLANK, Piece};

/// Magic numbers at the start of a block.
pub const MAGIC: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];

/// Magic number at the end of a block.
pub const END: u32 = 0x0AB1_6F30;

/// Payload bytes per block.
pub const PAGE: u32 = 256;

const FAMILY_STATED: u32 = 0x2000;

/// Chip family that accepts a block; other chips ignore it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Family(pub u32);

impl Family {
    /// RP2350, Arm cores, secure state.
    pub const RP2350: Self = Self(0xE48B_FF59);
}

/// Returns the UF2 file. Bytes of a page that no piece covers are erased-flash bytes.
///
/// # Errors
/// If there are more blocks than the format can count.
pub fn file(pieces: &[Piece], family: Family) -> Result<Vec<u8>, String> {
    let mut pages = BTreeMap::new();
    for piece in pieces {
        for (address, byte) in (piece.address..).zip(&piece.bytes) {
            let page: &mut Vec<u8> = pages
                .entry(address - address % PAGE)
                .or_insert_with(|| vec![BLANK; PAGE as usize]);
            if let Some(place) = page.get_mut((address % PAGE) as usize) {
                *place = *byte;
            }
        }
    }
    let count = u32::try_from(pages.len()).map_err(|_| "more pages than a UF2 file has")?;
    let mut file = Vec::new();
    for (number, (address, page)) in (0..).zip(&pages) {
        let [first, second] = MAGIC;
        for word in [
            first,
            second,
            FAMILY_STATED,
            *address,
            PAGE,
            number,
            count,
            family.0,
        ] {
            file.extend(word.to_le_bytes());
        }
        file.extend(page);
        file.extend([0; 476 - PAGE as usize]);
        file.extend(END.to_le_bytes());
    }
    Ok(file)
}
