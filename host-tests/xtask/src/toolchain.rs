//! Where rustup keeps what comes with a compiler.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The path of `name`, a program of the component llvm-tools, if that is installed.
pub fn llvm_tool(name: &str) -> Option<PathBuf> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir"])
        .output()
        .ok()?;
    let lib = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Some(lib.parent()?.join("bin").join(name)).filter(|path| path.exists())
}

/// Whether a command succeeds, unseen.
pub fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let status = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}
