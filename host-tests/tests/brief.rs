//! The configuration of a drone: `cargo brief` writes it, the firmware's own code reads it, and nothing damaged gets through.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    missing_docs
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use host_tests::firmware::block::{BlockError, Flight};
use host_tests::firmware::config::{Block, ConfigError, LEN, read};
use host_tests::scenario::Scenario;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::channel::ChannelError;
use uav_relay::mission::MissionError;

fn example() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/scenario.toml")
}

fn paper() -> Block {
    let flight = Flight::new(&Scenario::default(), 5, 1e-4, 7).unwrap();
    flight.block(3).unwrap()
}

/// `block` with `bytes` at `at`, and the CRC that belongs to it.
fn with(at: usize, bytes: &[u8]) -> Block {
    let mut block = paper();
    block[at..at + bytes.len()].copy_from_slice(bytes);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&block[..LEN - 4]);
    block[LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    block
}

fn brief(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_brief"))
        .args(arguments)
        .output()
        .unwrap()
}

/// The one line on standard error; the exit status is 2.
fn refusal(arguments: &[&str]) -> String {
    let output = brief(arguments);
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(text.trim_end().lines().count(), 1, "{arguments:?}: {text}");
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
    text
}

/// The table in `config.rs`, byte by byte.
#[test]
fn a_block_is_what_the_table_says() {
    let mut by_hand: Vec<u8> = b"UAVR\x01\0\x60\0\x03\0\x07\0\x05\0\0\0".to_vec();
    for number in [
        1000.0_f32, 4.0, 80.0, 20.0, 1.0, 20.0, 1.0, 80.0, 500.0, 400.0, 1e-4,
    ] {
        by_hand.extend(number.to_le_bytes());
    }
    for number in [2e9_f64, libm::pow(10.0, 0.01), libm::pow(10.0, 2.1), 1.0] {
        by_hand.extend(number.to_le_bytes());
    }
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&by_hand);
    by_hand.extend(crc.to_le_bytes());
    assert_eq!(by_hand, paper());
}

#[test]
fn a_drone_reads_the_very_mission_of_the_scenario() {
    let scenario = Scenario::load(&example()).unwrap();
    let flight = Flight::new(&scenario, 6, 1e-3, 9).unwrap();
    for index in 1..=6 {
        let config = read(&flight.block(index).unwrap()).unwrap();
        assert_eq!(config.mission, *flight.mission());
        assert_eq!((config.identity.index, config.identity.network), (index, 9));
        let altitude = if index == 2 { 55.0 } else { 40.0 };
        let power = if index == 5 { 1.0 } else { 2.0 };
        assert_eq!(
            (config.profile.altitude_m, config.profile.power_w),
            (altitude, power)
        );
    }
    for index in [0, 7] {
        assert_eq!(
            flight.block(index),
            Err(BlockError::Config(ConfigError::Index))
        );
    }
}

#[test]
fn no_bit_can_flip_unnoticed() {
    for at in 0..LEN {
        for bit in 0..8 {
            let mut block = paper();
            block[at] ^= 1 << bit;
            let expected = match at {
                0..4 => ConfigError::Magic,
                4..8 => ConfigError::Version,
                _ => ConfigError::Crc,
            };
            assert_eq!(read(&block), Err(expected), "bit {bit} of byte {at}");
        }
    }
}

#[test]
fn a_number_out_of_range_is_named() {
    let nan = f32::NAN.to_le_bytes();
    for (at, bytes, error) in [
        (8, &[0, 0][..], ConfigError::Index),
        (8, &[6, 0], ConfigError::Index),
        (12, &[0, 0], ConfigError::Mission(MissionError::Relays)),
        (14, &[1, 0], ConfigError::Reserved),
        (16, &nan, ConfigError::Mission(MissionError::Distance)),
        (20, &nan, ConfigError::Mission(MissionError::Separation)),
        (24, &nan, ConfigError::Mission(MissionError::TxPower)),
        (28, &nan, ConfigError::Mission(MissionError::Common)),
        (32, &nan, ConfigError::Mission(MissionError::Common)),
        (36, &nan, ConfigError::Profile),
        (40, &nan, ConfigError::Profile),
        (
            44,
            &nan,
            ConfigError::Mission(MissionError::InterfererPower),
        ),
        (
            48,
            &nan,
            ConfigError::Mission(MissionError::InterfererPlace),
        ),
        (
            52,
            &nan,
            ConfigError::Mission(MissionError::InterfererPlace),
        ),
        (56, &nan, ConfigError::Mission(MissionError::Tolerance)),
        (60, &[0; 8], ConfigError::Channel(ChannelError::Carrier)),
        (68, &[0; 8], ConfigError::Channel(ChannelError::ExcessLoss)),
        (76, &[0; 8], ConfigError::Channel(ChannelError::ExcessLoss)),
        (84, &[0xFF; 8], ConfigError::Channel(ChannelError::Weight)),
    ] {
        assert_eq!(read(&with(at, bytes)), Err(error), "byte {at}");
    }
    assert_eq!(read(&[0xFF; LEN]), Err(ConfigError::Blank));
    assert_eq!(read(&[0; LEN]), Err(ConfigError::Blank));
}

/// Whatever is in the flash, with a good CRC: a configuration in range, or an error.
#[test]
fn any_bytes_are_a_configuration_or_an_error() {
    let mut rng = ChaCha8Rng::seed_from_u64(host_tests::random::seed(41));
    let mut good = 0;
    for _ in 0..20_000 {
        let at = rng.random_range(8..LEN - 8);
        let bytes: [u8; 4] = rng.random();
        good += u32::from(read(&with(at, &bytes)).is_ok());
        let noise: [u8; LEN] = rng.random();
        assert!(read(&noise).is_err());
    }
    assert!((100..19_000).contains(&good), "{good} of 20000 were good");
}

#[test]
fn the_command_writes_the_block() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("relay3.bin");
    let output = brief(&[
        "--uavs",
        "5",
        "--index",
        "3",
        "--network",
        "7",
        "--out",
        out.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(std::fs::read(&out).unwrap(), paper());
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("relay 3 of 5, network 7") && text.contains("0x080e0000"),
        "{text}"
    );
}

#[test]
fn what_is_wrong_is_said_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("block.bin");
    let out = out.to_str().unwrap();
    for (arguments, words) in [
        (
            &["--uavs", "5", "--index", "6", "--out", out][..],
            "--index 6: must be within 1 to 5",
        ),
        (
            &["--uavs", "5", "--index", "0", "--out", out],
            "'--index <I>'",
        ),
        (&["--uavs", "5", "--out", out], "--index <I>"),
        (
            &[
                "--uavs",
                "5",
                "--index",
                "1",
                "--network",
                "65536",
                "--out",
                out,
            ],
            "--network",
        ),
        (
            &[
                "--uavs",
                "5",
                "--index",
                "1",
                "--tolerance",
                "2",
                "--out",
                out,
            ],
            "tolerance must be within",
        ),
        (
            &["--uavs", "600", "--index", "1", "--out", out],
            "no placement",
        ),
        (
            &["--uavs", "5", "--index", "1", "--out", "/nowhere/block.bin"],
            "--out cannot be written",
        ),
        (
            &[
                "--scenario",
                "/nowhere.toml",
                "--uavs",
                "5",
                "--index",
                "1",
                "--out",
                out,
            ],
            "/nowhere.toml",
        ),
    ] {
        let text = refusal(arguments);
        assert!(text.contains(words), "{arguments:?}: {text}");
    }
    assert!(!Path::new(out).exists());
}
