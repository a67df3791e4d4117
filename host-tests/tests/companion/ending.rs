//! Exit of the program: on a signal, or because it cannot start.

use rustix::process::Signal;
use uav_relay_scenario::Scenario;

use crate::process::{Ended, Relay};
use crate::pty::Pty;
use crate::simulated;

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
