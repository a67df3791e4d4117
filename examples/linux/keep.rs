//! A file that is on the disk whole, or as it was before: written beside, synced, and put in its place.

use std::fs::{File, remove_file, rename};
use std::io::Write as _;
use std::path::Path;

/// Makes `bytes` all that is in `file`.
///
/// # Errors
/// What the system says.
pub fn keep(file: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut beside = file.as_os_str().to_owned();
    beside.push(".new");
    let written = write(Path::new(&beside), bytes).and_then(|()| rename(&beside, file));
    if written.is_err() {
        // On a full disk not even what was begun is left behind.
        let _ = remove_file(&beside);
    }
    written?;
    // The name too has to be on the disk.
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
