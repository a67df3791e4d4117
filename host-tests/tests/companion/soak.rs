//! Three companions on one channel, with everything that can happen to a service happening to them again and again: nobody leaves the air.
//!
//! A minute of it; `COMPANION_SECONDS=600` makes it ten.

use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use std::io::Read;

use crate::binary::companion;
use crate::hub::Hub;
use crate::process::{LIMIT, Relay, lines_of};
use crate::stays::{asked, fill_disk, until};

/// What was seen of one relay, over and over.
#[derive(Debug, Default)]
struct Seen {
    answers: u64,
    slowest: Duration,
    /// Answers without a place to be at, after the first with one.
    placeless: u64,
    failed: u64,
}

/// Asks a relay five times a second until it is told to stop.
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

fn count(text: &str, part: &str) -> usize {
    text.lines().filter(|line| line.contains(part)).count()
}

#[test]
fn three_stay_in_the_air_whatever_happens_to_their_ports_readers_and_disks() {
    let seconds = std::env::var("COMPANION_SECONDS").map_or(60, |text| text.parse().unwrap());
    let hub = Hub::new(3);
    let file = |name: &str| hub.folder().join(name).to_str().unwrap().to_owned();
    let sockets: Vec<PathBuf> = (1..=3)
        .map(|it| file(&format!("status{it}")).into())
        .collect();
    let options = |index: usize| {
        let (number, radio) = (index.to_string(), hub.name(index - 1));
        let (socket, views) = (
            file(&format!("status{index}")),
            file(&format!("views{index}")),
        );
        [
            ["--index", &number],
            ["--of", "3"],
            ["--shared", radio.to_str().unwrap()],
            ["--probe-after-ms", "500"],
            ["--dead-after-ms", "1500"],
            ["--status-socket", &socket],
            ["--view-file", &views],
        ]
        .map(|pair| pair.map(str::to_owned))
        .concat()
    };

    // The lines of the first go to a reader that does not read.
    let (mut reader, writer) = std::io::pipe().unwrap();
    let first = Command::new(companion())
        .args(options(1))
        .stdin(Stdio::null())
        .stdout(writer)
        .spawn();
    let first = Killed(first.unwrap());
    let log = file("log2");
    let mut arguments = options(2);
    arguments.extend(["--log-file".to_owned(), log.clone()]);
    let second = Relay::start(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let arguments = options(3);
    let mut third = Relay::start(&arguments.iter().map(String::as_str).collect::<Vec<_>>());
    let pids = [Pid::from_child(&first.0), second.pid(), third.pid()];
    let all_three = |said: &Value| {
        said["relay"]["relays"] == 3
            && said["relay"]["setpoint"].is_object()
            && said["relay"]["has_lease"] == true
    };
    for socket in &sockets {
        until(socket, all_three);
    }

    let stop = Arc::new(AtomicBool::new(false));
    let watchers: Vec<_> = sockets
        .iter()
        .map(|socket| {
            let (socket, stop) = (socket.clone(), Arc::clone(&stop));
            std::thread::spawn(move || watch(&socket, &stop))
        })
        .collect();
    let begun = Instant::now();
    let mut rounds = 0;
    while begun.elapsed() < Duration::from_secs(seconds) {
        rounds += 1;
        for pid in pids {
            kill_process(pid, Signal::HUP).unwrap();
        }
        // While the disk of the third is full the second is lost: another view, and another record that cannot be written.
        fill_disk(third.pid(), true);
        hub.pull(1);
        let line = third.line("cannot be written: ");
        assert!(line.contains("file: --view-file /"), "{line}");
        // Lines of 2 KB each that nobody takes: 64 KiB in the pipe, 1 024 of them in the queue.
        for _ in 0..400 {
            kill_process(pids[0], Signal::USR1).unwrap();
            std::thread::sleep(Duration::from_millis(10));
        }
        hub.plug(1);
        fill_disk(third.pid(), false);
        third.line("is written again, after ");
        for socket in &sockets {
            until(socket, all_three);
        }
    }
    let took = begun.elapsed();
    stop.store(true, Ordering::Relaxed);
    let seen: Vec<Seen> = watchers.into_iter().map(|it| it.join().unwrap()).collect();

    // The reader of the first goes on, and is told of what it has missed.
    let dropped = asked(&sockets[0])["lines_dropped"].as_u64().unwrap();
    let lines = lines_of(std::mem::replace(&mut reader, std::io::pipe().unwrap().0));
    let end = Instant::now() + LIMIT;
    let mut told = 0;
    while told == 0 {
        kill_process(pids[0], Signal::USR1).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        told = lines
            .try_iter()
            .filter(|it| it.contains(" lines dropped, nobody"))
            .count();
        assert!(
            Instant::now() < end || dropped == 0,
            "nobody told of {dropped}"
        );
        if dropped == 0 {
            break;
        }
    }
    println!(
        "{} s, {rounds} rounds, {dropped} lines dropped by the first",
        took.as_secs()
    );
    for (seen, index) in seen.iter().zip(1..) {
        println!("relay {index}: {seen:?}");
        assert_eq!(
            (seen.failed, seen.placeless),
            (0, 0),
            "relay {index}: {seen:?}"
        );
        assert!(
            seen.slowest < Duration::from_secs(5),
            "relay {index}: {seen:?}"
        );
        assert!(seen.answers > seconds, "relay {index}: {seen:?}");
    }
    assert!(dropped > 0 && told == 1, "{dropped}, {told}");

    let said = std::fs::read_to_string(&log).unwrap();
    for part in ["port lost: --shared ", "port back: --shared ", "hang-up: "] {
        assert_eq!(count(&said, part), rounds, "{part} in {said}");
    }
    third.signal(Signal::TERM);
    let third = third.end();
    assert_eq!((third.status, &third.stderr[..]), (Some(0), &[][..]));
    let said = third.stdout.join("\n");
    for part in [
        "cannot be written: ",
        "is written again, after ",
        "hang-up: ",
    ] {
        assert_eq!(count(&said, part), rounds, "{part} in {said}");
    }
    second.signal(Signal::TERM);
    assert_eq!(second.end().status, Some(0));
}
