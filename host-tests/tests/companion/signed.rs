//! Relay processes with signed frames.

use std::os::unix::fs::PermissionsExt as _;

use uav_relay_scenario::Scenario;

use crate::chain::{Chain, QUICK, simulated};
use crate::files::Files;
use crate::medium::{Noise, QUIET};
use crate::process::Relay;

fn epoch(files: &Files, name: &str) -> u32 {
    let text = std::fs::read_to_string(files.path(name)).unwrap();
    text.trim().parse().unwrap()
}

fn start(chain: &Chain, index: usize, key: &str) -> Relay {
    let signed = chain.files.signed(key, &format!("epoch{index}"));
    chain.relay(index, &format!("{QUICK} {signed}"))
}

/// Checks that relays with signed frames agree on the simulated chain's positions. This must hold on wires with and
/// without noise, and also after a relay has rebooted.
#[test]
fn three_signing_relays_settle_like_the_simulation() {
    for noise in [QUIET, Noise::bad(3)] {
        let mut chain = Chain::on_wires(3, noise);
        chain.files.write("epoch2", "41\n");
        chain.relays = (1..=3).map(|index| start(&chain, index, "key")).collect();
        assert!(
            chain.relays[1]
                .line("signed: ")
                .contains("epoch 42 (start counter")
        );
        assert_eq!(epoch(&chain.files, "epoch2"), 42);
        // The relay writes the file before the log line.
        chain.relays[0].line("signed: ");
        assert!(
            epoch(&chain.files, "epoch1") > 1_700_000_000,
            "of the clock"
        );
        let expected = simulated(&Scenario::default(), 3);
        assert_eq!(chain.settled(), expected);

        // Relay 2 and then the leader restart; both are accepted and agree again.
        for index in [2, 1] {
            chain.relays.remove(index - 1).stopped();
            let fresh = start(&chain, index, "key");
            chain.relays.insert(index - 1, fresh);
        }
        assert!(
            chain.relays[1]
                .line("signed: ")
                .contains("epoch 43 (start counter")
        );
        assert_eq!(chain.relays[0].settled(), expected[0]);
        assert_eq!(chain.relays[1].settled(), expected[1]);
    }
}

#[test]
fn a_relay_with_a_different_key_is_ignored() {
    let chain = Chain::on_wires(2, QUIET);
    let (mut one, _other) = (start(&chain, 1, "key"), start(&chain, 2, "other"));
    one.line("lost: relay 2 downstream (toward Rx) does not reply");
    assert!(!one.has_printed("setpoint: "));
    let last = one.stopped().pop().unwrap();
    assert!(
        last.contains(" 0 received, ") && !last.contains(" 0 rejected"),
        "{last}"
    );
}

/// Checks that the error lines name a useless key file or epoch file.
///
/// An epoch that cannot be stored is refused, because it must not be used twice.
#[test]
fn a_bad_key_or_epoch_is_named() {
    let files = Files::new();
    files.write_key("short", "5ec2e7");
    files.write("text", "yesterday");
    files.write("last", "4294967295");
    let text = |name: &str| files.text(name);
    let no_number = "text: must contain one number within 0 to 4294967294: the epoch (start counter) of the last start";
    let largest = "last: the epoch (start counter) in the file is the largest one, and every start needs a larger epoch: give all relays a new key, and delete this file";
    let proc = "/proc/self/epoch".to_owned();
    let unwritten = "--epoch-file /proc/self/epoch: cannot be written";
    for (key, epoch, status, words) in [
        (
            "short",
            text("epoch"),
            2,
            "short: must be 64 hexadecimal digits",
        ),
        ("nowhere", text("epoch"), 2, "nowhere: cannot be read"),
        ("key", text("text"), 1, no_number),
        ("key", text("last"), 1, largest),
        ("key", text("no/folder"), 1, "folder: cannot be written"),
        ("key", proc, 1, unwritten),
    ] {
        let key = files.text(key);
        let options = format!("--index 1 --of 1 --key-file {key} --epoch-file {epoch}");
        let (said, line) = Relay::start(&options).fails(status);
        assert!(line.contains(words), "{line}");
        assert!(
            !format!("{said:?} {line}").contains("5ec2"),
            "{said:?} {line}"
        );
    }
    assert_eq!(std::fs::read(files.path("text")).unwrap(), b"yesterday");
    // Either option requires the other.
    for given in ["--key-file", "--epoch-file"] {
        let ended = Relay::start(&format!("--index 1 --of 1 {given} x")).end();
        assert_eq!(ended.status, Some(2));
        assert!(ended.stderr[0].contains("-file"), "{ended:?}");
    }
}

/// Checks that a relay restarted with an older epoch file is rejected, and joins after a repair.
///
/// The repair is a larger number in the epoch file; the neighbour's log states this.
#[test]
fn an_epoch_that_goes_back_is_reported_with_the_remedy() {
    let mut chain = Chain::on_wires(2, QUIET);
    chain.files.write("epoch2", "41\n");
    chain.relays = [1, 2].map(|index| start(&chain, index, "key")).into();
    let settled = chain.settled();
    chain.relays.remove(1).stopped();
    chain.files.write("epoch2", "5\n");
    let mut back = start(&chain, 2, "key");
    assert!(back.line("signed: ").contains("epoch 6 (start counter"));
    let line = chain.relays[0].line("epoch: ");
    let remedy = "epoch: relay 2 has started with an epoch (start counter) that is not above its last one, and its frames are rejected; raise the number in its --epoch-file and restart it";
    assert!(line.ends_with(remedy), "{line}");
    assert!(!back.has_printed("converged: "));
    back.stopped();
    chain.files.write("epoch2", "42\n");
    chain.relays.push(start(&chain, 2, "key"));
    assert_eq!(chain.relays[1].settled(), settled[1]);
}

/// Checks that every program refuses a key file that other users of the computer can read.
#[test]
fn a_key_file_readable_by_others_is_refused() {
    let files = Files::new();
    let (key, epoch) = (files.text("key"), files.text("epoch"));
    let others = std::fs::Permissions::from_mode(0o644);
    std::fs::set_permissions(&key, others).unwrap();
    let signed = format!("--key-file {key} --epoch-file {epoch}");
    let station = "--of 1 --end tx --tty /nowhere/tty --version 1 --new-altitude 30 --yes";
    let line = format!(
        "--key-file {key}: has the mode 0644, so other users of this computer can read or write it; type: chmod 600 {key}"
    );
    for program in [
        Relay::start(&format!("--index 1 --of 1 {signed}")),
        Relay::ground(&format!("{station} {signed}")),
    ] {
        assert_eq!(program.refused_at_once(2), line);
    }
    assert!(!files.path("epoch").exists(), "no epoch was used");
}

#[test]
fn a_missing_key_is_reported() {
    let line = Relay::start("--index 1 --of 1").line("unsigned: ");
    assert!(line.contains("anybody in range can forge them"), "{line}");
}
