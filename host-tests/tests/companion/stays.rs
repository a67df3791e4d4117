//! Faults that neither end nor delay a relay: vanished ports, stopped readers, full disks, hang-ups.

use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Resource, Rlimit, Signal, kill_process, prlimit};
use serde_json::Value;
use std::io::{Read, Write};
use std::path::Path;

use crate::binary::{companion, ground};
use crate::hub::Hub;
use crate::process::{Ended, LIMIT, Relay};
use crate::pty::Pty;
use crate::signed::Files;

/// Returns the status answer of a relay's socket.
pub(crate) fn asked(socket: &Path) -> Value {
    let end = Instant::now() + LIMIT;
    let mut stream = loop {
        match UnixStream::connect(socket) {
            Ok(stream) => break stream,
            Err(error) if Instant::now() > end => panic!("{}: {error}", socket.display()),
            Err(_) => std::thread::sleep(Duration::from_millis(20)),
        }
    };
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    // No command follows, so the answer comes at once.
    let _ = stream.shutdown(Shutdown::Write);
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{text:?}: {error}"))
}

/// Queries the status until the condition holds.
pub(crate) fn until(socket: &Path, is_so: impl Fn(&Value) -> bool) -> Value {
    let end = Instant::now() + LIMIT;
    loop {
        let said = asked(socket);
        if is_so(&said) {
            return said;
        }
        assert!(Instant::now() < end, "{said:#}");
        std::thread::sleep(Duration::from_millis(50));
    }
}

#[test]
fn a_port_that_vanishes_comes_back_and_the_other_one_goes_on() {
    let hub = Hub::new(2);
    let other = Pty::new();
    let socket = hub.folder().join("status");
    let mut relay = Relay::start(&[
        "--index",
        "2",
        "--of",
        "3",
        "--upstream",
        hub.name(0).to_str().unwrap(),
        "--downstream",
        other.path().to_str().unwrap(),
        "--probe-after-ms",
        "200",
        "--status-socket",
        socket.to_str().unwrap(),
    ]);
    relay.line("started: ");
    for time in 1..=2_u64 {
        hub.pull(0);
        let line = relay.line("is gone; retried until it is back");
        assert!(line.contains("port lost: --upstream "), "{line}");
        let sent = |said: &Value| said["links"]["ports"][1]["bytes_out"].as_u64().unwrap();
        let before = sent(&asked(&socket));
        until(&socket, |said| sent(said) > before + 20);
        hub.plug(0);
        relay.line("port back: --upstream ");
        let said = until(&socket, |said| said["links"]["ports"][0]["open"] == true);
        assert_eq!(said["links"]["ports"][0]["times_gone"], time);
    }
    let again = relay.lines_with("port ");
    assert!(again.is_empty(), "once each: {again:?}");
}

/// Process with given standard output and error; it terminates on drop.
struct Bare(Child);

impl Bare {
    fn start(program: &Path, options: &[&str], stdout: Stdio, stderr: Stdio) -> Self {
        let child = Command::new(program)
            .args(options)
            .stdin(Stdio::null())
            .stdout(stdout)
            .stderr(stderr)
            .spawn();
        Self(child.unwrap())
    }

    fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).unwrap();
    }

    fn end(mut self) -> Option<i32> {
        self.signal(Signal::TERM);
        let end = Instant::now() + Duration::from_secs(20);
        while Instant::now() < end {
            if let Some(status) = self.0.try_wait().unwrap() {
                return status.code();
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        panic!("it does not end");
    }
}

impl Drop for Bare {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Checks a reader that stops (full pipe and queue), one that exits (closed pipe), and `/dev/full`.
fn goes_on_where_nobody_reads(program: &Path, options: &[&str]) {
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
        let folder = tempfile::tempdir().unwrap();
        let socket = folder.path().join("status");
        let options = [options, &["--status-socket", socket.to_str().unwrap()]].concat();
        let relay = Bare::start(program, &options, stdout, Stdio::null());
        asked(&socket);
        // Each line has some 1 500 bytes: 64 KiB fit into the pipe, 1 024 lines into the queue.
        let end = Instant::now() + LIMIT;
        let mut dropped = 0;
        while dropped < 10 {
            assert!(Instant::now() < end, "{name}: {dropped} dropped");
            relay.signal(Signal::USR1);
            let asked_at = Instant::now();
            dropped = asked(&socket)["lines_dropped"].as_u64().unwrap();
            assert!(asked_at.elapsed() < Duration::from_secs(2), "{name}");
        }
        assert_eq!(relay.end(), Some(0), "{name}");
    }
    drop(kept);
}

#[test]
fn nobody_who_reads_is_no_reason_to_leave_the_air() {
    goes_on_where_nobody_reads(companion(), &["--index", "1", "--of", "1"]);
}

#[test]
fn nobody_who_reads_is_no_reason_to_leave_the_post() {
    let (files, tty) = (Files::new(), Pty::new());
    let tty = tty.path().to_str().unwrap();
    let signed = files.options("key", "ground");
    let mut options = vec!["--stand", "--end", "rx", "--of", "1", "--tty", tty];
    options.extend(signed.iter().map(String::as_str));
    goes_on_where_nobody_reads(ground(), &options);
}

#[test]
fn a_closed_standard_error_is_no_panic() {
    for options in [&["--index", "0"][..], &["--help"], &["--version"]] {
        for program in [companion(), ground()] {
            let (gone, closed) = std::io::pipe().unwrap();
            drop(gone);
            let status = Command::new(program)
                .args(options)
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

/// Checks that clients that do not read, or that send data, do not block the others.
#[test]
fn the_socket_answers_one_object_whoever_else_is_stuck() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("status");
    let options = ["--index", "1", "--of", "1", "--status-socket"];
    let options = [&options[..], &[socket.to_str().unwrap()]].concat();
    let mut relay = Relay::start(&options);
    relay.line("converged: ");
    let mut stuck: Vec<UnixStream> = (0..20)
        .map(|_| UnixStream::connect(&socket).unwrap())
        .collect();
    for stream in &mut stuck {
        let _ = stream.write(b"GET / HTTP/1.1\r\n\r\n");
    }
    let said = asked(&socket);
    assert_eq!(said["relay"]["index"], 1);
    assert_eq!(said["relay"]["downstream"]["name"], Value::Null);
    assert!(said["relay"]["setpoint"]["x_m"].is_f64(), "{said:#}");
    assert_eq!(said["relay"]["counters"]["refused"], 0);
    // A second process with the same name is refused; a stale name is not.
    let Ended { status, stderr, .. } = Relay::start(&options).end();
    assert_eq!((status, stderr.len()), (Some(1), 1));
    assert!(stderr[0].contains("is in use already"), "{stderr:?}");
    drop(relay);
    assert!(socket.exists(), "it was killed");
    Relay::start(&options).line("started: ");
    std::fs::remove_file(&socket).unwrap();
    std::fs::write(&socket, "").unwrap();
    let Ended { stderr, .. } = Relay::start(&options).end();
    assert!(
        stderr[0].contains("another file of that name"),
        "{stderr:?}"
    );
}

#[test]
fn the_log_is_moved_away_and_opened_again_at_a_hang_up() {
    let folder = tempfile::tempdir().unwrap();
    let (log, moved) = (folder.path().join("log"), folder.path().join("log.1"));
    let options = ["--index", "1", "--of", "1", "--json", "--log-file"];
    let relay = Relay::start(&[&options[..], &[log.to_str().unwrap()]].concat());
    let has = |file: &Path, event: &str| {
        let end = Instant::now() + LIMIT;
        loop {
            let text = std::fs::read_to_string(file).unwrap_or_default();
            let entries: Vec<Value> = text
                .lines()
                .map(|line| serde_json::from_str(line).unwrap())
                .collect();
            if let Some(entry) = entries.iter().find(|entry| entry["event"] == event) {
                return entry.clone();
            }
            assert!(Instant::now() < end, "no {event} in {text}");
            std::thread::sleep(Duration::from_millis(10));
        }
    };
    let converged = has(&log, "converged");
    assert!(converged["target_sir"].as_f64().unwrap() > 0.0);
    assert!(converged["monotonic_s"].is_f64());
    let time = converged["time"].as_str().unwrap();
    let since = time.parse::<Stamp>().unwrap();
    assert!(since.0 < 60, "{time}");
    std::fs::rename(&log, &moved).unwrap();
    relay.signal(Signal::HUP);
    has(&log, "hang-up");
    relay.signal(Signal::USR1);
    assert!(has(&log, "status")["relay"]["counters"]["sent"].is_u64());
    relay.signal(Signal::TERM);
    has(&log, "stopped");
    assert!(has(&moved, "started")["index"] == 1);
}

/// Difference between an RFC 3339 time in UTC and now, s, by the system's `date`.
struct Stamp(u64);

impl std::str::FromStr for Stamp {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let output = Command::new("date")
            .args(["--date", text, "+%s"])
            .output()
            .map_err(|error| error.to_string())?;
        let then: u64 = String::from_utf8_lossy(&output.stdout)
            .trim()
            .parse()
            .map_err(|_| format!("{text} is no time"))?;
        let now = std::time::UNIX_EPOCH.elapsed().unwrap().as_secs();
        if !text.ends_with('Z') {
            return Err(format!("{text} is not in UTC"));
        }
        Ok(Self(now.abs_diff(then)))
    }
}

/// Prevents the growth of any file of that process, as on a full disk, or permits it again.
pub(crate) fn fill_disk(relay: Pid, full: bool) {
    let limit = Rlimit {
        current: full.then_some(0),
        maximum: None,
    };
    prlimit(Some(relay), Resource::Fsize, limit).unwrap();
}

#[test]
fn a_full_disk_is_said_once_and_the_relay_stays_in_the_air() {
    let hub = Hub::new(2);
    let start = |index: usize| {
        let number = index.to_string();
        Relay::start(&[
            "--index",
            &number,
            "--of",
            "2",
            "--shared",
            hub.name(index - 1).to_str().unwrap(),
            "--probe-after-ms",
            "500",
            "--dead-after-ms",
            "1500",
            "--view-file",
            hub.folder().join(format!("view{index}")).to_str().unwrap(),
            "--status-socket",
            hub.folder()
                .join(format!("status{index}"))
                .to_str()
                .unwrap(),
        ])
    };
    let (mut first, mut second) = (start(1), start(2));
    first.line("converged: ");
    second.line("converged: ");
    fill_disk(first.pid(), true);
    // Another view needs another record.
    drop(second);
    let line = first.line("cannot be written: ");
    assert!(line.contains("file: --view-file /"), "{line}");
    second = start(2);
    first.line("back: relay 2");
    second.line("setpoint: ");
    std::thread::sleep(Duration::from_millis(2_500));
    let more = first.lines_with("cannot be written");
    assert!(more.is_empty(), "once: {more:?}");
    fill_disk(first.pid(), false);
    first.line("is written again, after ");
    let said = asked(&hub.folder().join("status1"));
    let (writes, slowest) = (&said["view_file_writes"], &said["view_file_slowest_ms"]);
    println!("{writes} writes of the views, the slowest of {slowest} ms");
    assert!(writes.as_u64().unwrap() >= 2 && slowest.as_f64().unwrap() > 0.0);
    assert!(said["view_file_failures"].as_u64().unwrap() >= 3);
    first.signal(Signal::TERM);
    assert_eq!(first.end().status, Some(0));
}

/// Checks a disk that blocks: the new view file is a FIFO that is not read.
#[test]
fn a_slow_disk_holds_up_what_is_sent_and_nothing_else() {
    let hub = Hub::new(2);
    let views = hub.folder().join("views1");
    let slow = crate::positions::fifo(hub.folder(), "views1.new");
    let start = |index: usize, more: &[&str]| {
        let (number, socket) = (
            index.to_string(),
            hub.folder().join(format!("status{index}")),
        );
        let tty = hub.name(index - 1);
        let options = [
            "--index",
            &number,
            "--of",
            "2",
            "--shared",
            tty.to_str().unwrap(),
        ];
        let quick = ["--probe-after-ms", "500", "--dead-after-ms", "1500"];
        let socket = ["--status-socket", socket.to_str().unwrap()];
        Relay::start(&[&options[..], &quick, &socket, more].concat())
    };
    let mut first = start(1, &["--view-file", views.to_str().unwrap()]);
    let mut second = start(2, &[]);
    first.line("converged: ");
    second.line("converged: ");
    // The relay searches for the other one, then votes on a view without it, and its vote cannot be stored yet. A relay that may
    // send does so every `dead_after`, 1.5 s.
    drop(second);
    first.line("lost: relay 2");
    let socket = hub.folder().join("status1");
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
        let said = asked(&socket);
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
    first.line("is written again, after ");
    second = start(2, &[]);
    first.line("back: relay 2");
    second.line("setpoint: ");
    assert!(sent(&asked(&socket)) > before);
    first.signal(Signal::TERM);
    assert_eq!(first.end().status, Some(0));
    assert!(views.exists() && !slow.exists());
}

/// Checks that the start fails if the epoch cannot be stored, because an epoch must not be used twice.
#[test]
fn an_epoch_that_cannot_be_kept_is_refused_at_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let key = folder.path().join("key");
    crate::signed::write_key(&key, &"5ec2".repeat(16));
    let Ended { status, stderr, .. } = Relay::start(&[
        "--index",
        "1",
        "--of",
        "1",
        "--key-file",
        key.to_str().unwrap(),
        "--epoch-file",
        "/proc/self/epoch",
    ])
    .end();
    assert_eq!((status, stderr.len()), (Some(1), 1), "{stderr:?}");
    assert!(
        stderr[0].contains("--epoch-file /proc/self/epoch: cannot be written"),
        "{stderr:?}"
    );
}
