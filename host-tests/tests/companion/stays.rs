//! Faults that neither end nor delay a relay: vanished ports, stopped readers, full disks, hang-ups.

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Resource, Rlimit, Signal, prlimit};
use serde_json::Value;

use crate::binary::{companion, ground};
use crate::chain::{Chain, QUICK};
use crate::files::{Files, status_of, until};
use crate::medium::Medium;
use crate::process::{LIMIT, Relay, wait_until, words};
use crate::pty::Pty;

#[test]
fn a_vanished_port_returns_and_the_other_one_goes_on() {
    let (hub, other, files) = (Medium::pluggable(2), Pty::new(), Files::new());
    let socket = files.text("status");
    let ports = format!(
        "--upstream {} --downstream {}",
        hub.tty(0),
        other.path().display()
    );
    let more = format!("--probe-after-ms 200 --status-socket {socket}");
    let mut relay = Relay::start(&format!("--index 2 --of 3 {ports} {more}"));
    relay.line("started: ");
    for time in 1..=2_u64 {
        hub.pull(0);
        let line = relay.line(
            "the device was disconnected; check the cable of the device: the program opens the port again as soon as the device is back",
        );
        assert!(line.contains("port lost: --upstream "), "{line}");
        let sent = |said: &Value| said["links"]["ports"][1]["bytes_out"].as_u64().unwrap();
        let before = sent(&status_of(&socket));
        until(&socket, |said| sent(said) > before + 20);
        hub.plug(0);
        relay.line("port back: --upstream ");
        let said = until(&socket, |said| said["links"]["ports"][0]["open"] == true);
        assert_eq!(said["links"]["ports"][0]["times_gone"], time);
    }
    let again = relay.lines_with("port ");
    assert!(again.is_empty(), "once each: {again:?}");
}

/// Checks that a program continues although its output is not read.
///
/// In the three cases the output is a full pipe with a full queue, a closed pipe, or `/dev/full`.
fn goes_on_where_nobody_reads(program: &Path, options: &str) {
    let (kept, stopped) = std::io::pipe().unwrap();
    let (gone, closed) = std::io::pipe().unwrap();
    drop(gone);
    let full = std::fs::File::options()
        .write(true)
        .open("/dev/full")
        .unwrap();
    for (name, stdout) in [
        ("stopped", Stdio::from(stopped)),
        ("closed", Stdio::from(closed)),
        ("full", Stdio::from(full)),
    ] {
        let files = Files::new();
        let socket = files.text("status");
        let options = format!("{options} --status-socket {socket}");
        let relay = Relay::run(program, &words(&options), stdout);
        status_of(&socket);
        // Each line has some 1 500 bytes: 64 KiB fit into the pipe, 1 024 lines into the queue.
        let end = Instant::now() + LIMIT;
        let mut dropped = 0;
        while dropped < 10 {
            assert!(Instant::now() < end, "{name}: {dropped} dropped");
            relay.signal(Signal::USR1);
            let asked_at = Instant::now();
            dropped = status_of(&socket)["lines_dropped"].as_u64().unwrap();
            assert!(asked_at.elapsed() < Duration::from_secs(2), "{name}");
        }
        let begun = Instant::now();
        relay.stopped();
        assert!(begun.elapsed() < Duration::from_secs(20), "{name}");
    }
    drop(kept);
}

#[test]
fn an_unread_output_does_not_end_a_relay() {
    goes_on_where_nobody_reads(companion(), "--index 1 --of 1");
}

#[test]
fn an_unread_output_does_not_end_a_station() {
    let (files, tty) = (Files::new(), Pty::new());
    let (tty, signed) = (tty.path().display(), files.signed("key", "ground"));
    let stand = format!("--stand --end rx --of 1 --tty {tty} {signed}");
    goes_on_where_nobody_reads(ground(), &stand);
}

#[test]
fn a_closed_standard_error_is_no_panic() {
    for options in ["--index 0", "--help", "--version"] {
        for program in [companion(), ground()] {
            let (gone, closed) = std::io::pipe().unwrap();
            drop(gone);
            let status = Command::new(program)
                .args(words(options))
                .stdout(closed.try_clone().unwrap())
                .stderr(closed)
                .status()
                .unwrap();
            assert!(
                matches!(status.code(), Some(0 | 2)),
                "{options:?}: {status}"
            );
        }
    }
}

/// Checks that clients that do not read the status socket, or that send data, block no other clients.
#[test]
fn the_socket_answers_despite_stuck_clients() {
    let files = Files::new();
    let socket = files.text("status");
    let options = format!("--index 1 --of 1 --status-socket {socket}");
    let mut relay = Relay::start(&options);
    relay.line("converged: ");
    let mut stuck: Vec<UnixStream> = (0..20)
        .map(|_| UnixStream::connect(&socket).unwrap())
        .collect();
    for stream in &mut stuck {
        let _ = stream.write(b"GET / HTTP/1.1\r\n\r\n");
    }
    let said = status_of(&socket);
    assert_eq!(said["relay"]["index"], 1);
    assert_eq!(said["relay"]["downstream"]["name"], Value::Null);
    assert!(said["relay"]["setpoint"]["x_m"].is_f64(), "{said:#}");
    assert_eq!(said["relay"]["counters"]["refused"], 0);
    // A second process with the same name is refused; a stale name is not.
    let line = Relay::start(&options).refused(1);
    assert!(line.contains("is already in use"), "{line}");
    drop(relay);
    assert!(files.path("status").exists(), "it was killed");
    Relay::start(&options).line("started: ");
    std::fs::remove_file(&socket).unwrap();
    files.write("status", "");
    let line = Relay::start(&options).refused(1);
    assert!(
        line.contains("a file that is not a socket has this name"),
        "{line}"
    );
}

#[test]
fn the_log_is_reopened_on_sighup() {
    let files = Files::new();
    let (log, moved) = (files.text("log"), files.text("log.1"));
    let relay = Relay::start(&format!("--index 1 --of 1 --json --log-file {log}"));
    let has = |file: &str, event: &str| {
        let mut found = None;
        wait_until(|| {
            let text = std::fs::read_to_string(file).unwrap_or_default();
            let mut entries = text.lines().map(|line| serde_json::from_str(line).unwrap());
            found = entries.find(|entry: &Value| entry["event"] == event);
            found.is_some()
        });
        found.unwrap()
    };
    let converged = has(&log, "converged");
    assert!(converged["target_sir"].as_f64().unwrap() > 0.0);
    assert!(converged["monotonic_s"].is_f64());
    let time = converged["time"].as_str().unwrap();
    assert!(seconds_from_now(time) < 60, "{time}");
    std::fs::rename(&log, &moved).unwrap();
    relay.signal(Signal::HUP);
    has(&log, "hang-up");
    relay.signal(Signal::USR1);
    assert!(has(&log, "status")["relay"]["counters"]["sent"].is_u64());
    relay.signal(Signal::TERM);
    has(&log, "stopped");
    assert!(has(&moved, "started")["index"] == 1);
}

/// Returns the distance in time, s, from an RFC 3339 time in UTC to now, by the system's `date`.
fn seconds_from_now(text: &str) -> u64 {
    assert!(text.ends_with('Z'), "{text} is not in UTC");
    let output = Command::new("date").args(["--date", text, "+%s"]).output();
    let then = String::from_utf8(output.unwrap().stdout).unwrap();
    let now = std::time::UNIX_EPOCH.elapsed().unwrap().as_secs();
    now.abs_diff(then.trim().parse().unwrap())
}

/// Simulates a full disk for the process `relay` if `full` is true: its files cannot grow. Otherwise ends the simulation.
pub(crate) fn fill_disk(relay: Pid, full: bool) {
    let limit = Rlimit {
        current: full.then_some(0),
        maximum: None,
    };
    prlimit(Some(relay), Resource::Fsize, limit).unwrap();
}

/// Starts relay `index` of two on one channel, with a status socket and `more` options.
fn of_two(chain: &Chain, index: usize, more: &str) -> Relay {
    let socket = chain.files.text(&format!("status{index}"));
    chain.relay(index, &format!("{QUICK} --status-socket {socket} {more}"))
}

#[test]
fn a_full_disk_is_reported_once_and_ends_no_relay() {
    let chain = Chain::on_channel(2, Medium::pluggable(2));
    let start = |index: usize| {
        let views = chain.files.text(&format!("view{index}"));
        of_two(&chain, index, &format!("--view-file {views}"))
    };
    let (mut first, mut second) = (start(1), start(2));
    first.line("converged: ");
    second.line("converged: ");
    fill_disk(first.pid(), true);
    // Another view needs another record.
    drop(second);
    let line = first.line("cannot be written: ");
    assert!(line.contains("file: --view-file /"), "{line}");
    // The lease may expire before the neighbour counts as lost, so "lost" and "back" need not be reported.
    second = start(2);
    second.line("setpoint: ");
    std::thread::sleep(Duration::from_millis(2_500));
    let more = first.lines_with("cannot be written");
    assert!(more.is_empty(), "once: {more:?}");
    fill_disk(first.pid(), false);
    first.line("can be written again, after ");
    // The log line may come before the counters.
    let said = until(chain.files.path("status1"), |said| {
        said["view_file_writes"].as_u64() >= Some(2)
    });
    let (writes, slowest) = (&said["view_file_writes"], &said["view_file_slowest_ms"]);
    println!("{writes} writes of the views, the slowest of {slowest} ms");
    assert!(slowest.as_f64().unwrap() > 0.0);
    assert!(said["view_file_failures"].as_u64().unwrap() >= 3);
    first.signal(Signal::TERM);
    assert_eq!(first.end().status, Some(0));
}

/// Checks that a blocked disk delays only the frames that its relay sends, and nothing else.
///
/// In place of a blocked disk, the file for the relay's membership votes is a FIFO that is not read.
#[test]
fn a_slow_disk_delays_only_its_own_frames() {
    let chain = Chain::on_channel(2, Medium::pluggable(2));
    let (views, slow) = (chain.files.text("views1"), chain.files.fifo("views1.new"));
    let mut first = of_two(&chain, 1, &format!("--view-file {views}"));
    let mut second = of_two(&chain, 2, "");
    first.line("converged: ");
    second.line("converged: ");
    // The relay searches for the other one, then votes on a view without it, and its vote cannot be stored yet. A relay that may
    // send does so every `dead_after`, 1.5 s.
    drop(second);
    first.line("lost: relay 2");
    let socket = chain.files.path("status1");
    let sent = |said: &Value| said["links"]["ports"][0]["bytes_out"].as_u64();
    let end = Instant::now() + Duration::from_secs(30);
    let mut slowest = Duration::ZERO;
    let (mut before, mut since) = (None, Instant::now());
    while since.elapsed() < Duration::from_secs(5) {
        assert!(
            Instant::now() < end,
            "sends although its vote is not stored"
        );
        let begun = Instant::now();
        let said = status_of(&socket);
        slowest = slowest.max(begun.elapsed());
        if sent(&said) != before {
            (before, since) = (sent(&said), begun);
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    assert!(slowest < Duration::from_secs(1), "{slowest:?}");
    // A FIFO stores nothing: the relay writes again, into a file this time.
    drop(std::fs::File::open(&slow).unwrap());
    let line = first.line("cannot be written: ");
    assert!(line.contains("file: --view-file /"), "{line}");
    first.line("can be written again, after ");
    second = of_two(&chain, 2, "");
    first.line("back: relay 2");
    second.line("setpoint: ");
    assert!(sent(&status_of(&socket)) > before);
    first.signal(Signal::TERM);
    assert_eq!(first.end().status, Some(0));
    assert!(Path::new(&views).exists() && !Path::new(&slow).exists());
}
