//! Configuration of a drone. `cargo provision` writes it, the firmware's own code reads it, and damaged blocks are rejected.
#![cfg(test)]
#![allow(clippy::float_cmp)]

mod block;
mod command;
mod fleet;
mod parts;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use uav_relay_scenario::{BetaPoint, Field, Interference, Scenario};
use uav_relay_tools::provision::block::Flight;
use uav_relay_tools::provision::config::{Block, Config, ConfigError, EMPTY, LEN, read};

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/scenario.toml")
}

fn paper() -> Block {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    flight.block(3).unwrap()
}

fn in_a_field(points: usize) -> Scenario {
    let point = |k| BetaPoint {
        x_m: 100.0 * k as f64,
        alpha: 2.0,
        beta: 1.0 + k as f64,
    };
    Scenario {
        interference: Interference::Field(Field {
            i_max_w: 2e-10,
            beta: (0..points).map(point).collect(),
        }),
        ..Scenario::default()
    }
}

fn field(points: usize) -> Block {
    let flight = Flight::new(&in_a_field(points), 5, 1e-4, 7).unwrap();
    flight.block(3).unwrap()
}

/// Writes a file with the key `key` that only its owner can read.
fn write_key(file: impl AsRef<Path>, key: &str) {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::write(&file, key).unwrap();
    std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o600)).unwrap();
}

fn reads(block: &Block) -> Result<Config, ConfigError> {
    read(block, Box::leak(Box::new(EMPTY)))
}

/// Returns the block of the paper's scenario with `bytes` at the offset `at`, and a matching CRC.
fn with(at: usize, bytes: &[u8]) -> Block {
    changed(paper(), at, bytes)
}

fn changed(mut block: Block, at: usize, bytes: &[u8]) -> Block {
    block[at..at + bytes.len()].copy_from_slice(bytes);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&block[..LEN - 4]);
    block[LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    block
}

fn of_paper(out: impl AsRef<Path>) -> String {
    let out = out.as_ref().display();
    format!("--uavs 5 --index 3 --network 7 --out {out}")
}

fn provision(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_provision"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

/// Runs `provision`, checks that it exits with status 2, and returns its error line.
fn refusal(arguments: &str) -> String {
    let output = provision(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    text
}
