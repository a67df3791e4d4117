//! Soak test of three companions on one channel. Faults repeat for a minute or `COMPANION_SECONDS`.

use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::{PipeReader, Read};

use crate::binary::companion;
use crate::hub::Hub;
use crate::process::{LIMIT, Relay, lines_of};
use crate::stays::{asked, fill_disk, until};

/// Statistics of one relay's status answers.
#[derive(Debug, Default)]
struct Seen {
    answers: u64,
    slowest: Duration,
    /// Answers without a setpoint after the first one with a setpoint.
    placeless: u64,
    failed: u64,
}

/// Queries a relay's status five times a second until `stop` is set.
fn watch(socket: &Path, stop: &AtomicBool) -> Seen {
    let mut seen = Seen::default();
    while !stop.load(Ordering::Relaxed) {
        let begun = Instant::now();
        let mut text = String::new();
        let read = UnixStream::connect(socket).and_then(|mut it| it.read_to_string(&mut text));
        match read.map(|_| serde_json::from_str::<Value>(&text)) {
            Ok(Ok(said)) => {
                seen.answers += 1;
                seen.placeless += u64::from(said["relay"]["setpoint"].is_null());
            }
            _ => seen.failed += 1,
        }
        seen.slowest = seen.slowest.max(begun.elapsed());
        std::thread::sleep(Duration::from_millis(200));
    }
    seen
}

struct Killed(Child);

impl Drop for Killed {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn options(hub: &Hub, index: usize) -> Vec<String> {
    let file = |name: &str| {
        hub.folder()
            .join(format!("{name}{index}"))
            .display()
            .to_string()
    };
    [
        ["--index", &index.to_string()],
        ["--of", "3"],
        ["--shared", hub.name(index - 1).to_str().unwrap()],
        ["--probe-after-ms", "500"],
        ["--dead-after-ms", "1500"],
        ["--status-socket", &file("status")],
        ["--view-file", &file("views")],
    ]
    .map(|pair| pair.map(str::to_owned))
    .concat()
}

fn start(arguments: &[String]) -> Relay {
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    Relay::start(&arguments)
}

/// Returns true if the relay has its setpoint and a lease in a chain of three.
fn of_three(said: &Value) -> bool {
    said["relay"]["relays"] == 3
        && said["relay"]["setpoint"].is_object()
        && said["relay"]["has_lease"] == true
}

/// Runs one round of faults; `third` is the last of `pids`.
fn round(hub: &Hub, sockets: &[PathBuf], pids: [Pid; 3], third: &mut Relay) {
    for pid in pids {
        kill_process(pid, Signal::HUP).unwrap();
    }
    // Relay 2 is lost while relay 3's disk is full: the new view needs a record that cannot be written.
    fill_disk(pids[2], true);
    hub.pull(1);
    let line = third.line("cannot be written: ");
    assert!(line.contains("file: --view-file /"), "{line}");
    // Lines of 2 KB each are not read: 64 KiB fit into the pipe, 1 024 lines into the queue.
    for _ in 0..400 {
        kill_process(pids[0], Signal::USR1).unwrap();
        std::thread::sleep(Duration::from_millis(10));
    }
    hub.plug(1);
    fill_disk(pids[2], false);
    third.line("is written again, after ");
    for socket in sockets {
        until(socket, of_three);
    }
}

/// Resumes reading of the first relay's lines. Returns the number of reports on dropped lines.
fn told(pid: Pid, reader: PipeReader, dropped: u64) -> usize {
    let lines = lines_of(reader);
    let end = Instant::now() + LIMIT;
    while dropped > 0 && Instant::now() < end {
        kill_process(pid, Signal::USR1).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        let told = lines.try_iter();
        let told = told
            .filter(|it| it.contains(" lines dropped: the output"))
            .count();
        if told > 0 {
            return told;
        }
    }
    0
}

fn said_once_a_round(said: &str, parts: [&str; 3], rounds: usize) {
    for part in parts {
        let times = said.lines().filter(|line| line.contains(part)).count();
        assert_eq!(times, rounds, "{part} in {said}");
    }
}

#[test]
fn three_stay_in_the_air_whatever_happens_to_their_ports_readers_and_disks() {
    let seconds = std::env::var("COMPANION_SECONDS").map_or(60, |text| text.parse().unwrap());
    let hub = Hub::new(3);
    let sockets = [1, 2, 3].map(|index| hub.folder().join(format!("status{index}")));

    // The first relay's lines go to a reader that does not read.
    let (reader, writer) = std::io::pipe().unwrap();
    let first = Command::new(companion())
        .args(options(&hub, 1))
        .stdin(Stdio::null())
        .stdout(writer)
        .spawn();
    let first = Killed(first.unwrap());
    let log = hub.folder().join("log2");
    let to_file = ["--log-file".to_owned(), log.display().to_string()];
    let second = start(&[&options(&hub, 2)[..], &to_file].concat());
    let mut third = start(&options(&hub, 3));
    let pids = [Pid::from_child(&first.0), second.pid(), third.pid()];
    for socket in &sockets {
        until(socket, of_three);
    }

    let stop = Arc::new(AtomicBool::new(false));
    let watchers = sockets.clone().map(|socket| {
        let stop = Arc::clone(&stop);
        std::thread::spawn(move || watch(&socket, &stop))
    });
    let begun = Instant::now();
    let mut rounds = 0;
    while begun.elapsed() < Duration::from_secs(seconds) {
        rounds += 1;
        round(&hub, &sockets, pids, &mut third);
    }
    let took = begun.elapsed().as_secs();
    stop.store(true, Ordering::Relaxed);
    let seen = watchers.map(|watcher| watcher.join().unwrap());

    let dropped = asked(&sockets[0])["lines_dropped"].as_u64().unwrap();
    println!("{took} s, {rounds} rounds, {dropped} lines dropped by the first");
    for (seen, index) in seen.iter().zip(1..) {
        println!("relay {index}: {seen:?}");
        assert_eq!((seen.failed, seen.placeless), (0, 0), "relay {index}");
        assert!(seen.slowest < Duration::from_secs(5), "relay {index}");
        assert!(seen.answers > seconds, "relay {index}");
    }
    assert!(dropped > 0);
    assert_eq!(told(pids[0], reader, dropped), 1);
    let said = std::fs::read_to_string(&log).unwrap();
    let parts = ["port lost: --shared ", "port back: --shared ", "hang-up: "];
    said_once_a_round(&said, parts, rounds);
    let ends = [second, third].map(|relay| {
        relay.signal(Signal::TERM);
        relay.end()
    });
    for end in &ends {
        assert_eq!((end.status, &end.stderr[..]), (Some(0), &[][..]));
    }
    let said = ends[1].stdout.join("\n");
    let parts = [
        "cannot be written: ",
        "is written again, after ",
        "hang-up: ",
    ];
    said_once_a_round(&said, parts, rounds);
}
