//! Epoch file: a number that increases at every start.
//!
//! The new number is on the disk before it is used, so no power failure makes a relay use a number twice.

use std::io::ErrorKind;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::atomic_file::replace;

/// Returns this start's epoch, one more than in `file`, and writes it to the file.
///
/// A missing file counts as the clock's seconds since 1970, so that the epoch does not restart from 1.
///
/// # Errors
/// One line that names the file and the fault.
pub fn next(file: &Path) -> Result<u32, String> {
    let named = |error: &str| format!("--epoch-file {}: {error}", file.display());
    let last = match std::fs::read_to_string(file) {
        Ok(text) => text.trim().parse().ok(),
        Err(error) if error.kind() == ErrorKind::NotFound => Some(seconds()),
        Err(error) => return Err(named(&format!("cannot be read: {error}"))),
    };
    let last: u32 = last.ok_or_else(|| named("must hold a number within 0 to 4294967294"))?;
    let epoch = last
        .checked_add(1)
        .ok_or_else(|| named("is the largest epoch, and a start needs a larger one"))?;
    replace(file, format!("{epoch}\n").as_bytes())
        .map_err(|error| named(&format!("cannot be written: {error}")))?;
    Ok(epoch)
}

fn seconds() -> u32 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| u32::try_from(since.as_secs()).unwrap_or(0))
}
