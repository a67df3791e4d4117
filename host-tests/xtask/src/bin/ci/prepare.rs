//! Tools that the steps need, and their installation.

use std::process::Command;

use uav_relay_xtask::toolchain::{llvm_tool, succeeds};

use super::steps::{NIGHTLY, OLDEST, TARGET, TARGET_V8M};

/// Debian packages that the steps need, each with a program of the same name.
///
/// They are the emulator for the firmware, Wireshark's command line for captures, and a browser.
const OF_DEBIAN: [&str; 3] = ["qemu-system-arm", "tshark", "chromium"];

/// Component or target of the Rust toolchain that the steps need.
///
/// The fields are its name, a command that succeeds if it is installed, and the rustup arguments that install it.
type Needed = (
    &'static str,
    &'static [&'static str],
    &'static [&'static str],
);

const TO_EDIT: [Needed; 2] = [
    (
        "rustfmt",
        &["cargo", "fmt", "--version"],
        &["component", "add", "rustfmt"],
    ),
    (
        "clippy",
        &["cargo", "clippy", "--version"],
        &["component", "add", "clippy"],
    ),
];

const FOR_THE_REST: [Needed; 5] = [
    (
        TARGET,
        &["rustc", "--print", "target-libdir", "--target", TARGET],
        &["target", "add", TARGET],
    ),
    (
        TARGET_V8M,
        &["rustc", "--print", "target-libdir", "--target", TARGET_V8M],
        &["target", "add", TARGET_V8M],
    ),
    (
        "llvm-tools",
        &["llvm-objdump"],
        &["component", "add", "llvm-tools"],
    ),
    (
        "the oldest compiler",
        &["rustup", "run", OLDEST, "cargo", "--version"],
        &[
            "toolchain",
            "install",
            OLDEST,
            "--profile",
            "minimal",
            "--no-self-update",
        ],
    ),
    (
        "the compiler of the fuzzer and of Miri",
        &["rustup", "run", NIGHTLY, "cargo", "miri", "--version"],
        &[
            "toolchain",
            "install",
            NIGHTLY,
            "--profile",
            "minimal",
            "--component",
            "miri,rust-src",
            "--no-self-update",
        ],
    ),
];

/// Installs the missing tools: the tools of the quick steps if `quick` is true, otherwise all tools.
///
/// # Errors
/// The command to type for a tool that cannot be installed.
pub(crate) fn prepare(quick: bool) -> Result<(), String> {
    add(&TO_EDIT)?;
    if quick {
        return Ok(());
    }
    add(&FOR_THE_REST)?;
    OF_DEBIAN.into_iter().try_for_each(prepare_program)
}

fn add(needed: &[Needed]) -> Result<(), String> {
    for &(what, check, add) in needed {
        let there = match check {
            ["rustc", arguments @ ..] => target_is_there(arguments),
            ["llvm-objdump"] => llvm_tool("llvm-objdump").is_some(),
            [program, arguments @ ..] => succeeds(program, arguments),
            [] => true,
        };
        if !there {
            println!("ci: adding {what}: rustup {}", add.join(" "));
            let added = Command::new("rustup")
                .args(add)
                .status()
                .is_ok_and(|status| status.success());
            if !added {
                return Err(format!(
                    "{what} is missing and cannot be added; type: rustup {}",
                    add.join(" ")
                ));
            }
        }
    }
    Ok(())
}

/// Installs the Debian package of `program` if the program is missing. The installation needs root rights.
///
/// # Errors
/// The command to type without root rights.
fn prepare_program(program: &str) -> Result<(), String> {
    if succeeds(program, &["--version"]) {
        return Ok(());
    }
    let install = ["install", "--yes", "--no-install-recommends", program];
    println!("ci: adding {program}: apt-get {}", install.join(" "));
    let apt_get = |arguments: &[&str]| {
        Command::new("apt-get")
            .args(arguments)
            .env("DEBIAN_FRONTEND", "noninteractive")
            .status()
            .is_ok_and(|status| status.success())
    };
    // The package lists may be out of date.
    if apt_get(&install) || (apt_get(&["update"]) && apt_get(&install)) {
        Ok(())
    } else {
        Err(format!(
            "{program} is missing; type: sudo apt-get install --yes {program}"
        ))
    }
}

/// Returns true if the libraries of a compilation target are installed.
///
/// Called with `arguments`, rustc prints the folder of these libraries, even if the folder does not exist.
fn target_is_there(arguments: &[&str]) -> bool {
    let output = Command::new("rustc").args(arguments).output();
    output.is_ok_and(|output| {
        std::path::Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
    })
}
