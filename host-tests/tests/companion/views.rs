//! Stored votes on views: a restarted process is bound by them.

use std::path::{Path, PathBuf};

use host_tests::fixtures::voted;
use uav_relay::wire::digest::digest;
use uav_relay::{Mission, ViewRecord};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;

use crate::medium::{Medium, QUIET};
use crate::process::{Ended, Relay};
use crate::simulated;

/// Relays of a chain on one channel, and a folder for their files.
struct Channel {
    medium: Medium,
    folder: tempfile::TempDir,
}

impl Channel {
    fn new(relays: usize) -> Self {
        Self {
            medium: Medium::new(relays, QUIET),
            folder: tempfile::tempdir().unwrap(),
        }
    }

    fn file(&self, index: usize) -> PathBuf {
        self.folder.path().join(format!("views{index}"))
    }

    fn start(&self, index: usize) -> Relay {
        let file = self.file(index);
        Relay::start(&[
            "--index",
            &index.to_string(),
            "--of",
            "3",
            "--shared",
            self.medium.tty(index - 1),
            "--probe-after-ms",
            "500",
            "--dead-after-ms",
            "1500",
            "--view-file",
            file.to_str().unwrap(),
        ])
    }
}

fn loaded() -> Mission {
    let (mission, _) = mission::mission(&Scenario::default(), 3, 1e-4).unwrap();
    mission
}

fn store(file: &Path, record: &ViewRecord) -> Vec<u8> {
    let mut bytes = record.to_bytes().to_vec();
    let check = crc::Crc::<u32>::new(&crc::CRC_32_ISCSI).checksum(&bytes);
    bytes.extend(check.to_le_bytes());
    std::fs::write(file, &bytes).unwrap();
    bytes
}

fn stored(file: &Path) -> ViewRecord {
    let bytes = std::fs::read(file).unwrap();
    ViewRecord::from_bytes(&bytes[..ViewRecord::LENGTH]).unwrap()
}

const STANDS_BY: &str = "restored: votes of before this start, from --view-file; before another flight remove that file";

/// Kills all relays in a view of two; restarted, three fly, and no view number is used twice.
#[test]
fn three_that_are_started_again_stand_by_what_they_said() {
    let expected = simulated(&Scenario::default(), 3);
    let channel = Channel::new(3);
    let mut relays: Vec<Relay> = (1..=3).map(|index| channel.start(index)).collect();
    for (relay, place) in relays.iter_mut().zip(&expected) {
        relay.settles_at(*place);
        assert!(!relay.has_said("restored: "));
    }
    drop(relays.pop());
    let of_two = simulated(&Scenario::default(), 2);
    for (relay, place) in relays.iter_mut().zip(&of_two) {
        relay.settles_at(*place);
    }
    drop(relays);
    let before: Vec<ViewRecord> = (1..=3).map(|index| stored(&channel.file(index))).collect();
    let mut relays: Vec<Relay> = (1..=3).map(|index| channel.start(index)).collect();
    for (relay, place) in relays.iter_mut().zip(&expected) {
        relay.line(STANDS_BY);
        relay.settles_at(*place);
    }
    drop(relays);
    for (index, before) in (1..).zip(before) {
        assert_ne!(stored(&channel.file(index)), before, "relay {index}");
    }
}

/// Exit status after which the unit does not restart the companion.
const NOT_RETRIED: i32 = 2;

#[test]
fn the_unit_does_not_retry_what_a_restart_cannot_mend() {
    let unit = include_str!("../../../examples/linux_companion/uav-relay@.service");
    let setting = format!("RestartPreventExitStatus={NOT_RETRIED}");
    assert!(unit.lines().any(|line| line == setting), "{unit}");
}

/// Checks two of three relays, a quorum of the loaded chain, but not of a stored view without them.
#[test]
fn two_that_remember_a_view_without_them_do_not_fly() {
    let channel = Channel::new(3);
    let said = voted(digest(&loaded()), 1, 40, false);
    for index in [1, 2] {
        store(&channel.file(index), &said);
    }
    let mut relays = [1, 2].map(|index| channel.start(index));
    relays[0].line(STANDS_BY);
    relays[0].line("no quorum: ");
    for relay in &mut relays {
        assert!(!relay.has_said("setpoint: "));
    }
}

#[test]
fn a_file_that_is_of_no_use_is_named_and_nothing_is_flown() {
    let channel = Channel::new(1);
    let file = channel.file(1);
    let good = store(&file, &voted(digest(&loaded()), 3, 40, true));
    let other = store(&file, &voted(digest(&loaded()) ^ 1, 3, 40, true));
    let mut damaged = good.clone();
    damaged[7] ^= 1;
    let is_damaged = "is damaged, or no record of views: remove the file before the next flight, and start again";
    for (bytes, words) in [
        (damaged, is_damaged),
        (good[..good.len() - 1].to_vec(), is_damaged),
        ([&good[..], &[0]].concat(), is_damaged),
        (Vec::new(), is_damaged),
        (
            other,
            "the record is of a relay that was loaded with another mission: for a new flight remove the file, and start again; in the same \
             flight start the relay with the mission that it had",
        ),
    ] {
        std::fs::write(&file, &bytes).unwrap();
        let Ended {
            status,
            stdout,
            stderr,
        } = channel.start(1).end();
        let line = format!("--view-file {}: {words}", file.display());
        assert_eq!(
            (status, stderr),
            (Some(NOT_RETRIED), vec![line]),
            "{bytes:?}"
        );
        assert_eq!(stdout, Vec::<String>::new());
        assert_eq!(std::fs::read(&file).unwrap(), bytes);
    }
    std::fs::write(&file, &good).unwrap();
    channel.start(1).line(STANDS_BY);
}
