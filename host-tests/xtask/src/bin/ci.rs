//! `cargo ci`: everything that must pass, one step after the other; the last line says what did not.

use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use uav_relay_xtask::FUZZ_TARGETS;
use uav_relay_xtask::toolchain::llvm_tool;

/// The emulator that runs the firmware.
const QEMU: &str = "qemu-system-arm";

/// What to type where it is missing.
const MISSING: &str =
    "qemu-system-arm is missing; type: sudo apt-get install --yes qemu-system-arm";

/// The target the firmware is built for.
const TARGET: &str = "thumbv7em-none-eabihf";

/// The oldest compiler the crate promises to build with, as `rust-version` in Cargo.toml has it.
const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");

/// One command that must succeed.
struct Step {
    name: String,
    command: String,
    environment: &'static [(&'static str, &'static str)],
    /// What it is left out without.
    needs: Option<Tool>,
}

/// A command of a nightly cargo. Too much to add to a machine unasked.
#[derive(Clone, Copy)]
struct Tool {
    command: &'static str,
    get: &'static str,
}

const FUZZ: Tool = Tool {
    command: "fuzz",
    get: "rustup toolchain install nightly --profile minimal && cargo install cargo-fuzz --locked",
};

const MIRI: Tool = Tool {
    command: "miri",
    get: "rustup toolchain install nightly --profile minimal --component miri,rust-src",
};

impl Tool {
    fn is_there(self) -> bool {
        let arguments = ["run", "nightly", "cargo", self.command, "--version"];
        succeeds("rustup", &arguments)
    }
}

fn step(name: impl Into<String>, command: impl Into<String>) -> Step {
    Step {
        name: name.into(),
        command: command.into(),
        environment: &[],
        needs: None,
    }
}

impl Step {
    fn run(&self) -> bool {
        let mut words = self.command.split_whitespace();
        let status = Command::new(words.next().unwrap_or("cargo"))
            .args(words)
            .envs(self.environment.iter().copied())
            .status();
        status.is_ok_and(|status| status.success())
    }
}

fn steps() -> Vec<Step> {
    let mut steps = vec![
        step("formatting", "cargo fmt --all --check"),
        step(
            "clippy, host",
            "cargo clippy --workspace --all-targets --locked -- -D warnings",
        ),
        step(
            "clippy, host, defmt",
            "cargo clippy -p uav-relay --lib --features defmt --locked -- -D warnings",
        ),
        step(
            "clippy, auth",
            "cargo clippy -p uav-relay --lib --features auth --locked -- -D warnings",
        ),
        step(
            "clippy, target",
            "cargo clippy -p uav-relay --lib --examples --target thumbv7em-none-eabihf --locked -- -D warnings",
        ),
        step(
            "clippy, target, upload, defmt",
            "cargo clippy -p uav-relay --lib --examples --features upload,defmt --target thumbv7em-none-eabihf --locked -- -D warnings",
        ),
        step("tests", "cargo test --no-fail-fast --locked"),
        step("documentation", "cargo doc --workspace --no-deps --locked"),
        step(
            "firmware",
            "cargo build --release --target thumbv7em-none-eabihf --examples --locked",
        ),
        step(
            "firmware of Algorithm 1 alone",
            "cargo build -p uav-relay --release --target thumbv7em-none-eabihf --examples --no-default-features --locked",
        ),
        step(
            "Algorithm 1 alone",
            "cargo test -p uav-relay --lib --no-default-features --locked",
        ),
        step(
            "Algorithm 1 and uploads",
            "cargo test -p uav-relay --lib --no-default-features --features upload --locked",
        ),
        step(
            "firmware that takes uploads, with its log",
            "cargo build -p uav-relay --release --target thumbv7em-none-eabihf --examples --features upload,defmt --locked",
        ),
        step(
            "firmware with its log by the probe",
            "cargo build -p uav-relay --release --target thumbv7em-none-eabihf --examples --features rtt --locked",
        ),
    ];
    for step in &mut steps {
        if step.name == "documentation" {
            step.environment = &[("RUSTDOCFLAGS", "-D warnings")];
        }
    }
    steps.push(step("cost, and no panic", "cargo cost"));
    for (name, features) in [
        ("oldest compiler", ""),
        ("oldest compiler, all", "upload,defmt"),
    ] {
        let check = "cargo check -p uav-relay --locked --target-dir target/oldest";
        let command = format!("rustup run {OLDEST} {check} --features={features}");
        steps.push(step(name, command));
    }
    steps.extend(nightly_steps());
    steps
}

/// What needs more than a stable compiler: every fuzz target for some seconds from its corpus on, the corpora under Miri.
fn nightly_steps() -> Vec<Step> {
    let mut steps = Vec::new();
    for target in FUZZ_TARGETS {
        // What is found goes where it is not taken for a part of the corpus; of a missing folder libFuzzer makes an error.
        let found = format!("target/fuzz/{target}");
        _ = std::fs::create_dir_all(&found);
        let fuzz =
            "cargo fuzz run --fuzz-dir host-tests/fuzz/harness --target-dir target/fuzz/build";
        let corpora = format!("{found} host-tests/fuzz/corpus/{target}");
        let command = format!(
            "rustup run nightly {fuzz} --sanitizer none {target} {corpora} -- -max_total_time=10"
        );
        steps.push(Step {
            needs: Some(FUZZ),
            ..step(format!("fuzz smoke, {target}"), command)
        });
    }
    // With the width of the target's pointers; for x86 libm takes square roots in assembly, which Miri does not read. Isolated,
    // it would not read the corpora either.
    steps.push(Step {
        needs: Some(MIRI),
        environment: &[("MIRIFLAGS", "-Zmiri-disable-isolation")],
        ..step(
            "miri",
            "rustup run nightly cargo miri test -p host-tests --test fuzz --target armv7-unknown-linux-gnueabihf --target-dir target/miri",
        )
    });
    steps
}

/// Whether a command succeeds, unseen.
fn succeeds(program: &str, arguments: &[&str]) -> bool {
    let status = Command::new(program)
        .args(arguments)
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status();
    status.is_ok_and(|status| status.success())
}

/// Adds what a step needs and the machine lacks, or says what to type.
fn prepare() -> Result<(), String> {
    let needed: [(&str, &[&str], &[&str]); 5] = [
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
        (
            TARGET,
            &["rustc", "--print", "target-libdir", "--target", TARGET],
            &["target", "add", TARGET],
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
    ];
    for (what, check, add) in needed {
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
    prepare_emulator()
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

fn main() -> ExitCode {
    let started = Instant::now();
    if let Err(missing) = prepare() {
        println!("ci: {missing}");
        return ExitCode::FAILURE;
    }
    let steps = steps();
    let (mut failed, mut left_out) = (Vec::new(), 0);
    for (number, step) in (1..).zip(&steps) {
        println!(
            "\n== {number}/{} {}: {}",
            steps.len(),
            step.name,
            step.command
        );
        if let Some(tool) = step.needs.filter(|tool| !tool.is_there()) {
            println!("== {} left out; for it, type: {}", step.name, tool.get);
            left_out += 1;
            continue;
        }
        let begun = Instant::now();
        let passed = step.run();
        println!(
            "== {} {} in {} s",
            step.name,
            if passed { "passed" } else { "FAILED" },
            begun.elapsed().as_secs()
        );
        if !passed {
            failed.push(&*step.name);
        }
    }
    let seconds = started.elapsed().as_secs();
    let run = steps.len() - left_out;
    if failed.is_empty() {
        println!("\nci: all {run} steps passed in {seconds} s, {left_out} left out");
        ExitCode::SUCCESS
    } else {
        println!(
            "\nci: {} of {run} steps failed: {} ({seconds} s, {left_out} left out)",
            failed.len(),
            failed.join("; ")
        );
        ExitCode::FAILURE
    }
}
