//! Soak test of three companions on one channel. Faults repeat for a minute or `COMPANION_SECONDS`.

use std::io::{PipeReader, Read as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::binary::companion;
use crate::chain::{Chain, QUICK};
use crate::files::{status_of, until};
use crate::medium::Medium;
use crate::process::{LIMIT, Relay, lines_of, words};
use crate::stays::fill_disk;

/// Statistics of the answers to status queries of one relay.
#[derive(Debug, Default)]
struct StatusStatistics {
    answers: u64,
    slowest: Duration,
    /// Number of status answers in which the relay has no setpoint.
    placeless: u64,
    failed: u64,
}

/// Queries a relay's status five times a second until `stop` is set.
fn watch(socket: &Path, stop: &AtomicBool) -> StatusStatistics {
    let mut seen = StatusStatistics::default();
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

/// Returns the options for the status socket and the file of membership votes of relay `index`.
fn files(chain: &Chain, index: usize) -> String {
    let file = |name: &str| chain.files.text(&format!("{name}{index}"));
    format!(
        "--status-socket {} --view-file {}",
        file("status"),
        file("views")
    )
}

/// Returns true if a relay's status answer shows three relays in the chain, a setpoint and a lease.
fn of_three(said: &Value) -> bool {
    said["relay"]["relays"] == 3
        && said["relay"]["setpoint"].is_object()
        && said["relay"]["has_lease"] == true
}

/// Injects one round of faults: an unplugged port, a full disk and log lines that are not read. Waits until the chain
/// has recovered.
fn round(channel: &Medium, sockets: &[PathBuf], relays: &mut [Relay; 3]) {
    for relay in &*relays {
        relay.signal(Signal::HUP);
    }
    let [first, _, third] = relays;
    // Relay 2 is lost while relay 3's disk is full: the new view needs a record that cannot be written.
    fill_disk(third.pid(), true);
    channel.pull(1);
    let line = third.line("cannot be written: ");
    assert!(line.contains("file: --view-file /"), "{line}");
    // Lines of 2 KB each are not read: 64 KiB fit into the pipe, 1 024 lines into the queue.
    for _ in 0..400 {
        first.signal(Signal::USR1);
        std::thread::sleep(Duration::from_millis(10));
    }
    channel.plug(1);
    fill_disk(third.pid(), false);
    third.line("can be written again, after ");
    for socket in sockets {
        until(socket, of_three);
    }
}

/// Resumes the reading of the first relay's log lines.
///
/// Returns the number of log lines that report dropped lines.
fn reports_of_dropped_lines(first: &Relay, reader: PipeReader, dropped: u64) -> usize {
    let lines = lines_of(reader);
    let end = Instant::now() + LIMIT;
    while dropped > 0 && Instant::now() < end {
        first.signal(Signal::USR1);
        std::thread::sleep(Duration::from_millis(20));
        let told = lines.try_iter();
        let told = told.filter(|it| it.contains(" log lines dropped: the disk was full"));
        let told = told.count();
        if told > 0 {
            return told;
        }
    }
    0
}

fn check_logged_once_a_round(said: &[String], parts: [&str; 3], rounds: usize) {
    for part in parts {
        let times = said.iter().filter(|line| line.contains(part)).count();
        assert_eq!(times, rounds, "{part} in {said:#?}");
    }
}

#[test]
fn faults_of_ports_and_disks_end_no_relay() {
    let seconds = std::env::var("COMPANION_SECONDS").map_or(60, |text| text.parse().unwrap());
    let chain = Chain::on_channel(3, Medium::pluggable(3)).with(QUICK);
    let sockets = [1, 2, 3].map(|index| chain.files.path(&format!("status{index}")));

    // The first relay's lines go to a reader that does not read.
    let (reader, writer) = std::io::pipe().unwrap();
    let first = chain.arguments(1, &files(&chain, 1));
    let first = Relay::run(companion(), &words(&first), writer.into());
    let log = chain.files.text("log2");
    let second = format!("{} --log-file {log}", files(&chain, 2));
    let [second, third] =
        [(2, second), (3, files(&chain, 3))].map(|(at, own)| chain.relay(at, &own));
    let mut relays = [first, second, third];
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
        round(&chain.media[0], &sockets, &mut relays);
    }
    let took = begun.elapsed().as_secs();
    stop.store(true, Ordering::Relaxed);
    let seen = watchers.map(|watcher| watcher.join().unwrap());

    let dropped = status_of(&sockets[0])["lines_dropped"].as_u64().unwrap();
    println!("{took} s, {rounds} rounds, {dropped} lines dropped by the first");
    for (seen, index) in seen.iter().zip(1..) {
        println!("relay {index}: {seen:?}");
        assert_eq!((seen.failed, seen.placeless), (0, 0), "relay {index}");
        assert!(seen.slowest < Duration::from_secs(5), "relay {index}");
        assert!(seen.answers > seconds, "relay {index}");
    }
    assert!(dropped > 0);
    let [first, second, third] = relays;
    assert_eq!(reports_of_dropped_lines(&first, reader, dropped), 1);
    second.stopped();
    let said = std::fs::read_to_string(&log).unwrap();
    let said: Vec<String> = said.lines().map(str::to_owned).collect();
    let parts = ["port lost: --shared ", "port back: --shared ", "hang-up: "];
    check_logged_once_a_round(&said, parts, rounds);
    let parts = [
        "cannot be written: ",
        "can be written again, after ",
        "hang-up: ",
    ];
    check_logged_once_a_round(&third.stopped(), parts, rounds);
}
