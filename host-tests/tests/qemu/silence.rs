//! Drones that fall silent, and drones without a valid configuration.

use std::time::Instant;

use host_tests::firmware::emulator::SPEED;
use uav_relay::Settings;
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_tools::provision::config::LEN;

use crate::chain::{paper, simulated};
use crate::fleet::{Fleet, Image, OF_THE_CHIP};
use crate::log::Line;
use crate::methods::field;

/// Tolerance for delays of this machine, µs of the drones' clocks. These clocks run 10.5 times too fast.
///
/// The test `a_silent_relay_is_noticed_by_both_neighbours_in_time` checks the exact time in simulation.
const SLACK: u64 = 525_000;

/// Checks that both neighbours report a switched-off drone in time, measured by their own clocks.
#[test]
fn both_neighbours_notice_a_drone_that_is_switched_off() {
    let flight = paper(5);
    let mut fleet = Fleet::of(Image::Wires, &flight, Faults::default(), 1);
    assert_eq!(fleet.places(), simulated(&flight));
    let question = Instant::now();
    let asked = [2, 4].map(|drone| fleet.counters(drone).at);
    let before = fleet.lines.len();
    fleet.kill(3);
    let until_killed = question.elapsed().mul_f64(SPEED).as_micros();
    let slack = SLACK + u64::try_from(until_killed).unwrap();
    let sides = [
        (
            2,
            "node 3 downstream (toward Rx) does not reply: look for that drone",
            asked[0],
        ),
        (
            4,
            "node 3 upstream (toward Tx) does not reply: look for that drone",
            asked[1],
        ),
    ];
    let noticed = |lines: &[Line], (drone, text, _): &(u16, &str, u64)| {
        let mut new = lines[before..].iter();
        new.find(|line| line.drone == *drone && line.text == *text)
            .map(|line| line.at)
    };
    fleet.wait("two neighbours that notice", |lines| {
        sides.iter().all(|side| noticed(lines, side).is_some())
    });
    let Settings {
        dead_after: lost,
        probe_after: quiet,
        ..
    } = Settings::default();
    for side in &sides {
        let took = noticed(&fleet.lines, side).unwrap() - side.2;
        println!(
            "drone {} noticed after {took} us of its own clock, give or take {slack}",
            side.0
        );
        // Up to 48 requests, a third of a second apart, must be unanswered first.
        let questions = quiet.as_micros() + 48 * 300_000 * 9 / 8;
        assert!(took <= questions.max(lost.as_micros()) + slack, "{took} us");
        // The last frame may have been received up to `probe_after` before the drone was switched off.
        assert!(
            took + quiet.as_micros() + SLACK >= lost.as_micros(),
            "{took} us"
        );
    }
    // The neighbours hold their positions, and the other drones are unaffected.
    assert_eq!(fleet.places(), simulated(&flight));
    for drone in [1, 5] {
        let mut lost = fleet
            .of_drone(drone)
            .filter(|line| line.text.contains("does not reply"));
        assert_eq!(lost.next(), None);
    }
}

#[test]
fn a_drone_with_a_bad_configuration_stays_out_and_logs_why() {
    let flight = paper(3);
    let good = flight.block(2).unwrap().to_vec();
    let mut damaged = good.clone();
    damaged[20] ^= 1;
    let mut other_version = good.clone();
    other_version[4] = other_version[4].wrapping_add(1);
    let field = field().block(2).unwrap().to_vec();
    let blocks = [
        vec![0xFF; LEN],
        vec![0; LEN],
        damaged,
        other_version,
        with(&good, 8, &4_u16.to_le_bytes()),
        with(&good, 16, &0.5_f32.to_le_bytes()),
        with(&good, 36, &f32::NAN.to_le_bytes()),
        with(&good, 60, &1.0_f64.to_le_bytes()),
        with(&good, 92, &30.0_f32.to_le_bytes()),
        with(&good, 100, &30.0_f32.to_le_bytes()),
        with(&good, 14, &[3]),
        with(&good, 15, &[2]),
        with(&good, 112, &[1]),
        with(&good, 120, &[1]),
        with(&good, 114, &[17]),
        with(&good, 208, &[1]),
        with(&field, 44, &80.0_f32.to_le_bytes()),
        with(&field, 128, &0.0_f32.to_le_bytes()),
    ];
    let words = [
        "no configuration: the configuration block in flash is blank, so this relay does nothing: provision the drone",
        "no configuration: the configuration block in flash is blank, so this relay does nothing: provision the drone",
        "configuration refused: the block is damaged (its CRC does not match): provision the drone again",
        "configuration refused: the block has another version or length than this firmware reads: provision the drone again",
        "configuration refused: the relay's index must be within 1 to the number of relays",
        "configuration refused: mission: distance_m must be within 1 to 1e6",
        "configuration refused: this relay's altitude must be within 0.1 to 1e5 m, its power within 1e-6 to 1e6 W",
        "configuration refused: channel: carrier frequency must be within 1e6 to 1e12 Hz",
        "configuration refused: mission: the altitude band, band.least_m to band.most_m, must be within 0.1 to 1e5 and include common.altitude_m",
        "configuration refused: mission: lateral.least_m must be within -1e5 to 0, lateral.most_m within 0 to 1e5",
        "configuration refused: the method must be align, joint or adjust; with an interference field it must be align",
        "configuration refused: byte 15 of the block, which is 1 if the relay keeps its altitude, must be 0 or 1",
        "configuration refused: method adjust: rounds must be within 1 to 65535 and explore_m within 0 to 1e5 m; with another method both must be 0",
        "configuration refused: measured interference: samples (number for each estimate) must be within 100 to 1000000 and i_max_w (maximum power) within 1e-30 to 1e6 W; without measurements both must be 0",
        "configuration refused: the interference field has more points than the block can hold",
        "configuration refused: the bytes after the last point of the interference field must be 0",
        "configuration refused: it has both an interferer and an interference field: leave one out",
        "configuration refused: interference field: upsilon_per_w (mean of 1 / interference power, in 1/W) must be within 1e-9 to 1e32",
    ];
    let mut fleet = Fleet::start(Image::Wires, &blocks, Faults::default(), 1);
    fleet.wait("word from every drone", |lines| {
        lines.len() >= 3 * words.len()
    });
    for (drone, word) in (1..).zip(words) {
        let texts: Vec<&str> = fleet.of_drone(drone).map(|line| &line.text[..]).collect();
        let [started, clock] = OF_THE_CHIP;
        assert_eq!(texts, [started, clock, word], "drone {drone}");
    }
}

#[test]
fn a_drone_with_half_a_key_stays_out_and_logs_why() {
    let good = paper(3).block(2).unwrap().to_vec();
    let blocks = [with(&good, 252, &[1]), with(&good, 256, &[1])];
    let mut fleet = Fleet::start(Image::Wires, &blocks, Faults::default(), 1);
    fleet.wait("word from every drone", |lines| lines.len() >= 8);
    for drone in [1, 2] {
        let texts: Vec<&str> = fleet
            .after_start(drone)
            .map(|line| &line.text[..])
            .collect();
        let refused = "configuration refused: key and epoch must be given together, the epoch within 1 to 4294967294";
        assert_eq!(texts, ["relay 2 of 3, network 7", refused]);
    }
}

/// Returns the configuration block with `bytes` at offset `at`, and its CRC updated.
fn with(block: &[u8], at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut block = block.to_vec();
    block[at..at + bytes.len()].copy_from_slice(bytes);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&block[..LEN - 4]);
    block[LEN - 4..].copy_from_slice(&crc.to_le_bytes());
    block
}
