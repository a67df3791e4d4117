//! First use of the commands: cargo shows its progress, and `cargo chain` builds only what it needs.

use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .unwrap()
}

/// A build without output for a minute looks like a hang.
#[test]
fn no_command_hides_cargos_progress() {
    let text = std::fs::read_to_string(root().join(".cargo/config.toml")).unwrap();
    let aliases: Vec<&str> = text
        .lines()
        .filter(|line| line.contains("= \"run "))
        .collect();
    assert!(
        aliases.iter().any(|line| line.starts_with("chain = ")),
        "{text}"
    );
    for line in aliases {
        let is_quiet = line.contains("--quiet") || line.contains(" -q ");
        assert!(!is_quiet, "{line}");
    }
}

#[test]
fn the_simulator_builds_without_the_crates_of_other_tools() {
    let output = Command::new(env!("CARGO"))
        .current_dir(root())
        .args(["tree", "--package", "uav-relay-sim", "--locked"])
        .args(["--edges", "normal,build", "--prefix", "none"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let is_built = |name: &str| text.lines().any(|line| line.starts_with(name));
    assert!(is_built("uav-relay-scenario v"), "{text}");
    for other in [
        "anstream v",
        "indicatif v",
        "mavlink v",
        "pcap-file v",
        "plotters v",
        "syn v1.",
        "syn v2.",
        "thiserror v1.",
        "toml_edit v",
        "uav-relay-decode v",
        "uav-relay-page v",
        "wasm-bindgen v",
    ] {
        assert!(!is_built(other), "{other}: {text}");
    }
}
