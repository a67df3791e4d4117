//! Atomic file replacement: written beside, synced, then renamed.

use std::fs::{File, remove_file, rename};
use std::io::Write as _;
use std::path::Path;

/// Replaces the content of `file` with `bytes`. After a crash the file holds either the old or the new content.
///
/// # Errors
/// The system's error.
pub fn replace(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut beside = file.as_os_str().to_owned();
    beside.push(".new");
    let written = write(Path::new(&beside), bytes).and_then(|()| rename(&beside, file));
    if written.is_err() {
        // Removes the partial file, which matters on a full disk.
        let _ = remove_file(&beside);
    }
    written?;
    // The renamed directory entry must be synced, too.
    let folder = file
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
}

fn write(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut new = File::create(file)?;
    new.write_all(bytes)?;
    new.sync_all()
}
