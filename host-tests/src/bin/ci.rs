//! `cargo ci`: everything that must pass, one step after the other; the last line says what did not.

use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use host_tests::firmware::{MISSING, QEMU};
use host_tests::toolchain::llvm_tool;

/// The target the firmware is built for.
const TARGET: &str = "thumbv7em-none-eabihf";

/// The oldest compiler the crate promises to build with, as `rust-version` in Cargo.toml has it.
const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");

/// One command that must succeed.
struct Step {
    name: &'static str,
    program: &'static str,
    arguments: Vec<&'static str>,
    environment: &'static [(&'static str, &'static str)],
}

fn step(name: &'static str, command: &'static str) -> Step {
    let mut words = command.split_whitespace();
    let program = words.next().unwrap_or("cargo");
    Step {
        name,
        program,
        arguments: words.collect(),
        environment: &[],
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
            "clippy, target",
            "cargo clippy -p uav-relay --lib --examples --target thumbv7em-none-eabihf --locked -- -D warnings",
        ),
        step(
            "clippy, target, defmt",
            "cargo clippy -p uav-relay --lib --examples --features defmt --target thumbv7em-none-eabihf --locked -- -D warnings",
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
            "firmware with its log",
            "cargo build -p uav-relay --release --target thumbv7em-none-eabihf --examples --features defmt --locked",
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
    for (name, features) in [("oldest compiler", ""), ("oldest compiler, defmt", "defmt")] {
        let mut arguments = vec![
            "run",
            OLDEST,
            "cargo",
            "check",
            "-p",
            "uav-relay",
            "--locked",
        ];
        arguments.extend(["--target-dir", "target/oldest", "--features", features]);
        steps.push(Step {
            name,
            program: "rustup",
            arguments,
            environment: &[],
        });
    }
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
    let mut failed = Vec::new();
    for (number, step) in (1..).zip(&steps) {
        println!(
            "\n== {number}/{} {}: {} {}",
            steps.len(),
            step.name,
            step.program,
            step.arguments.join(" ")
        );
        let begun = Instant::now();
        let status = Command::new(step.program)
            .args(&step.arguments)
            .envs(step.environment.iter().copied())
            .status();
        let passed = status.is_ok_and(|status| status.success());
        println!(
            "== {} {} in {} s",
            step.name,
            if passed { "passed" } else { "FAILED" },
            begun.elapsed().as_secs()
        );
        if !passed {
            failed.push(step.name);
        }
    }
    let seconds = started.elapsed().as_secs();
    if failed.is_empty() {
        println!("\nci: all {} steps passed in {seconds} s", steps.len());
        ExitCode::SUCCESS
    } else {
        println!(
            "\nci: {} of {} steps failed: {} ({seconds} s)",
            failed.len(),
            steps.len(),
            failed.join("; ")
        );
        ExitCode::FAILURE
    }
}
