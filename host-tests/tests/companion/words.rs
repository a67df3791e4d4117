//! Error messages word by word: each names the mistake.

use std::os::unix::fs::PermissionsExt as _;

use rustix::process::Signal;

use crate::medium::{Medium, QUIET};
use crate::process::{Ended, Relay};
use crate::signed::Files;

/// Returns the error line of a process that exits with status `expected`.
fn said(relay: Relay, expected: i32) -> String {
    let Ended { status, stderr, .. } = relay.end();
    assert_eq!((status, stderr.len()), (Some(expected), 1), "{stderr:?}");
    assert!(!stderr[0].contains("invalid digit"), "{stderr:?}");
    stderr.concat()
}

#[test]
fn a_mistyped_option_or_number_is_named() {
    let good = ["--index", "1", "--of", "1"];
    for (wrong, parts) in [
        (
            &["--networ", "5"][..],
            &["--networ", "did you mean '--network'?"][..],
        ),
        (
            &["--network", "x"],
            &["'x'", "must be a whole number within 0 to 65535"],
        ),
        (
            &["--network", ""],
            &["''", "must be a whole number within 0 to 65535"],
        ),
        (
            &["--baud", "fast"],
            &["'fast'", "must be a whole number within 1200 to 4000000"],
        ),
        (
            &["--method", "algin"],
            &["'algin'", "align, joint, adjust", "did you mean 'align'?"],
        ),
    ] {
        let line = said(Relay::start(&[&good[..], wrong].concat()), 2);
        for part in parts {
            assert!(line.contains(part), "{part} not in {line}");
        }
    }
}

#[test]
fn a_port_that_cannot_be_opened_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let secret = folder.path().join("tty");
    std::fs::write(&secret, "").unwrap();
    std::fs::set_permissions(&secret, std::fs::Permissions::from_mode(0o0)).unwrap();
    let mut faults = vec![
        (folder.path().to_owned(), "is a directory, and no tty"),
        (
            folder.path().join("none"),
            "No such file: is it plugged in?",
        ),
        ("/dev/null".into(), "is no tty"),
    ];
    // Root may open any file.
    if std::fs::read(&secret).is_err() {
        faults.push((secret, "permission denied; on most"));
    }
    for (path, why) in faults {
        let tty = path.to_str().unwrap();
        let line = said(
            Relay::start(&["--index", "1", "--of", "1", "--upstream", tty]),
            1,
        );
        assert_eq!(line.split(": ").next(), Some(&*format!("--upstream {tty}")));
        assert!(line.contains(why), "{line}");
    }
}

/// Starts two relays on one wire that differ in one option.
#[test]
fn frames_that_are_refused_say_why() {
    let files = Files::new();
    let unsigned: Vec<String> = Vec::new();
    let network = vec!["--network".to_owned(), "8".to_owned()];
    for (one, other, why) in [
        (unsigned.clone(), network, "are of another network number"),
        (
            files.options("key", "e1"),
            files.options("other", "e2"),
            "have a wrong tag",
        ),
        (
            files.options("key", "e3"),
            unsigned.clone(),
            "are not signed",
        ),
        (
            unsigned.clone(),
            files.options("key", "e4"),
            "are signed, and this relay has no --key-file",
        ),
    ] {
        let wire = Medium::new(2, QUIET);
        let start = |place: [&str; 4], more: &[String]| {
            let mut all = place.to_vec();
            all.extend([
                "--of",
                "2",
                "--probe-after-ms",
                "200",
                "--dead-after-ms",
                "600",
            ]);
            all.extend(more.iter().map(String::as_str));
            Relay::start(&all)
        };
        let mut first = start(["--index", "1", "--downstream", wire.tty(0)], &one);
        let second = start(["--index", "2", "--upstream", wire.tty(1)], &other);
        let line = first.line("rejected: ");
        assert!(line.contains(why), "{line}");
        std::thread::sleep(std::time::Duration::from_secs(3));
        assert!(first.lines_with("rejected: ").is_empty(), "once");
        second.signal(Signal::TERM);
    }
}

fn upload_fails(files: &Files, tty: &str, key: &str, more: &[&str], why: &str) {
    let options = files.options(key, "ground");
    let mut all = vec!["--tty", tty, "--version", "3", "--yes", "--timeout", "8"];
    all.extend(more);
    all.extend(options.iter().map(String::as_str));
    let line = said(Relay::ground(&all), 1);
    assert!(
        line.starts_with("--timeout 8: no relay has reported the mission that it flies: "),
        "{line}"
    );
    assert!(line.contains(why), "{more:?}: {line}");
}

fn signed(files: &Files, epoch: &str, place: &[&str]) -> Relay {
    let options = files.options("key", epoch);
    let mut all = place.to_vec();
    all.extend(["--probe-after-ms", "300", "--dead-after-ms", "900"]);
    all.extend(options.iter().map(String::as_str));
    Relay::start(&all)
}

/// Checks reasons on a wire, where relays do not answer strangers and only their logs have the reason.
#[test]
fn on_a_wire_the_ground_says_what_most_likely_is_wrong() {
    let files = Files::new();
    let wire = Medium::new(2, QUIET);
    let mut relay = signed(
        &files,
        "relay",
        &["--index", "1", "--of", "1", "--upstream", wire.tty(0)],
    );
    relay.line("converged: ");
    let tx = ["--of", "1", "--end", "tx"];
    let other = [&tx[..], &["--altitude", "21"]].concat();
    upload_fails(
        &files,
        wire.tty(1),
        "key",
        &other,
        "loaded with another mission than 0x",
    );
    let other = [&tx[..], &["--network", "8"]].concat();
    upload_fails(
        &files,
        wire.tty(1),
        "key",
        &other,
        "nothing was heard; is --tty /dev/pts/",
    );
    relay.line("rejected: ");
    upload_fails(
        &files,
        wire.tty(1),
        "other",
        &tx,
        "are --network 1, --baud 115200, --end and --key-file right?",
    );
    assert!(relay.line("rejected: ").contains("have a wrong tag"));
}

/// Checks the reasons on a channel, where the ground station receives the relays' frames.
#[test]
fn on_a_channel_the_ground_says_what_most_likely_is_wrong() {
    let files = Files::new();
    let channel = Medium::new(3, QUIET);
    let mut relays: Vec<Relay> = [("1", 0), ("2", 1)]
        .into_iter()
        .map(|(index, tty)| {
            let place = ["--index", index, "--of", "2", "--shared", channel.tty(tty)];
            signed(&files, &format!("relay{index}"), &place)
        })
        .collect();
    relays[0].line("converged: ");
    let tx = ["--of", "2", "--end", "tx", "--shared"];
    let other = [&tx[..], &["--network", "8"]].concat();
    upload_fails(
        &files,
        channel.tty(2),
        "key",
        &other,
        "of another network number than --network 8",
    );
    upload_fails(
        &files,
        channel.tty(2),
        "other",
        &tx,
        "none is for the transmitter: are --key-file, --end",
    );
}
