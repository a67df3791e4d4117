//! Steps of `cargo ci`, in order.

use std::io::{BufReader, Error, PipeReader, Write, pipe};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};

use super::Evidence;

/// Target triple of the STM32F4 firmware: Arm Cortex-M4F.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// Target triple of the Pico 2: Arm Cortex-M33.
pub(crate) const TARGET_V8M: &str = "thumbv8m.main-none-eabihf";

/// Oldest supported Rust version: `rust-version` in Cargo.toml.
pub(crate) const OLDEST: &str = env!("CARGO_PKG_RUST_VERSION");

/// Feature sets for the library's tests and a simulated flight. All other tests use all features.
const SETS: [&str; 9] = [
    "",
    "guard",
    "guard,flight",
    "mavlink-signing",
    "altitude,adjust",
    "field,noise,reverse,guard,auth",
    "guard,upload",
    "guard,departures",
    "telemetry",
];

/// Packages whose programs users build alone. A dependency may then lack a feature that another package enables.
const PROGRAMS: [&str; 5] = [
    "uav-relay-sim",
    "uav-relay-tools",
    "uav-relay-decode",
    "uav-relay-linux",
    "uav-relay-replay",
];

/// Integration tests of the quick check. They take seconds, and touch each area of the project.
const QUICK_TESTS: [&str; 10] = [
    "asynch",
    "exact",
    "flash",
    "flights",
    "forming",
    "placement",
    "protocol",
    "serial",
    "single",
    "wire",
];

/// Step of `cargo ci`: a command that must succeed.
pub(crate) struct Step {
    pub(crate) name: String,
    pub(crate) command: String,
    environment: &'static [(&'static str, &'static str)],
    pub(crate) lane: Lane,
}

/// Sequence of steps of `cargo ci`. All lanes run at the same time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Lane {
    /// Main lane: its steps run one after the other.
    Main,
    /// Lane of steps that mostly wait for the wall clock.
    ///
    /// Other steps do not delay them.
    /// Such a step starts after the previous step of the main lane. The main lane then continues at once.
    Waiting,
    /// Lane of steps at low priority, one after the other, each with a target folder of its own.
    Background,
}

/// Nightly compiler for the fuzzer and for Miri.
///
/// The date of the compiler is fixed, so that a commit always has the same result.
pub(crate) const NIGHTLY: &str = "nightly-2026-10-30";

/// Command that installs cargo-fuzz in the target folder, unless it is there. Only this project uses that copy.
///
/// The program only starts cargo and the fuzz targets, so that it is not optimised.
const ADD_CARGO_FUZZ: &str = "cargo install cargo-fuzz --version 0.13.2 --locked --debug --root target/tools --target-dir target/tools/build";

/// Path of the program that [`ADD_CARGO_FUZZ`] installs.
const CARGO_FUZZ: &str = "target/tools/bin/cargo-fuzz";

/// Number of inputs per fuzz target.
///
/// The seed is fixed, so these inputs find regressions; only a long run finds new faults.
const EXECUTIONS: u32 = 10_000;

fn step(name: impl Into<String>, command: impl Into<String>) -> Step {
    Step {
        name: name.into(),
        command: command.into(),
        environment: &[],
        lane: Lane::Main,
    }
}

/// Returns `steps` for the background lane: at the same time as other lanes, at low priority.
///
/// These steps use the time in which many tests of other lanes wait for the wall clock.
fn in_background(steps: Vec<Step>) -> impl Iterator<Item = Step> {
    let moved = |step| Step {
        lane: Lane::Background,
        ..step
    };
    steps.into_iter().map(moved)
}

impl Step {
    /// Runs the step's command, and copies its standard output to `out`.
    ///
    /// In a lane other than the main lane, the error output goes to `out` as well; in the main lane, to this program's
    /// error output.
    ///
    /// # Errors
    /// The relevant output, if the command fails.
    pub(crate) fn run(&self, out: &mut impl Write) -> Result<(), Evidence> {
        let mut evidence = Evidence::default();
        let passed = self.start().and_then(|(mut child, output)| {
            evidence.read(BufReader::new(output), out)?;
            child.wait()
        });
        match passed {
            Ok(status) if status.success() => Ok(()),
            Ok(_) => Err(evidence),
            Err(error) => {
                evidence.add(&format!("{}: {error}", self.command));
                Err(evidence)
            }
        }
    }

    /// Starts the step's command. Returns its process, and the pipe with its output.
    fn start(&self) -> Result<(Child, PipeReader), Error> {
        let (reader, writer) = pipe()?;
        let priority = if self.lane == Lane::Background {
            "nice -n 10 "
        } else {
            ""
        };
        let line = format!("{priority}{}", self.command);
        let mut words = line.split_whitespace();
        let mut command = Command::new(words.next().unwrap_or("cargo"));
        command.args(words).envs(self.environment.iter().copied());
        if self.lane != Lane::Main {
            command.stderr(writer.try_clone()?);
        }
        let child = command.stdout(writer).spawn()?;
        Ok((child, reader))
    }
}

/// Returns the steps of the quick check, in order.
pub(crate) fn quick() -> Vec<Step> {
    let tests: Vec<String> = QUICK_TESTS.map(|test| format!("--test {test}")).into();
    let mut steps = first();
    steps.push(step(
        "the library's tests, and the quick ones",
        format!(
            "cargo test --workspace --no-fail-fast --locked --lib {}",
            tests.join(" ")
        ),
    ));
    steps
}

/// Returns all steps of `cargo ci`, in order.
pub(crate) fn all() -> Vec<Step> {
    let mut steps = first();
    steps.extend(clippy());
    steps.extend(PROGRAMS.map(|package| {
        step(
            format!("programs of {package} alone"),
            format!("cargo check -p {package} --bins --locked"),
        )
    }));
    steps.extend(workspace_tests());
    steps.push(step(
        "the commands of the pages",
        "cargo run --quiet --package uav-relay-xtask --bin pages",
    ));
    steps.extend(SETS.map(with_features));
    steps.push(Step {
        environment: &[("RUSTDOCFLAGS", "-D warnings")],
        ..step("documentation", "cargo doc --workspace --no-deps --locked")
    });
    steps.push(step(
        "public items",
        "cargo run --quiet --package uav-relay-xtask --bin items",
    ));
    steps.extend(firmware());
    steps.extend(in_background(embassy()));
    steps.push(step(
        "the slow commands of the pages",
        "cargo run --quiet --package uav-relay-xtask --bin pages -- --slow",
    ));
    steps.push(step("cost, and no panic", "cargo cost"));
    let mut apart = vec![step(
        "templates of a firmware, in empty folders",
        "cargo template --check",
    )];
    for (name, features) in [
        ("oldest compiler", "--features=defmt,async"),
        ("oldest compiler, no features", "--no-default-features"),
    ] {
        let check = "cargo check -p uav-relay --locked --target-dir target/oldest";
        apart.push(step(
            name,
            format!("rustup run {OLDEST} {check} {features}"),
        ));
    }
    apart.push(step(
        "the packaged crate, target",
        format!(
            "cargo package -p uav-relay --locked --allow-dirty --target {TARGET} --target-dir target/packaged"
        ),
    ));
    steps.push(step(
        "packages: licences, sources, duplicates, links",
        "cargo run --quiet --package uav-relay-xtask --bin packages",
    ));
    apart.extend(nightly());
    steps.extend(in_background(apart));
    steps
}

/// Integration test that mostly waits for the wall clock.
const WAITING_TEST: &str = "companion";

/// Number of tests of [`WAITING_TEST`] that run at a time.
///
/// The number may exceed that of the cores, because each test uses a few per cent of a core.
const WAITING_TESTS: &str = "6";

/// Returns the steps that build all programs and tests of the workspace, and run the tests.
///
/// All of these steps select the whole workspace. Cargo enables the features that any selected package needs of a
/// dependency. A step with another selection of packages would compile most packages once more.
fn workspace_tests() -> Vec<Step> {
    let others: Vec<String> = integration_tests()
        .into_iter()
        .filter(|test| test != WAITING_TEST)
        .map(|test| format!(" --test {test}"))
        .collect();
    let test = "cargo test --workspace --no-fail-fast --locked";
    vec![
        step(
            "all programs and tests, built",
            "cargo build --workspace --all-targets --locked",
        ),
        Step {
            lane: Lane::Waiting,
            environment: &[("PROGRAMS", "built"), ("RUST_TEST_THREADS", WAITING_TESTS)],
            ..step(
                "tests of companions",
                format!("{test} --test {WAITING_TEST}"),
            )
        },
        Step {
            environment: &[("PROGRAMS", "built")],
            ..step("tests", format!("{test} --lib --bins{}", others.concat()))
        },
        step(
            "examples in the documentation",
            "cargo test --workspace --no-fail-fast --locked --doc",
        ),
    ]
}

/// Returns the names of all integration tests of the workspace, sorted.
fn integration_tests() -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let manifest = std::fs::read_to_string(root.join("Cargo.toml")).unwrap_or_default();
    let (_, members) = manifest.split_once("members = [").unwrap_or_default();
    let members = members.split(']').next().unwrap_or_default();
    let mut names: Vec<String> = members
        .split(',')
        .map(|member| root.join(member.trim().trim_matches('"')).join("tests"))
        .flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten().flatten())
        .map(|entry| entry.path())
        .filter(|path| {
            path.extension().is_some_and(|end| end == "rs") || path.join("main.rs").is_file()
        })
        .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
        .collect();
    names.sort();
    names.dedup();
    names
}

fn first() -> Vec<Step> {
    vec![
        step("formatting", "cargo fmt --all --check"),
        step(
            "doc comments",
            "cargo run --quiet --package uav-relay-xtask --bin comments",
        ),
        step(
            "clippy, host",
            "cargo clippy --workspace --all-targets --locked -- -D warnings",
        ),
    ]
}

fn clippy() -> Vec<Step> {
    let on_target = |name, features| {
        let check = "cargo clippy -p uav-relay --lib --examples --locked";
        let command = format!("{check} --target {TARGET} {features} -- -D warnings");
        step(name, command)
    };
    vec![
        on_target("clippy, target", ""),
        on_target("clippy, target, no features", "--no-default-features"),
        on_target(
            "clippy, target, its log, asynchronous",
            "--features defmt,async,internals",
        ),
    ]
}

/// Returns the steps for the Embassy examples, a separate workspace.
///
/// They build the examples for each chip, and test the application on the host.
fn embassy() -> Vec<Step> {
    const MANIFEST: &str = "--manifest-path examples/embassy/Cargo.toml";
    const HOST: &str = "-p relay-app --locked --target-dir target/embassy";
    let mut steps = vec![
        step(
            "Embassy, formatting",
            format!("cargo fmt {MANIFEST} --all --check"),
        ),
        step(
            "Embassy, clippy, its tests",
            format!("cargo clippy {MANIFEST} {HOST} --all-targets -- -D warnings"),
        ),
        step(
            "Embassy, the application on a PC",
            format!("cargo test {MANIFEST} {HOST}"),
        ),
    ];
    for (package, target) in [
        ("relay-stm32f405", TARGET),
        ("relay-nucleo-f446re", TARGET),
        ("relay-pico2", TARGET_V8M),
    ] {
        let what = format!(
            "{MANIFEST} -p relay-app -p {package} --locked --target {target} --target-dir target/embassy"
        );
        steps.push(step(
            format!("Embassy, clippy, {package}"),
            format!("cargo clippy {what} --profile firmware -- -D warnings"),
        ));
        steps.push(step(
            format!("Embassy, {package}"),
            format!("cargo build {what} --profile firmware"),
        ));
    }
    steps
}

/// Returns the step that tests the library and a simulated chain with the features in `set` only.
///
/// `set` is a list of features with commas between them.
///
/// The exhaustive model check of views depends on no feature, and takes most of the time of the library's tests. It
/// runs only with no feature and with all features. The remaining tests take seconds, so the library is not optimised
/// for them.
fn with_features(set: &str) -> Step {
    let features: Vec<String> = set
        .split_terminator(',')
        .map(|feature| format!("uav-relay-features/{feature}"))
        .collect();
    let name = if set.is_empty() {
        "tests and a flight, no features".to_owned()
    } else {
        format!("tests and a flight, {set}")
    };
    let test = "cargo test -p uav-relay -p uav-relay-features --lib --tests --locked";
    let (profile, without_model) = if set.is_empty() {
        ("", "")
    } else {
        (
            " --config profile.dev.package.uav-relay.opt-level=0 --config profile.dev.package.uav-relay.codegen-units=4",
            " -- --skip one_sequence_of_views",
        )
    };
    let command = format!(
        "{test}{profile} --no-default-features --features={}{without_model}",
        features.join(",")
    );
    step(name, command)
}

fn firmware() -> Vec<Step> {
    let build = |name, features| {
        let build = "cargo build -p uav-relay --examples --locked";
        let command = format!("{build} --profile firmware --target {TARGET} {features}");
        step(name, command)
    };
    vec![
        // Checks the default members, as a user at the root and `cargo hack check --target` do without --package.
        step(
            "the default members, target",
            format!("cargo check --locked --target {TARGET}"),
        ),
        build("firmware", ""),
        build("firmware, no features", "--no-default-features"),
        build("firmware, asynchronous", "--features async"),
        build("firmware, its log by the probe", "--features rtt"),
    ]
}

/// Returns the names of the fuzz targets, sorted.
fn fuzz_targets() -> Vec<String> {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../fuzz/harness/fuzz_targets");
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let stem = |path: PathBuf| Some(path.file_stem()?.to_str()?.to_owned());
    let mut names: Vec<String> = entries.filter_map(|entry| stem(entry.path())).collect();
    names.sort();
    names
}

/// Returns the steps that need the nightly compiler: all fuzz targets, and the fuzz corpora with Miri.
///
/// Each fuzz target starts from its corpus, the stored inputs.
fn nightly() -> Vec<Step> {
    let mut steps = vec![step("fuzz smoke, cargo-fuzz", ADD_CARGO_FUZZ)];
    for target in fuzz_targets() {
        // Findings go to a folder that is not part of the corpus; libFuzzer fails if the folder does not exist.
        let found = format!("target/fuzz/{target}");
        _ = std::fs::create_dir_all(&found);
        let fuzz = format!(
            "rustup run {NIGHTLY} {CARGO_FUZZ} fuzz run --fuzz-dir host-tests/fuzz/harness --target-dir target/fuzz/build"
        );
        let corpora = format!("{found} host-tests/fuzz/corpus/{target}");
        let command = format!(
            "{fuzz} --sanitizer none {target} {corpora} -- -seed=1 -runs={EXECUTIONS} -max_total_time=60"
        );
        steps.push(step(format!("fuzz smoke, {target}"), command));
    }
    // Miri has the target's pointer width: on x86 libm computes square roots in assembly, which Miri does not
    // support. With isolation it could not read the corpora.
    steps.push(Step {
        environment: &[("MIRIFLAGS", "-Zmiri-disable-isolation")],
        ..step(
            "miri",
            format!(
                "rustup run {NIGHTLY} cargo miri test -p uav-relay-fuzz --test fuzz --target armv7-unknown-linux-gnueabihf --target-dir target/miri"
            ),
        )
    });
    steps
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use super::{Lane, Step, WAITING_TEST, all, fuzz_targets, integration_tests, quick, step};

    #[test]
    fn a_failed_background_step_is_reported_with_its_output() {
        let step = Step {
            lane: Lane::Background,
            ..step("list", "ls --no-such-option")
        };
        let mut out = Vec::new();
        let evidence = step.run(&mut out).unwrap_err();
        assert!(evidence.to_string().contains("no-such-option"));
        assert!(String::from_utf8(out).unwrap().contains("no-such-option"));
    }

    #[test]
    fn steps_in_the_background_have_a_target_folder_of_their_own() {
        for step in all().iter().filter(|step| step.lane == Lane::Background) {
            let command = &*step.command;
            let is_apart = command.contains("--target-dir ") || command == "cargo template --check";
            assert!(is_apart || command.contains(" fmt "), "{command}");
        }
        assert!(quick().iter().all(|step| step.lane == Lane::Main));
    }

    #[test]
    fn every_fuzz_target_has_a_step() {
        for name in fuzz_targets() {
            let run = format!(" {name} target/fuzz/{name} ");
            assert!(
                all().iter().any(|step| step.command.contains(&run)),
                "{name}"
            );
        }
        assert!(fuzz_targets().iter().any(|name| name == "mavlink"));
    }

    #[test]
    fn every_integration_test_of_the_workspace_is_listed() {
        let listed = integration_tests();
        for name in [WAITING_TEST, "browser", "chain", "cli", "qemu", "wireshark"] {
            assert!(
                listed.iter().any(|test| test == name),
                "{name} of {listed:?}"
            );
        }
        let metadata = ["metadata", "--no-deps", "--format-version", "1"];
        let output = Command::new(env!("CARGO")).args(metadata).output().unwrap();
        let text = String::from_utf8(output.stdout).unwrap();
        let after = text.split(r#"{"kind":["test"],"#).skip(1);
        let mut known: Vec<&str> = after
            .filter_map(|target| target.split(r#""name":""#).nth(1)?.split('"').next())
            .collect();
        known.sort_unstable();
        known.dedup();
        assert_eq!(listed, known);
    }
}
