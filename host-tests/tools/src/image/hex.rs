//! Intel HEX output, by the crate `ihex`.

use ihex::Record;

use super::elf::Piece;

const RECORD: u8 = 16;

/// Returns the HEX file, with 32-bit addresses.
///
/// # Errors
/// If `ihex` rejects a record.
pub fn file(pieces: &[Piece]) -> Result<String, String> {
    let mut records = Vec::new();
    let mut above = None;
    for piece in pieces {
        let mut rest = piece.bytes.as_slice();
        let mut address = piece.address;
        while !rest.is_empty() {
            let [a, b, c, d] = address.to_be_bytes();
            let (high, offset) = (u16::from_be_bytes([a, b]), u16::from_be_bytes([c, d]));
            if above != Some(high) {
                above = Some(high);
                records.push(Record::ExtendedLinearAddress(high));
            }
            // A record must not cross a 64 KiB boundary.
            let room = 0x1_0000 - usize::from(offset);
            let len = usize::from(RECORD).min(room).min(rest.len());
            let (value, behind) = rest.split_at(len);
            records.push(Record::Data {
                offset,
                value: value.to_vec(),
            });
            address = address.wrapping_add(u32::try_from(len).unwrap_or_default());
            rest = behind;
        }
    }
    records.push(Record::EndOfFile);
    ihex::create_object_file_representation(&records)
        .map(|file| file + "\n")
        .map_err(|error| error.to_string())
}
