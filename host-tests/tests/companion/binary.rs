//! Programs under test. Cargo is called to build them because `cargo test -p host-tests` does not.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;

/// Returns the path of the companion program, which is built with the tests' cargo profile.
pub(crate) fn companion() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| program("uav-relay-linux", "linux_companion"))
}

pub(crate) fn ground() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| program("uav-relay-linux", "linux_ground"))
}

pub(crate) fn plan() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| program("uav-relay-tools", "plan"))
}

pub(crate) fn provision() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| program("uav-relay-tools", "provision"))
}

pub(crate) fn decode() -> &'static Path {
    static PATH: OnceLock<PathBuf> = OnceLock::new();
    PATH.get_or_init(|| program("uav-relay-decode", "decode"))
}

/// Returns the path of a program.
///
/// Builds the program, unless the variable `PROGRAMS` is set: then `cargo ci` has built it together with these tests.
fn program(package: &str, program: &str) -> PathBuf {
    if std::env::var_os("PROGRAMS").is_some() {
        let own = std::env::current_exe().unwrap();
        return own.ancestors().nth(2).unwrap().join(program);
    }
    let manifest = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = manifest.parent().expect("the workspace is one up");
    // The target folder of these tests avoids a second build. Cargo holds no lock on it while tests run.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent();
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .current_dir(root)
        .args(["build", "--locked", "--package", package, "--bin", program])
        .args(["--message-format", "json-render-diagnostics"])
        .arg("--target-dir")
        .arg(target.expect("the folder for temporary files is in it"))
        .stderr(Stdio::inherit());
    let output = cargo.output().unwrap();
    assert!(output.status.success(), "{program} does not build");
    String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap())
        .filter(|message| message["target"]["name"] == program)
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .expect("cargo names the executable")
}
