//! MAVLink codec compared with independent ones, in both directions, and with noise.

#![cfg(target_os = "linux")]

mod noise;
mod ours;
mod signing;
mod theirs;

use std::fmt::Write as _;
use std::path::Path;

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::flight::mavlink::frame::Address;
use uav_relay::flight::mavlink::incoming::{Parser, Received, noise_w};

const COMPANION: Address = Address {
    system: 7,
    component: 191,
};

const AUTOPILOT: Address = Address {
    system: 7,
    component: 1,
};

fn peer() -> &'static Path {
    Path::new(concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tests/mavlink/peer.py"
    ))
}

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut line, byte| {
        let _ = write!(line, "{byte:02x}");
        line
    })
}

fn unhex(line: &str) -> Vec<u8> {
    (0..line.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&line[at..at + 2], 16).unwrap())
        .collect()
}

fn parse(parser: &mut Parser, bytes: &[u8]) -> Vec<Received> {
    let mut all = Vec::new();
    for byte in bytes {
        parser.push(*byte);
        while let Some(received) = parser.next_message() {
            all.push(received);
        }
    }
    all
}
