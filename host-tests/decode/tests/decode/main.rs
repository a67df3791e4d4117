//! `cargo decode`, run as a program: live input, noise, keys, and a pipe that closes.
#![cfg(test)]

mod document;
mod envelope;
mod files;
mod live;

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Heartbeat from relay 1 to relay 2, the first example of FORMAT.md.
pub(crate) const HEARTBEAT: [u8; 23] = [
    0x04, 0x01, 0x10, 0x02, 0x02, 0x07, 0x01, 0x01, 0x01, 0x01, 0x05, 0x03, 0x3C, 0x5A, 0x05, 0x01,
    0x01, 0x05, 0x4C, 0x3C, 0x53, 0x4A, 0x00,
];

fn decode() -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_decode"));
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

fn piped(arguments: &[&str], input: &[u8]) -> Output {
    let mut child = decode().args(arguments).spawn().unwrap();
    child.stdin.take().unwrap().write_all(input).unwrap();
    child.wait_with_output().unwrap()
}

fn lines(arguments: &[&str], input: &[u8]) -> Vec<String> {
    let output = piped(arguments, input);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && error.is_empty(),
        "{arguments:?}: {error}"
    );
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(str::to_owned).collect()
}

/// Runs the program, checks that its exit status is 2, and returns its only line on standard error.
fn refusal(arguments: &[&str], input: &[u8]) -> String {
    let output = piped(arguments, input);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(
        (output.status.code(), text.lines().count()),
        (Some(2), 1),
        "{arguments:?}: {text}"
    );
    text
}

fn name(file: &Path) -> &str {
    file.to_str().unwrap()
}

/// Writes a key file that only its owner can read.
fn secret(file: &Path, text: &str) {
    std::fs::write(file, text).unwrap();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        std::fs::set_permissions(file, std::fs::Permissions::from_mode(0o600)).unwrap();
    }
}
