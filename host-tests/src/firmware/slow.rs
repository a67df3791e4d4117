//! Clock for QEMU that makes emulated drones run in real time, for peers that are not faster.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Returns the path of the library that QEMU preloads to run a drone in real time.
///
/// The first call builds it with the C compiler.
///
/// # Errors
/// The output of the compiler.
pub fn library() -> Result<PathBuf, String> {
    static BUILT: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    BUILT.get_or_init(build).clone()
}

fn build() -> Result<PathBuf, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/emulated");
    std::fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    // Another process may build it at the same time.
    let own = folder.join(format!("slow{}.so", std::process::id()));
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/firmware/slow.c");
    let mut compiler = Command::new("cc");
    compiler.args(["-shared", "-fPIC", "-O2", "-o"]);
    compiler.arg(&own).arg(source).arg("-ldl");
    let output = compiler.output();
    let output = output.map_err(|error| format!("cc cannot be run: {error}"))?;
    if !output.status.success() {
        return Err(String::from_utf8_lossy(&output.stderr).into_owned());
    }
    let built = folder.join("slow.so");
    std::fs::rename(own, &built).map_err(|error| error.to_string())?;
    Ok(built)
}
