//! The newest mission that was uploaded, in a file: [`Upload::encode`], and a CRC-32C behind it.
//!
//! Without it, or with one that is of no use, a relay begins with the mission of its options; the chain hands it the newer one.

use std::io::ErrorKind;
use std::path::Path;

use uav_relay::wire::crc::CRC_32C;
use uav_relay::wire::digest::digest;
use uav_relay::wire::upload::LENGTH;
use uav_relay::{Mission, Upload};

use crate::keep::keep;

/// Bytes of the file.
const STORED: usize = LENGTH + 4;

/// What was uploaded to relays that were loaded with `mission`; `None` if there is no `file`.
///
/// # Errors
/// One line that names the file and says why it is of no use.
pub(crate) fn load(file: &Path, mission: &Mission) -> Result<Option<Upload>, String> {
    let named = |error: &str| format!("--upload-file {}: {error}; not used", file.display());
    let bytes = match std::fs::read(file) {
        Ok(bytes) => bytes,
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(named(&format!("cannot be read: {error}"))),
    };
    let upload = parse(&bytes).ok_or_else(|| named("is damaged, or no upload"))?;
    let loaded = digest(mission);
    if upload.base() != loaded || upload.config().relays != mission.relays() {
        let base = upload.base();
        return Err(named(&format!(
            "is for relays that were loaded with mission 0x{base:04x} and not 0x{loaded:04x}"
        )));
    }
    Ok(Some(upload))
}

fn parse(bytes: &[u8]) -> Option<Upload> {
    let (upload, check) = bytes.split_at_checked(LENGTH)?;
    Upload::decode(upload).filter(|_| *check == sum(upload))
}

/// Writes it down.
///
/// # Errors
/// One line that names the file and what is wrong.
pub(crate) fn store(file: &Path, upload: &Upload) -> Result<(), String> {
    let mut bytes = [0; STORED];
    let (body, check) = bytes.split_at_mut(LENGTH);
    // It has room for every upload.
    upload.encode(body);
    check.copy_from_slice(&sum(body));
    keep(file, &bytes).map_err(|error| {
        let version = upload.version();
        let file = file.display();
        format!("--upload-file {file}: version {version} cannot be written: {error}")
    })
}

fn sum(bytes: &[u8]) -> [u8; 4] {
    CRC_32C.checksum(bytes).to_le_bytes()
}
