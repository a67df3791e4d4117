//! The bytes of an image, and where in the flash they go.

use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader as _, ProgramHeader as _};

/// The most that lies between the first byte of an image and the last: no flash here is larger.
pub const LARGEST: u32 = 16 * 1024 * 1024;

/// What a blank flash reads.
pub const BLANK: u8 = 0xFF;

/// Bytes from an address on.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Piece {
    /// Where the first one goes.
    pub address: u32,
    /// What goes there.
    pub bytes: Vec<u8>,
}

/// What is loaded from an ELF, by where it is stored: not where it runs.
///
/// # Errors
/// One line that says why it is no image.
pub fn pieces(elf: &[u8]) -> Result<Vec<Piece>, String> {
    let wrong = |error: object::Error| format!("not an ELF of 32 bits: {error}");
    let header = FileHeader32::<LittleEndian>::parse(elf).map_err(wrong)?;
    let endian: LittleEndian = header.endian().map_err(wrong)?;
    let mut pieces = Vec::new();
    for segment in header.program_headers(endian, elf).map_err(wrong)? {
        let bytes = segment
            .data(endian, elf)
            .map_err(|()| "an ELF that is cut short")?;
        if segment.p_type(endian) == PT_LOAD && !bytes.is_empty() {
            pieces.push(Piece {
                address: segment.p_paddr(endian),
                bytes: bytes.to_vec(),
            });
        }
    }
    pieces.sort_by_key(|piece| piece.address);
    if pieces.is_empty() {
        return Err("an ELF with nothing to load".into());
    }
    Ok(pieces)
}

/// One stretch of memory from the first byte to the last, blank in between.
///
/// # Errors
/// Where they overlap, or lie farther apart than any flash here is large.
pub fn flat(pieces: &[Piece]) -> Result<Piece, String> {
    let first = pieces.first().ok_or("nothing to load")?.address;
    let mut bytes = Vec::new();
    for piece in pieces {
        let at = piece.address.checked_sub(first).filter(|at| *at <= LARGEST);
        let at = at.ok_or_else(|| {
            format!(
                "{:#010x} lies more than {LARGEST} bytes behind {first:#010x}",
                piece.address
            )
        })?;
        let at = at as usize;
        if at < bytes.len() {
            return Err(format!(
                "two parts of the image are at {:#010x}",
                piece.address
            ));
        }
        bytes.resize(at, BLANK);
        bytes.extend(&piece.bytes);
    }
    Ok(Piece {
        address: first,
        bytes,
    })
}
