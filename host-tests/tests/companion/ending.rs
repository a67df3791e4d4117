//! How the program ends: told to, without its ttys, without anybody who reads its lines.

use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use uav_relay_scenario::Scenario;

use crate::binary::companion;
use crate::process::{Ended, Relay};
use crate::pty::Pty;
use crate::simulated;

#[test]
fn a_tty_that_disappears_ends_the_program_with_one_line() {
    for lost in ["--upstream", "--downstream"] {
        let (up, down) = (Pty::new(), Pty::new());
        let (path_up, path_down) = (up.path().to_owned(), down.path().to_owned());
        let (path_up, path_down) = (path_up.to_str().unwrap(), path_down.to_str().unwrap());
        let mut relay = Relay::start(&[
            "--index",
            "2",
            "--of",
            "3",
            "--upstream",
            path_up,
            "--downstream",
            path_down,
        ]);
        relay.line("started: ");
        let (path, kept) = if lost == "--upstream" {
            drop(up);
            (path_up, down)
        } else {
            drop(down);
            (path_down, up)
        };
        let gone = Instant::now();
        let Ended { status, stderr, .. } = relay.end();
        println!("ended after {} ms", gone.elapsed().as_millis());
        assert_eq!(status, Some(1), "{stderr:?}");
        assert_eq!(stderr, [format!("{lost} {path}: is gone")]);
        assert!(gone.elapsed() < Duration::from_secs(5));
        drop(kept);
    }
}

#[test]
fn it_ends_cleanly_at_both_signals() {
    for signal in [Signal::INT, Signal::TERM] {
        let mut relay = Relay::start(&["--index", "1", "--of", "1"]);
        assert_eq!(relay.settled(), simulated(&Scenario::default(), 1)[0]);
        relay.signal(signal);
        let Ended {
            status,
            stdout,
            stderr,
        } = relay.end();
        assert_eq!((status, stderr), (Some(0), Vec::new()));
        assert!(stdout.last().unwrap().contains("stopped: relay 1"));
    }
}

#[test]
fn it_ends_where_nobody_reads_its_lines() {
    // The reading end is closed before it starts, so that its first line is the one that fails.
    let (ours, theirs) = std::io::pipe().unwrap();
    drop(ours);
    let output = Command::new(companion())
        .args(["--index", "1", "--of", "1"])
        .stdout(theirs)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    let text = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(
        text.starts_with("standard output: ") && text.lines().count() == 1,
        "{text}"
    );
}

#[test]
fn what_cannot_be_opened_is_named() {
    let pty = Pty::new();
    let path = pty.path().to_str().unwrap();
    let mut first = Relay::start(&["--index", "1", "--of", "2", "--downstream", path]);
    first.line("started: ");
    for (tty, why) in [
        (path, "is in use already"),
        ("/dev/null", "is no tty"),
        ("/no/such/tty", "No such file"),
    ] {
        let ended = Relay::start(&["--index", "1", "--of", "2", "--downstream", tty]).end();
        assert_eq!(ended.status, Some(1), "{tty}");
        let [line] = &ended.stderr[..] else {
            panic!("{tty}: {:?}", ended.stderr);
        };
        assert!(
            line.starts_with(&format!("--downstream {tty}: {why}")),
            "{line}"
        );
    }
}
