//! Stored votes on views: a restarted process is bound by them.

use std::path::Path;

use host_tests::fixtures::voted;
use uav_relay::wire::digest::digest;
use uav_relay::{Mission, ViewRecord};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;

use crate::chain::{Chain, QUICK, simulated};
use crate::medium::{Medium, QUIET};
use crate::process::Relay;

/// Returns a chain of three relays on one channel, with short timeouts. The loss of a relay is therefore noticed soon.
fn channel() -> Chain {
    Chain::on_channel(3, Medium::new(3, QUIET)).with(QUICK)
}

/// Starts relay `index` with a file for its votes on views (membership changes).
fn start(chain: &Chain, index: usize) -> Relay {
    let file = chain.files.text(&format!("views{index}"));
    chain.relay(index, &format!("--view-file {file}"))
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

/// Returns the stored voting record of a relay; `None` if it has never voted.
fn stored(chain: &Chain, index: usize) -> Option<ViewRecord> {
    let bytes = std::fs::read(chain.files.path(&format!("views{index}"))).ok()?;
    Some(ViewRecord::from_bytes(&bytes[..ViewRecord::LENGTH]).unwrap())
}

const STANDS_BY: &str = "restored: this relay's earlier votes on the chain's membership were read from --view-file; on the ground, remove that file before the next flight";

/// Checks that relays killed in a membership view of two relays form a chain of three after a restart.
///
/// No view number is used twice.
#[test]
fn restarted_relays_keep_their_votes() {
    let expected = simulated(&Scenario::default(), 3);
    let mut chain = channel();
    chain.relays = (1..=3).map(|index| start(&chain, index)).collect();
    chain.settles_at(&expected);
    assert!(
        chain
            .relays
            .iter_mut()
            .all(|relay| !relay.has_printed("restored: "))
    );
    drop(chain.relays.pop());
    chain.settles_at(&simulated(&Scenario::default(), 2));
    chain.relays.clear();
    // If the third relay was counted from the start, it has not voted.
    let before = [1, 2, 3].map(|index| stored(&chain, index));
    assert!(before[0].is_some() && before[1].is_some());
    chain.relays = (1..=3).map(|index| start(&chain, index)).collect();
    for (relay, before) in chain.relays.iter_mut().zip(&before) {
        if before.is_some() {
            relay.line(STANDS_BY);
        }
    }
    chain.settles_at(&expected);
    chain.relays.clear();
    for (index, before) in (1..).zip(before) {
        assert_ne!(stored(&chain, index), before, "relay {index}");
    }
}

/// Exit status after which systemd does not restart the companion.
const NOT_RETRIED: i32 = 2;

#[test]
fn the_unit_does_not_restart_after_permanent_errors() {
    let unit = include_str!("../../../examples/linux_companion/uav-relay@.service");
    let setting = format!("RestartPreventExitStatus={NOT_RETRIED}");
    assert!(unit.lines().any(|line| line == setting), "{unit}");
}

/// Checks that two of three relays get no setpoints if their stored membership view excludes them.
///
/// Without that stored view, the two relays would have a quorum.
#[test]
fn two_relays_that_recall_a_view_without_them_do_not_fly() {
    let mut chain = channel();
    let said = voted(digest(&loaded()), 1, 40, false);
    for index in [1, 2] {
        store(&chain.files.path(&format!("views{index}")), &said);
    }
    chain.relays = (1..=2).map(|index| start(&chain, index)).collect();
    chain.relays[0].line(STANDS_BY);
    chain.relays[0].line("no quorum: ");
    assert!(
        chain
            .relays
            .iter_mut()
            .all(|relay| !relay.has_printed("setpoint: "))
    );
}

#[test]
fn a_useless_view_file_is_named_and_prevents_the_flight() {
    let chain = channel();
    let file = chain.files.path("views1");
    let good = store(&file, &voted(digest(&loaded()), 3, 40, true));
    let other = store(&file, &voted(digest(&loaded()) ^ 1, 3, 40, true));
    let mut damaged = good.clone();
    damaged[7] ^= 1;
    let is_damaged = "the file is damaged, or has no record of votes on the chain's membership. Before a new flight, delete the file and start again. In the same flight, the relay cannot rejoin the chain";
    for (bytes, words) in [
        (damaged, is_damaged),
        (good[..good.len() - 1].to_vec(), is_damaged),
        ([&good[..], &[0]].concat(), is_damaged),
        (Vec::new(), is_damaged),
        (
            other,
            "the record of votes was written by a relay that was loaded with another mission. Before a new flight, delete this file and start again. In the same \
             flight, start the relay with the mission that it had before",
        ),
    ] {
        std::fs::write(&file, &bytes).unwrap();
        let line = format!("--view-file {}: {words}", file.display());
        assert_eq!(
            start(&chain, 1).refused_at_once(NOT_RETRIED),
            line,
            "{bytes:?}"
        );
        assert_eq!(std::fs::read(&file).unwrap(), bytes);
    }
    std::fs::write(&file, &good).unwrap();
    start(&chain, 1).line(STANDS_BY);
}
