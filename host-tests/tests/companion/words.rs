//! Error messages word by word: each names the mistake.

use std::os::unix::fs::PermissionsExt as _;

use crate::chain::Chain;
use crate::files::Files;
use crate::medium::{Medium, QUIET};
use crate::process::Relay;
use crate::pty::Pty;

#[test]
fn a_mistyped_option_or_number_is_named() {
    let whole = "must be a whole number within";
    for (wrong, parts) in [
        ("--networ 5", ["--networ", "did you mean '--network'?"]),
        ("--network x", ["'x'", &format!("{whole} 0 to 65535")]),
        ("--network=", ["''", &format!("{whole} 0 to 65535")]),
        (
            "--baud fast",
            ["'fast'", &format!("{whole} 1200 to 4000000")],
        ),
        ("--method algin", ["'algin'", "align, joint, adjust"]),
        ("--method algin", ["'algin'", "did you mean 'align'?"]),
    ] {
        let line = Relay::start(&format!("--index 1 --of 1 {wrong}")).refused(2);
        assert!(!line.contains("invalid digit"), "{line}");
        for part in parts {
            assert!(line.contains(part), "{part} not in {line}");
        }
    }
}

#[test]
fn the_reason_why_a_port_cannot_be_opened_is_logged() {
    let (files, pty) = (Files::new(), Pty::new());
    let secret = files.write("tty", "");
    std::fs::set_permissions(&secret, std::fs::Permissions::from_mode(0o0)).unwrap();
    let used = pty.path().display().to_string();
    let mut first = Relay::start(&format!("--index 1 --of 2 --downstream {used}"));
    first.line("started: ");
    let mut faults = vec![
        (files.text(""), "is a directory, not a tty"),
        (
            files.text("none"),
            "there is no such device: is it plugged in?",
        ),
        ("/dev/null".to_owned(), "is not a tty"),
        (used, "is already in use"),
    ];
    // Root may open any file.
    if std::fs::read(&secret).is_err() {
        faults.push((secret, "permission denied; on most"));
    }
    for (tty, why) in faults {
        let line = Relay::start(&format!("--index 1 --of 1 --upstream {tty}")).refused(1);
        assert!(line.starts_with(&format!("--upstream {tty}: ")), "{line}");
        assert!(line.contains(why), "{line}");
    }
}

/// Checks that a relay logs the reason for which it rejects a neighbour's frames, and logs it once.
///
/// Each case has two relays on one wire, with a difference in one option.
#[test]
fn reasons_of_rejected_frames_are_logged() {
    let files = Files::new();
    for (one, other, why) in [
        ("", "--network 8", "have another network number"),
        (
            &*files.signed("key", "e1"),
            &*files.signed("other", "e2"),
            "have a wrong signature (tag)",
        ),
        (&files.signed("key", "e3"), "", "are not signed"),
        (
            "",
            &files.signed("key", "e4"),
            "are signed, but this relay has no --key-file",
        ),
    ] {
        let quick = "--probe-after-ms 200 --dead-after-ms 600";
        let chain = Chain::on_wires(2, QUIET).with(quick);
        let (mut first, _second) = (chain.relay(1, one), chain.relay(2, other));
        let line = first.line("rejected: ");
        assert!(line.contains(why), "{line}");
        std::thread::sleep(std::time::Duration::from_secs(3));
        assert!(first.lines_with("rejected: ").is_empty(), "once");
    }
}

/// Checks that an upload over `tty` fails with an error line that contains the likely reason `why`.
fn upload_fails(files: &Files, tty: &str, key: &str, more: &str, why: &str) {
    let signed = files.signed(key, "ground");
    let upload = format!("--tty {tty} --end tx --version 3 --yes --timeout 8 {signed}");
    let line = Relay::ground(&format!("{upload} {more}")).refused(1);
    let reports = "upload not finished within --timeout 8 s: no relay has reported the mission that it flies: ";
    assert!(line.starts_with(reports), "{line}");
    assert!(line.contains(why), "{more}: {line}");
}

const QUICK: &str = "--probe-after-ms 300 --dead-after-ms 900";

/// Checks that a ground station on a wire names the likely reason for a failed upload.
///
/// The ground station cannot know the true reason. Relays on a wire do not answer unknown senders, and only log why
/// they reject frames.
#[test]
fn on_a_wire_the_ground_names_the_likely_cause() {
    let chain = Chain::with_ground(1, QUIET).with(QUICK);
    let files = &chain.files;
    let mut relay = chain.relay(1, &files.signed("key", "relay"));
    relay.line("converged: ");
    let fails = |key, more: &str, why| {
        let tty = chain.tx.as_ref().unwrap().tty(0);
        upload_fails(files, tty, key, &format!("--of 1 {more}"), why);
    };
    fails(
        "key",
        "--altitude 21",
        "loaded with another mission than this station (digest of this station's mission: 0x",
    );
    fails(
        "key",
        "--network 8",
        "no frame was received: check that --tty /dev/pts/",
    );
    relay.line("rejected: ");
    fails(
        "other",
        "",
        "check --network 1, --baud 115200, --end and --key-file",
    );
    assert!(
        relay
            .line("rejected: ")
            .contains("have a wrong signature (tag)")
    );
}

/// Checks that a ground station on a shared channel names the likely reason for a failed upload.
///
/// The ground station receives the frames of all relays on the channel, and infers the reason from these.
#[test]
fn on_a_channel_the_ground_names_the_likely_cause() {
    let chain = Chain::on_channel(2, Medium::new(3, QUIET)).with(QUICK);
    let (files, tty) = (&chain.files, chain.media[0].tty(2));
    let relay = |index: usize| chain.relay(index, &files.signed("key", &format!("relay{index}")));
    let (mut first, _second) = (relay(1), relay(2));
    first.line("converged: ");
    let fails = |key, more: &str, why| {
        upload_fails(files, tty, key, &format!("--of 2 --shared {more}"), why);
    };
    fails(
        "key",
        "--network 8",
        "have another network number than --network 8",
    );
    fails(
        "other",
        "",
        "but none addressed to the transmitter: compare --key-file, --end",
    );
}
