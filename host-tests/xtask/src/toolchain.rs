//! Programs of the Rust toolchain.

use std::path::PathBuf;
use std::process::{Command, Stdio};

/// Returns the path of the program `name` in rustup's llvm-tools, if installed.
pub fn llvm_tool(name: &str) -> Option<PathBuf> {
    let output = Command::new("rustc")
        .args(["--print", "target-libdir"])
        .output()
        .ok()?;
    let lib = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Some(lib.parent()?.join("bin").join(name)).filter(|path| path.exists())
}

/// Runs a command and discards its output; returns true if the command succeeds.
pub fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let status = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// Formats a whole number in groups of three digits.
pub fn spaced(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::spaced;

    #[test]
    fn thousands_stand_apart() {
        let texts = [7, 100, 4_900, 139_600, 1_000_000].map(spaced);
        assert_eq!(texts, ["7", "100", "4 900", "139 600", "1 000 000"]);
    }
}
