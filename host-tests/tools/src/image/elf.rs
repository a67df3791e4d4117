//! Loadable bytes of an ELF image and their flash addresses.

use object::LittleEndian;
use object::elf::{FileHeader32, PT_LOAD};
use object::read::elf::{FileHeader as _, ProgramHeader as _};

/// Largest span from the first byte of an image to the last: no supported flash is larger.
pub const LARGEST: u32 = 16 * 1024 * 1024;

/// Value of an erased flash byte.
pub const BLANK: u8 = 0xFF;

/// Contiguous bytes at an address.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Piece {
    /// Address of the first byte.
    pub address: u32,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Returns the loadable segments of an ELF, by physical (load) address.
///
/// # Errors
/// A line that says why the file is not a loadable ELF.
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

/// Joins pieces into one contiguous image, with erased bytes in the gaps.
///
/// # Errors
/// If pieces overlap, or lie more than [`LARGEST`] bytes apart.
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
