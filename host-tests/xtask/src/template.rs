//! Firmware templates: the files of `examples/templates`, written into an empty folder.

use std::path::{Component, Path, PathBuf};
use std::{fs, io};

/// Folder with the files that all templates share.
const COMMON: &str = "common";

/// Dependency of each template on this crate. [`generate`] replaces its path.
const CRATE: &str = "path = \"../uav-relay\"";

/// Names of the templates and their folders, one for each kind of main loop.
pub const TEMPLATES: [&str; 3] = ["blocking", "rtic", "embassy"];

/// Returns the root of this checkout.
pub fn checkout() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().nth(2).unwrap_or(own).to_owned()
}

/// Writes the firmware template `name` into `folder`, with a dependency on the crate of this checkout.
///
/// # Errors
/// The folder is not empty, it is inside this checkout, or a file cannot be read or written.
pub fn generate(name: &str, folder: &Path) -> io::Result<()> {
    if fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some()) {
        let text = format!("{} is not empty", folder.display());
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, text));
    }
    let root = fs::canonicalize(checkout())?;
    if std::path::absolute(folder)?.starts_with(&root) {
        let text = format!(
            "{} is inside {}, whose Cargo settings and workspace would apply to it",
            folder.display(),
            root.display()
        );
        return Err(io::Error::new(io::ErrorKind::InvalidInput, text));
    }
    let templates = root.join("examples/templates");
    copy(&templates.join(COMMON), folder)?;
    copy(&templates.join(name), folder)?;
    let manifest = folder.join("Cargo.toml");
    let text = fs::read_to_string(&manifest)?;
    let path = relative(&fs::canonicalize(folder)?, &root);
    let path = path.display().to_string().replace('\\', "/");
    fs::write(manifest, text.replace(CRATE, &format!("path = \"{path}\"")))
}

fn copy(from: &Path, to: &Path) -> io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

fn relative(from: &Path, to: &Path) -> PathBuf {
    let [from, to] = [from, to].map(|path| path.components().collect::<Vec<Component<'_>>>());
    let same = from.iter().zip(&to).take_while(|(a, b)| a == b).count();
    let up = from.iter().skip(same).map(|_| Component::ParentDir);
    up.chain(to.iter().skip(same).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::relative;
    use std::path::Path;

    #[test]
    fn a_relative_path_leads_from_one_folder_to_the_other() {
        for (from, to, expected) in [
            ("/a/my-relay", "/a/uav-relay", "../uav-relay"),
            ("/a/b/c", "/a", "../.."),
            ("/a", "/a/b", "b"),
            ("/x/y", "/a/b", "../../a/b"),
        ] {
            assert_eq!(
                relative(Path::new(from), Path::new(to)),
                Path::new(expected)
            );
        }
    }
}
