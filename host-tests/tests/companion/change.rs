//! Changes that the ground station shows before an upload, and the operator's confirmation.

use std::fs::File;
use std::io::{Read as _, Write as _};
use std::process::{Command, Stdio};
use std::time::Duration;

use crate::binary::ground;
use crate::chain::Chain;
use crate::medium::QUIET;
use crate::process::{Relay, bits, lines_of, wait_until, words};
use crate::pty::Pty;

const SITED: &str = "--site-tx 47.4,8.54,420 --site-rx 47.41,8.55,431 --distance 1343.795";

/// Chain of two relay processes without drones, for mission changes.
///
/// The distance from Tx to Rx in the mission is that of the positions in [`SITED`].
struct Bench(Chain);

impl Bench {
    fn new() -> Self {
        let mut chain = Chain::with_ground(2, QUIET);
        for index in [1, 2] {
            let signed = chain.files.signed("key", &format!("epoch{index}"));
            let relay = chain.relay(index, &format!("--distance 1343.795 --band 20,40 {signed}"));
            chain.relays.push(relay);
        }
        Self(chain)
    }

    fn options(&self, version: &str, more: &str) -> String {
        let (tty, signed) = (
            self.0.tx.as_ref().unwrap().tty(0),
            self.0.files.signed("key", "ground"),
        );
        let upload = format!("--of 2 --end tx --tty {tty} --version {version} --band 20,40");
        format!("{upload} {SITED} {signed} {more}")
    }

    fn uploads(&self, version: &str, more: &str) -> Relay {
        Relay::ground(&self.options(version, more))
    }

    /// Waits for the next agreement of the chain. Returns the x of both relays, m.
    fn agreed(&mut self) -> [f64; 2] {
        [0, 1].map(|at| {
            let relay = &mut self.0.relays[at];
            let setpoint = bits(&relay.line("setpoint: "));
            relay.line("converged: ");
            f64::from(f32::from_bits(setpoint[0]))
        })
    }
}

/// Returns the text after `EVENT: ` in each log line about one event, where EVENT is the name `event`.
fn lines_of_event(lines: &[String], event: &str) -> Vec<String> {
    let event = format!("  transmitter  {event}: ");
    let lines = lines.iter();
    lines
        .filter_map(|line| Some(line.split_once(&event)?.1.to_owned()))
        .collect()
}

#[test]
fn a_later_upload_is_based_on_the_flown_mission() {
    let mut bench = Bench::new();
    let before = bench.agreed();
    let moved = "--new-site-rx 47.412,8.552,433 --yes";
    let ended = bench.uploads("1", moved).succeeds();
    assert_eq!(
        lines_of_event(&ended, "current"),
        ["relay 1 flies the mission loaded before flight"]
    );
    let changes = lines_of_event(&ended, "change");
    assert_eq!(
        changes[0],
        "new mission, receiver: 47.4100000,8.5500000,431.000 -> 47.4120000,8.5520000,433.000"
    );
    assert!(
        changes[1]
            .starts_with("new mission, distance from transmitter to receiver: 1343.795 m -> 16"),
        "{changes:?}"
    );
    assert_eq!(changes.len(), 2, "{changes:?}");
    assert_eq!(lines_of_event(&ended, "move").len(), 2);
    bench.0.lines("adopted: the chain flies version 1");
    let after = bench.agreed();
    assert!((after[0] - before[0]).abs() > 1.0, "{before:?}, {after:?}");

    // Dry run with another interferer: the receiver stays at its new site.
    let new = "--new-interferer 80,700,-300";
    let ended = bench.uploads("2", &format!("{new} --dry-run")).succeeds();
    assert_eq!(
        lines_of_event(&ended, "current"),
        ["relay 1 flies version 1 of the mission"]
    );
    let change = "new mission, interferer: 80 W at x 500 m, y 400 m -> 80 W at x 700 m, y -300 m";
    assert_eq!(lines_of_event(&ended, "change"), [change]);
    let moves = lines_of_event(&ended, "move");
    assert_eq!(
        lines_of_event(&ended, "dry run"),
        ["version 2 of the mission was not uploaded"]
    );
    assert!(
        !bench.0.relays[0]
            .has_printed("uploaded: version 2 of the mission was received and stored")
    );

    // A script's upload: the relays move as far as announced.
    let ended = bench.uploads("2", &format!("{new} --yes")).succeeds();
    assert_eq!(lines_of_event(&ended, "move"), moves);
    let between = "between 47.4000000,8.5400000,420.000 and 47.4120000,8.5520000,433.000";
    for line in bench.0.lines("adopted: the chain flies version 2") {
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
fn an_upload_outside_the_geofence_is_refused_before_sending() {
    let mut bench = Bench::new();
    bench.agreed();
    let more = "--new-altitude 50 --new-band 50,50 --yes";
    let (ended, error) = bench.uploads("1", more).fails(1);
    let line = "upload of version 1 refused: altitude 50 m: must be within 20 to 40 m (the relays' geofence, set before flight by --altitude and --band); every relay that controls a drone refuses this mission: relay 1 would be farthest outside, at altitude 50.0 m; --no-fence uploads the mission nevertheless";
    assert_eq!(error, line);
    assert_eq!(
        lines_of_event(&ended, "change")[0],
        "new mission, altitude: 20 m -> 50 m"
    );
    let moves = lines_of_event(&ended, "move");
    assert!(
        moves.len() == 2 && moves[0].ends_with("altitude 50.0 m"),
        "{moves:?}"
    );
    assert!(!bench.0.relays[0].has_printed("uploaded: "));
}

/// Checks that a dry run fails with status 1 if the upload would leave the geofence.
///
/// Otherwise the dry run succeeds.
#[test]
fn a_dry_run_that_leaves_the_geofence_fails() {
    let mut bench = Bench::new();
    bench.agreed();
    for (altitude, is_outside) in [("50", true), ("30", false)] {
        let more = format!("--new-altitude {altitude} --dry-run");
        let station = bench.uploads("1", &format!("{more} --new-band {altitude},{altitude}"));
        if !is_outside {
            let lines = station.succeeds();
            assert_eq!(
                lines_of_event(&lines, "dry run"),
                ["version 1 of the mission was not uploaded"]
            );
            continue;
        }
        let (lines, error) = station.fails(1);
        let why = "upload of version 1 refused: altitude 50 m: must be within 20 to 40 m (the relays' geofence";
        assert!(error.starts_with(why), "{error}");
        assert_eq!(
            lines_of_event(&lines, "change")[0],
            "new mission, altitude: 20 m -> 50 m"
        );
        assert!(lines_of_event(&lines, "dry run").is_empty(), "{lines:?}");
    }
    assert!(!bench.0.relays[0].has_printed("uploaded: "));
}

/// Checks that an upload with `--from-loaded` shows every earlier change that the upload reverts.
///
/// Such an upload changes the mission that the relays had before flight, and not the mission that they fly.
#[test]
fn an_upload_based_on_loaded_values_shows_reverted_keys() {
    let mut bench = Bench::new();
    bench.agreed();
    let moved = "--new-interferer 80,700,-300 --yes";
    bench.uploads("1", moved).succeeds();
    bench.0.lines("adopted: the chain flies version 1");
    let altitude = "new mission, altitude: 20 m -> 30 m";
    for (from, expected) in [
        ("", &[altitude][..]),
        (
            "--from-loaded",
            &[
                altitude,
                "new mission, interferer: 80 W at x 700 m, y -300 m -> 80 W at x 500 m, y 400 m",
            ],
        ),
    ] {
        let more = format!("--new-altitude 30 --dry-run {from}");
        let lines = bench.uploads("2", &more).succeeds();
        assert_eq!(
            lines_of_event(&lines, "current"),
            ["relay 1 flies version 1 of the mission"]
        );
        assert_eq!(lines_of_event(&lines, "change"), expected);
    }
    // Without any other value the relays fly again as loaded.
    let lines = bench.uploads("2", "--from-loaded --yes").succeeds();
    assert_eq!(
        lines_of_event(&lines, "change"),
        ["new mission, interferer: 80 W at x 700 m, y -300 m -> 80 W at x 500 m, y 400 m"]
    );
    bench.0.lines("adopted: the chain flies version 2");
}

/// Runs the ground station at a terminal and answers its question. Returns its exit status and output.
fn at_a_terminal(options: &str, answer: &str) -> (Option<i32>, String) {
    let terminal = Pty::new();
    let tty = || {
        File::options()
            .read(true)
            .write(true)
            .open(terminal.path())
            .unwrap()
    };
    let mut child = Command::new(ground())
        .args(words(options))
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
    wait_until(|| child.try_wait().unwrap().is_some());
    let status = child.wait().unwrap().code();
    (status, String::from_utf8(shown).unwrap())
}

#[test]
fn an_upload_that_has_timed_out_does_not_reach_relays_that_come_back() {
    let mut bench = Bench::new();
    bench.agreed();
    let terminal = Pty::new();
    let tty = || {
        let mut both = File::options();
        both.read(true).write(true).open(terminal.path()).unwrap()
    };
    let options = bench.options("1", "--new-interferer 80,700,-300 --stand --timeout 3");
    let mut child = Command::new(ground())
        .args(words(&options))
        .stdin(Stdio::from(tty()))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut errors = child.stderr.take().unwrap();
    let (mut shown, mut byte) = (Vec::new(), [0]);
    while !shown.ends_with(b"[y/N] ") {
        assert_eq!(errors.read(&mut byte).unwrap(), 1);
        shown.push(byte[0]);
    }
    for relay in bench.0.relays.drain(..) {
        relay.stopped();
    }
    let mut wire = File::from(terminal.wire.try_clone().unwrap());
    wire.write_all(b"y\n").unwrap();
    let lines = lines_of(child.stdout.take().unwrap());
    let line = lines
        .iter()
        .find(|line| line.contains("not flown: "))
        .unwrap();
    assert!(line.contains("not finished within --timeout 3 s"), "{line}");
    for index in [1, 2] {
        let signed = bench.0.files.signed("key", &format!("epoch{index}"));
        let own = format!("--distance 1343.795 --band 20,40 {signed}");
        bench.0.relays.push(bench.0.relay(index, &own));
    }
    bench.agreed();
    std::thread::sleep(Duration::from_secs(10));
    assert!(!bench.0.relays[0].has_printed("uploaded: "));
    child.kill().unwrap();
    child.wait().unwrap();
}

#[test]
fn the_operator_confirms_at_a_terminal_and_a_script_needs_yes() {
    let mut bench = Bench::new();
    bench.agreed();
    let new = "--new-interferer 80,700,-300";
    let line = "--version 1: standard input is not a terminal, so nobody can confirm the upload: give --yes to upload without a question, or --dry-run to see the changes only";
    assert_eq!(bench.uploads("1", new).refused(2), line);
    let question = "Upload version 1 of the mission? [y/N] ";
    for answer in ["n\n", "\n"] {
        let (status, shown) = at_a_terminal(&bench.options("1", new), answer);
        let refused = "upload of version 1 not confirmed by the operator: nothing was uploaded\n";
        assert_eq!((status, shown), (Some(1), format!("{question}{refused}")));
    }
    assert!(!bench.0.relays[0].has_printed("uploaded: "));
    let (status, shown) = at_a_terminal(&bench.options("1", new), "y\n");
    assert_eq!((status, &shown[..]), (Some(0), question));
    bench.0.lines("adopted: the chain flies version 1");
}
