//! Report on an autopilot that does not answer: after 3 s, once, with hints, and in the status.

use std::net::UdpSocket;
use std::time::Duration;

use crate::datagrams::Ports;
use crate::files::{Files, status_of, until};
use crate::peer::relay;
use crate::process::Relay;
use crate::pty::Pty;

/// Maximum delay of a log line on a busy machine, s.
const LATE_S: f64 = 1.5;

struct Unanswered {
    relay: Relay,
    files: Files,
}

impl Unanswered {
    fn start(autopilot: &str) -> Self {
        let files = Files::new();
        let socket = files.text("status");
        let mut relay = relay(autopilot, &format!("--status-socket {socket}"));
        relay.line("autopilot: opened --autopilot");
        Self { relay, files }
    }

    /// Starts a relay that expects its autopilot at UDP port `ports.port`.
    fn at(ports: Ports) -> Self {
        Self::start(&format!("udp:127.0.0.1:{}", ports.port))
    }

    fn status(&self) -> std::path::PathBuf {
        self.files.path("status")
    }

    /// Checks that the companion reports after 3 s that its autopilot does not answer.
    ///
    /// The report is a log line that contains `parts`, and a text in the status.
    fn check_report(&mut self, parts: &[&str]) {
        let line = self.relay.line(parts[0]);
        let seconds = seconds(&line);
        assert!((3.0..3.0 + LATE_S).contains(&seconds), "{line}");
        for part in parts {
            assert!(line.contains(part), "{part} not in {line}");
        }
        let said = status_of(self.status());
        let autopilot = &said["autopilot"];
        let why = autopilot["unanswered"].as_str().unwrap();
        assert!(line.ends_with(why), "{why} is not the end of {line}");
        assert_eq!(autopilot["state"], "silent", "{autopilot}");
    }

    /// Checks that the report of a silent autopilot is not repeated for 7 s.
    ///
    /// The companion must be nearly idle during this time.
    fn check_no_repetition(&mut self) {
        let before = self.relay.cost();
        std::thread::sleep(Duration::from_secs(7));
        let (used, woken) = self.relay.cost_since(before);
        assert!(used < Duration::from_millis(300), "{used:?}");
        assert!(woken < 300, "woken {woken} times");
        let again = self.relay.lines_with("autopilot: ");
        assert!(again.is_empty(), "{again:?}");
        let said = status_of(self.status());
        assert!(said["autopilot"]["unanswered"].is_string(), "{said}");
    }
}

/// Returns the time since the start, s, with which a log line begins.
fn seconds(line: &str) -> f64 {
    line.split_whitespace().nth(1).unwrap().parse().unwrap()
}

#[test]
fn an_unreachable_udp_port_is_logged_once() {
    let ports = Ports::apart(1_000);
    let mut unanswered = Unanswered::at(ports);
    let (at, local) = (
        format!("127.0.0.1:{}", ports.port),
        format!("from local port {}", ports.local),
    );
    unanswered.check_report(&[
        "autopilot: no answer at ",
        &at,
        &local,
        "connection refused",
    ]);
    unanswered.check_no_repetition();
    // The autopilot is found once it is running.
    let drone = ports.drone(9);
    unanswered.relay.line("autopilot: found a PX4");
    unanswered.relay.line("autopilot: on the ground");
    let said = until(unanswered.status(), |said| {
        said["autopilot"]["state"] == "grounded"
    });
    let autopilot = &said["autopilot"];
    assert!(autopilot["unanswered"].is_null(), "{autopilot}");
    assert_eq!(autopilot["port"]["local_port"], ports.local, "{autopilot}");
    assert!(
        autopilot["port"]["times_refused"].as_u64() > Some(2),
        "{autopilot}"
    );
    drop(drone);
    unanswered.relay.line("autopilot: no heartbeat");
    unanswered.relay.stopped();
}

/// Checks that a relay reports once that the autopilot at a UDP port does not answer.
///
/// For example, a PX4 may answer only another program.
#[test]
fn a_silent_udp_port_is_logged_once() {
    let ports = Ports::apart(1_000);
    let silent = UdpSocket::bind(("127.0.0.1", ports.port)).unwrap();
    let mut unanswered = Unanswered::at(ports);
    let local = format!("from local port {}", ports.local);
    unanswered.check_report(&[
        "autopilot: no answer at ",
        &local,
        "A PX4 answers only the first port",
        "udp:HOST:PORT@LOCAL",
    ]);
    unanswered.check_no_repetition();
    let mut frame = [0; 300];
    assert!(silent.recv(&mut frame).unwrap() > 0, "it was spoken to");
}

#[test]
fn a_silent_tty_is_logged_once() {
    let pty = Pty::new();
    let path = pty.path().to_str().unwrap();
    let mut unanswered = Unanswered::start(path);
    unanswered.check_report(&[
        "autopilot: no bytes received at ",
        path,
        "115200 bit/s",
        "TX",
    ]);
    unanswered.check_no_repetition();
}

/// Checks that bytes that are not MAVLink 2, as at a wrong baud rate, are reported as such.
#[test]
fn noise_is_distinguished_from_silence() {
    let ports = Ports::apart(1_000);
    let noisy = UdpSocket::bind(("127.0.0.1", ports.port)).unwrap();
    let mut unanswered = Unanswered::at(ports);
    for _ in 0..30 {
        noisy
            .send_to(&[0x55; 50], ("127.0.0.1", ports.local))
            .unwrap();
        std::thread::sleep(Duration::from_millis(150));
    }
    let line = unanswered.relay.line("are not MAVLink 2");
    assert!(line.contains("autopilot: "), "{line}");
    assert!(!unanswered.relay.has_printed("no answer"), "bytes came");
}

/// Checks that frames of other systems are reported as not from a PX4 or an ArduCopter.
///
/// Other systems are a ground station, a radio or a plane, none of which the companion can control.
#[test]
fn other_systems_are_distinguished_from_an_autopilot() {
    let ports = Ports::apart(1_000);
    let mut drone = ports.drone(ports.local);
    drone.order("stranger");
    let mut unanswered = Unanswered::at(ports);
    let line = unanswered.relay.line("none from a PX4 or an ArduCopter");
    assert!(
        line.contains("autopilot: MAVLink frames are received at "),
        "{line}"
    );
    assert!(!unanswered.relay.has_printed("no answer"), "frames came");
    drone.order("vehicle");
    unanswered.relay.line("autopilot: found a PX4");
    assert!(status_of(unanswered.status())["autopilot"]["unanswered"].is_null());
}
