//! What the steps need, and how it is added where it is missing.

use std::process::Command;

use uav_relay_xtask::toolchain::{llvm_tool, succeeds};

use super::steps::{CARGO_FUZZ, NIGHTLY, OLDEST, TARGET, TARGET_V8M};

/// The emulator that runs the firmware.
const QEMU: &str = "qemu-system-arm";

/// What to type where it is missing.
const MISSING: &str =
    "qemu-system-arm is missing; type: sudo apt-get install --yes qemu-system-arm";

/// What it is called, a command that tells whether it is there, and what rustup adds it by.
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

/// The fuzzer's version.
const CARGO_FUZZ_VERSION: &str = "0.13.2";

/// Adds what the quick steps need, or all of them, and the machine lacks; or says what to type.
pub(crate) fn prepare(quick: bool) -> Result<(), String> {
    add(&TO_EDIT)?;
    if quick {
        return Ok(());
    }
    add(&FOR_THE_REST)?;
    prepare_fuzzer()?;
    prepare_emulator()
}

/// cargo-fuzz is built into the target folder: what it is for is this project alone.
fn prepare_fuzzer() -> Result<(), String> {
    if succeeds(CARGO_FUZZ, &["fuzz", "--version"]) {
        return Ok(());
    }
    let install = [
        "install",
        "cargo-fuzz",
        "--version",
        CARGO_FUZZ_VERSION,
        "--locked",
        "--root",
        "target/tools",
    ];
    println!("ci: adding cargo-fuzz: cargo {}", install.join(" "));
    let added = Command::new("cargo").args(install).status();
    if added.is_ok_and(|status| status.success()) {
        Ok(())
    } else {
        Err(format!(
            "cargo-fuzz is missing and cannot be added; type: cargo {}",
            install.join(" ")
        ))
    }
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

/// The emulator that runs the firmware is Debian's. Only root can add it, so for anybody else this says what to type.
fn prepare_emulator() -> Result<(), String> {
    if succeeds(QEMU, &["--version"]) {
        return Ok(());
    }
    let install = ["install", "--yes", "--no-install-recommends", QEMU];
    println!("ci: adding {QEMU}: apt-get {}", install.join(" "));
    let apt_get = |arguments: &[&str]| {
        Command::new("apt-get")
            .args(arguments)
            .env("DEBIAN_FRONTEND", "noninteractive")
            .status()
            .is_ok_and(|status| status.success())
    };
    // What apt knows may be older than what there is to fetch.
    if apt_get(&install) || (apt_get(&["update"]) && apt_get(&install)) {
        Ok(())
    } else {
        Err(MISSING.into())
    }
}

/// rustc names the folder of a target whether it is there or not.
fn target_is_there(arguments: &[&str]) -> bool {
    let output = Command::new("rustc").args(arguments).output();
    output.is_ok_and(|output| {
        std::path::Path::new(String::from_utf8_lossy(&output.stdout).trim()).is_dir()
    })
}
