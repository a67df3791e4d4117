//! Changes that the ground station shows before an upload, and the operator's confirmation.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::binary::ground;
use crate::medium::{Medium, QUIET};
use crate::process::{Ended, LIMIT, Relay, bits};
use crate::pty::Pty;
use crate::signed::Files;

const SITED: [&str; 6] = [
    "--site-tx",
    "47.4,8.54,420",
    "--site-rx",
    "47.41,8.55,431",
    "--distance",
    "1343.795",
];

/// Two relays without drones, loaded with the distance of [`SITED`].
struct Bench {
    files: Files,
    tx: Medium,
    _wire: Medium,
    relays: [Relay; 2],
}

impl Bench {
    fn new() -> Self {
        let files = Files::new();
        let (tx, wire) = (Medium::new(2, QUIET), Medium::new(2, QUIET));
        let relays = [1, 2].map(|index: usize| {
            let own = files.options("key", &format!("epoch{index}"));
            let number = index.to_string();
            let mut all = vec!["--index", &number, "--of", "2", "--distance", "1343.795"];
            all.extend(["--band", "20,40"]);
            if index == 1 {
                all.extend(["--upstream", tx.tty(1), "--downstream", wire.tty(0)]);
            } else {
                all.extend(["--upstream", wire.tty(1)]);
            }
            all.extend(own.iter().map(String::as_str));
            Relay::start(&all)
        });
        Self {
            files,
            tx,
            _wire: wire,
            relays,
        }
    }

    fn options(&self, version: &str, more: &[&str]) -> Vec<String> {
        let mut all = vec!["--of", "2", "--end", "tx", "--tty", self.tty()];
        all.extend(["--version", version, "--band", "20,40"]);
        all.extend(SITED);
        all.extend(more);
        let own = self.files.options("key", "ground");
        let all = all.into_iter().map(str::to_owned);
        all.chain(own).collect()
    }

    fn tty(&self) -> &str {
        self.tx.tty(0)
    }

    fn uploads(&self, version: &str, more: &[&str]) -> Ended {
        let all = self.options(version, more);
        let all: Vec<&str> = all.iter().map(String::as_str).collect();
        Relay::ground(&all).end()
    }

    /// Returns x of both relays, m, after the next agreement.
    fn agreed(&mut self) -> [f64; 2] {
        self.relays.each_mut().map(|relay| {
            let setpoint = bits(&relay.line("setpoint: "));
            relay.line("converged: ");
            f64::from(f32::from_bits(setpoint[0]))
        })
    }
}

/// Returns the text after `event: ` in each line of that event.
fn said<'a>(ended: &'a Ended, event: &str) -> Vec<&'a str> {
    let event = format!("  transmitter  {event}: ");
    let lines = ended.stdout.iter();
    lines
        .filter_map(|line| Some(line.split_once(&event)?.1))
        .collect()
}

#[test]
fn a_later_upload_keeps_what_is_flown_and_shows_each_change_and_move() {
    let mut bench = Bench::new();
    let before = bench.agreed();
    let moved = ["--new-site-rx", "47.412,8.552,433", "--yes"];
    let ended = bench.uploads("1", &moved);
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert_eq!(
        said(&ended, "current"),
        ["relay 1 flies the mission that it was loaded with"]
    );
    let changes = said(&ended, "change");
    assert_eq!(
        changes[0],
        "receiver: 47.4100000,8.5500000,431.000 -> 47.4120000,8.5520000,433.000"
    );
    assert!(
        changes[1].starts_with("distance: 1343.795 m -> 16"),
        "{changes:?}"
    );
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert_eq!(said(&ended, "move").len(), 2);
    for relay in &mut bench.relays {
        relay.line("adopted: flies version 1");
    }
    let after = bench.agreed();
    assert!((after[0] - before[0]).abs() > 1.0, "{before:?}, {after:?}");

    // Dry run with another interferer: the receiver stays at its new site.
    let new = ["--new-interferer", "80,700,-300"];
    let ended = bench.uploads("2", &[&new[..], &["--dry-run"]].concat());
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert_eq!(said(&ended, "current"), ["relay 1 flies version 1"]);
    let change = "interferer: 80 W at x 500 m, y 400 m -> 80 W at x 700 m, y -300 m";
    assert_eq!(said(&ended, "change"), [change]);
    let moves: Vec<String> = said(&ended, "move")
        .iter()
        .map(ToString::to_string)
        .collect();
    assert_eq!(said(&ended, "dry run"), ["version 2 was not uploaded"]);
    assert!(!bench.relays[0].has_said("uploaded: stored version 2"));

    // A script's upload: the relays move as far as announced.
    let ended = bench.uploads("2", &[&new[..], &["--yes"]].concat());
    assert_eq!(ended.status, Some(0), "{ended:?}");
    assert_eq!(said(&ended, "move"), moves);
    let between = "between 47.4000000,8.5400000,420.000 and 47.4120000,8.5520000,433.000";
    for relay in &mut bench.relays {
        let line = relay.line("adopted: flies version 2");
        assert!(line.ends_with(between), "{line}");
    }
    let last = bench.agreed();
    for (at, said) in moves.iter().enumerate() {
        let metres = (last[at] - after[at]).abs();
        let expected = format!(
            "relay {} moves {metres:.1} m, from x {:.1} m, ",
            at + 1,
            after[at]
        );
        assert!(said.starts_with(&expected), "{expected}: {said}");
        assert!(metres > 10.0, "{metres} m");
        let to = format!("to x {:.1} m, y 0.0 m, altitude 20.0 m", last[at]);
        assert!(said.ends_with(&to), "{to}: {said}");
    }
}

#[test]
fn what_leaves_the_geofence_is_refused_before_it_is_sent() {
    let mut bench = Bench::new();
    bench.agreed();
    let ended = bench.uploads(
        "1",
        &["--new-altitude", "50", "--new-band", "50,50", "--yes"],
    );
    let line = "--version 1: altitude 50 m: must be within 20 to 40 m, the geofence of relays that were loaded with this --altitude and --band; farthest outside is relay 1, at altitude 50.0 m";
    assert_eq!(
        (ended.status, &ended.stderr[..]),
        (Some(1), &[line.to_owned()][..])
    );
    assert_eq!(said(&ended, "change")[0], "altitude: 20 m -> 50 m");
    let moves = said(&ended, "move");
    assert!(
        moves.len() == 2 && moves[0].ends_with("altitude 50.0 m"),
        "{moves:?}"
    );
    assert!(!bench.relays[0].has_said("uploaded: "));
}

/// Runs the ground station at a terminal and answers its question. Returns exit status and terminal text.
fn at_a_terminal(options: &[String], answer: &str) -> (Option<i32>, String) {
    let terminal = Pty::new();
    let tty = || {
        File::options()
            .read(true)
            .write(true)
            .open(terminal.path())
            .unwrap()
    };
    let mut child = Command::new(ground())
        .args(options)
        .stdin(Stdio::from(tty()))
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut errors = child.stderr.take().unwrap();
    let mut shown = Vec::new();
    let mut byte = [0];
    while !shown.ends_with(b"[y/N] ") {
        assert_eq!(
            errors.read(&mut byte).unwrap(),
            1,
            "{}",
            String::from_utf8_lossy(&shown)
        );
        shown.push(byte[0]);
    }
    let mut wire = File::from(terminal.wire.try_clone().unwrap());
    wire.write_all(answer.as_bytes()).unwrap();
    errors.read_to_end(&mut shown).unwrap();
    let end = Instant::now() + LIMIT;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(5));
    };
    (status.code(), String::from_utf8(shown).unwrap())
}

#[test]
fn the_operator_confirms_at_a_terminal_and_a_script_needs_yes() {
    let mut bench = Bench::new();
    bench.agreed();
    let new = ["--new-interferer", "80,700,-300"];
    let ended = bench.uploads("1", &new);
    let line = "--version 1: nobody can confirm the upload, since standard input is no terminal; give --yes, or --dry-run to see what it changes";
    assert_eq!(
        (ended.status, &ended.stderr[..]),
        (Some(2), &[line.to_owned()][..])
    );
    let question = "Upload version 1? [y/N] ";
    for answer in ["n\n", "\n"] {
        let (status, shown) = at_a_terminal(&bench.options("1", &new), answer);
        let refused = "--version 1: not confirmed, nothing was uploaded\n";
        assert_eq!((status, shown), (Some(1), format!("{question}{refused}")));
    }
    assert!(!bench.relays[0].has_said("uploaded: "));
    let (status, shown) = at_a_terminal(&bench.options("1", &new), "y\n");
    assert_eq!((status, &shown[..]), (Some(0), question));
    for relay in &mut bench.relays {
        relay.line("adopted: flies version 1");
    }
}
