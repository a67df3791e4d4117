//! Where rustup keeps what comes with a compiler.

use std::path::PathBuf;
use std::process::Command;

/// The path of `name`, a program of the component llvm-tools, if that is installed.
pub fn llvm_tool(name: &str) -> Option<PathBuf> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir"])
        .output()
        .ok()?;
    let lib = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Some(lib.parent()?.join("bin").join(name)).filter(|path| path.exists())
}
