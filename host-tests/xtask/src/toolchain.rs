//! Programs of the Rust toolchain.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Returns the path of `name`, a program of the component llvm-tools, if it is installed.
pub fn llvm_tool(name: &str) -> Option<PathBuf> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir"])
        .output()
        .ok()?;
    let lib = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Some(lib.parent()?.join("bin").join(name)).filter(|path| path.exists())
}

/// Returns true if a command succeeds; hides its output.
pub fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let status = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}
