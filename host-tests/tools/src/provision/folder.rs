//! Writes the blocks of a whole flight into one folder: all of them, or none.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Returns the file name of relay `index`.
pub fn name(index: u16) -> String {
    format!("relay{index}.bin")
}

/// Writes `files` (name and content) to `dir`, and creates it if necessary.
///
/// With `force`, existing files are overwritten and other blocks in the folder removed, because a drone of another flight would
/// accept them. Files are first written under temporary names and renamed at the end: an earlier failure leaves the folder as it
/// was.
///
/// # Errors
/// A line that names the file or folder and the reason.
pub fn write(dir: &Path, files: &[(String, Vec<u8>)], force: bool) -> Result<(), String> {
    let old = there(dir, files)?;
    if let Some(first) = old.first()
        && !force
    {
        return Err(format!(
            "--out-dir {}: {} exists already; --force overwrites it, and removes blocks of other relays",
            dir.display(),
            first.file_name().unwrap_or_default().to_string_lossy()
        ));
    }
    let is_new = !dir.exists();
    let failed = |what: &Path, error: std::io::Error| {
        if is_new {
            // Removes the folder again, if it was created.
            _ = std::fs::remove_dir(dir);
        }
        format!("--out-dir {}: {error}", what.display())
    };
    std::fs::create_dir_all(dir).map_err(|error| failed(dir, error))?;
    let staged: Result<Vec<NamedTempFile>, std::io::Error> = files
        .iter()
        .map(|(_, content)| stage(dir, content))
        .collect();
    let staged = staged.map_err(|error| failed(dir, error))?;
    let mut named: Vec<PathBuf> = Vec::new();
    for (file, (name, _)) in staged.into_iter().zip(files) {
        let to = dir.join(name);
        if let Err(error) = file.persist(&to) {
            for file in &named {
                _ = std::fs::remove_file(file);
            }
            return Err(failed(&to, error.error));
        }
        named.push(to);
    }
    for file in old.iter().filter(|file| !named.contains(file)) {
        std::fs::remove_file(file)
            .map_err(|error| format!("--out-dir {}: {error}", file.display()))?;
    }
    Ok(())
}

/// Writes `content` to a temporary file that is removed unless it is renamed.
fn stage(dir: &Path, content: &[u8]) -> Result<NamedTempFile, std::io::Error> {
    let mut file = NamedTempFile::new_in(dir)?;
    file.write_all(content)?;
    file.as_file().sync_all()?;
    Ok(file)
}

/// Returns the files in the folder that belong to a flight. Blocks of any relay, and the names in `files`.
fn there(dir: &Path, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>, String> {
    if !dir.exists() {
        return Ok(Vec::new());
    }
    let entries =
        std::fs::read_dir(dir).map_err(|error| format!("--out-dir {}: {error}", dir.display()))?;
    let mut there: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .filter(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let index = name
                .strip_prefix("relay")
                .and_then(|rest| rest.strip_suffix(".bin"));
            index.is_some_and(|index| index.parse::<u16>().is_ok())
                || files.iter().any(|(file, _)| *file == name)
        })
        .map(|entry| entry.path())
        .collect();
    there.sort();
    Ok(there)
}
