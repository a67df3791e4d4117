//! Python interpreter for tests with independent peers.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use rustix::fs::{FlockOperation, flock};

const PACKAGES: &str = include_str!("../python.txt");

/// Returns the Python interpreter of a virtual environment with the packages of `python.txt`.
///
/// The first call installs it under `target/`.
///
/// # Panics
/// There is no Python, or no package index.
pub fn interpreter() -> PathBuf {
    let target = Path::new(env!("CARGO_MANIFEST_DIR")).join("../target");
    std::fs::create_dir_all(&target).unwrap();
    let home = target.join("python");
    // Tests run in several processes, and one of them installs for all.
    let lock = std::fs::File::create(target.join("python.lock")).unwrap();
    flock(&lock, FlockOperation::LockExclusive).unwrap();
    let (python, done) = (home.join("bin/python"), home.join("installed.txt"));
    if std::fs::read_to_string(&done).is_ok_and(|installed| installed == PACKAGES) {
        return python;
    }
    run(Command::new("python3").args(["-m", "venv"]).arg(&home));
    let list = Path::new(env!("CARGO_MANIFEST_DIR")).join("python.txt");
    let install = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        "-r",
    ];
    run(Command::new(&python).args(install).arg(list));
    std::fs::write(done, PACKAGES).unwrap();
    python
}

fn run(command: &mut Command) {
    let status = command.status();
    assert!(
        status.as_ref().is_ok_and(std::process::ExitStatus::success),
        "{command:?}: {status:?}; the tests need python3 with venv, and its package index"
    );
}

/// Runs a Python script with `input` on its standard input, and returns its output.
///
/// # Panics
/// The script fails.
pub fn output(script: &Path, arguments: &[&str], input: &str) -> String {
    let mut child = Command::new(interpreter())
        .arg(script)
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut stdin = child.stdin.take().unwrap();
    let input = input.to_owned();
    let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
    let output = child.wait_with_output().unwrap();
    writer.join().unwrap().unwrap();
    assert!(
        output.status.success(),
        "{}: {}",
        script.display(),
        output.status
    );
    String::from_utf8(output.stdout).unwrap()
}
