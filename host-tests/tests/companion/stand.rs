//! Ground stations on duty with three relays in the air, which receive their measurements.

use std::fmt::Write as _;
use std::net::UdpSocket;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;
use uav_relay::Placement;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;

use crate::hub::Hub;
use crate::positions::{fifo, write};
use crate::process::{Ended, LIMIT, Relay};
use crate::signed::Files;
use crate::stays::{asked, until};

/// Three relays and two stations on one channel, with their files.
struct Field {
    hub: Hub,
    files: Files,
}

impl Field {
    fn new() -> Self {
        Self {
            hub: Hub::new(5),
            files: Files::new(),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.hub.folder().join(name)
    }

    fn start(&self, tty: usize, program: fn(&[&str]) -> Relay, more: &[&str]) -> Relay {
        let name = self.hub.name(tty).display().to_string();
        let socket = self.path(&format!("status{tty}")).display().to_string();
        let signed = self.files.options("key", &format!("epoch{tty}"));
        let mut options = vec![
            "--of",
            "3",
            "--interferer",
            "unknown",
            "--status-socket",
            &socket,
        ];
        options.extend(signed.iter().map(String::as_str));
        let tty = if tty < 3 {
            &["--shared"][..]
        } else {
            &["--shared", "--tty"]
        };
        options.extend(tty);
        options.push(&name);
        options.extend(more);
        program(&options)
    }

    /// Starts relay `index`, with a FIFO for its measurements.
    fn relay(&self, index: usize) -> Relay {
        let number = index.to_string();
        let fifo = fifo(self.hub.folder(), &format!("positions{index}"));
        let more = ["--index", &number, "--positions", fifo.to_str().unwrap()];
        let listen = ["--listen", "--listen-every", "0.5"];
        let quick = ["--probe-after-ms", "2000", "--dead-after-ms", "6000"];
        self.start(
            index - 1,
            Relay::start,
            &[&more[..], &listen, &quick].concat(),
        )
    }

    fn station(&self, end: &str, from: &str, more: &[&str]) -> Relay {
        let tty = if end == "tx" { 3 } else { 4 };
        let stand = ["--end", end, "--stand", "--measurements", from];
        self.start(tty, Relay::ground, &[&stand[..], more].concat())
    }

    fn status(&self, tty: usize) -> PathBuf {
        self.path(&format!("status{tty}"))
    }
}

fn is_about(said: &Value, expected: f64) -> bool {
    said.as_f64()
        .is_some_and(|said| (said / expected - 1.0).abs() < 1e-3)
}

fn port() -> u16 {
    let socket = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    socket.local_addr().unwrap().port()
}

/// Returns measurements of relay `relay` at three positions, W.
fn heard(scene: &Scene, relay: usize) -> String {
    let mut lines = String::new();
    for step in 0..3_u8 {
        let at = Placement {
            x_m: 300.0 * relay as f32 - 250.0 + 80.0 * f32::from(step),
            y_m: 40.0 - 40.0 * f32::from(step),
            altitude_m: 20.0 + 10.0 * f32::from(step),
        };
        let (
            Placement {
                x_m,
                y_m,
                altitude_m,
            },
            power_w,
        ) = (at, scene.interference_w(at));
        writeln!(lines, "{x_m} {y_m} {altitude_m} {power_w:e}").unwrap();
    }
    lines
}

#[test]
fn three_relays_know_what_both_stations_measure() {
    let begun = Instant::now();
    let field = Field::new();
    let scene = Scene::new(&Scenario::default(), 3).unwrap();
    let (tx_w, rx_w) = (2.5e-9, f64::from(scene.interference_rx_w() as f32));
    let mut relays: Vec<Relay> = (1..=3).map(|index| field.relay(index)).collect();
    for relay in &mut relays {
        relay.line("guarded: ");
    }
    let (port, level) = (port(), field.path("level"));
    std::fs::write(&level, "nonsense\n").unwrap();
    let udp = format!("udp:{port}");
    let mut tx = field.station("tx", &udp, &["--json"]);
    let mut rx = field.station("rx", level.to_str().unwrap(), &[]);
    assert!(
        tx.line("\"event\":\"started\"")
            .contains("\"end\":\"transmitter\"")
    );
    rx.line("started: receiver of 3 relays, ");
    rx.line("measurement: \"nonsense\" is not POWER or receiver POWER, a power within 1e-30 to 1e6 W, or that in dBm");
    let meter = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    let to = format!("127.0.0.1:{port}");
    // Notation of a spectrum analyser.
    let tx_dbm = format!("{} dBm", 10.0 * f64::log10(tx_w) + 30.0);
    meter.send_to(tx_dbm.as_bytes(), &to).unwrap();
    std::fs::write(&level, format!("1\nreceiver {rx_w:e}\nhalf a li")).unwrap();
    tx.line("\"event\":\"back\"");
    rx.line("back: relay 3 is received");
    for tty in 0..3 {
        until(&field.status(tty), |said| {
            is_about(&said["relay"]["transmitter_w"], tx_w)
                && is_about(&said["relay"]["receiver_w"], rx_w)
        });
    }
    println!(
        "both levels are known after {} ms",
        begun.elapsed().as_millis()
    );
    // The chain's estimate includes the receiver's measurement.
    for (index, relay) in relays.iter_mut().enumerate() {
        write(
            &field.path(&format!("positions{}", index + 1)),
            &heard(&scene, index + 1),
        );
        let line = relay.line("estimate: interferer ");
        let at = line.split("at the receiver ").nth(1).unwrap();
        let at: f64 = at.trim_end_matches(" W").parse().unwrap();
        assert!((at / rx_w - 1.0).abs() < 0.05, "{line}");
    }

    // The station's port is replugged and its log reopened; then it measures another level.
    field.hub.pull(4);
    rx.line("port lost: --tty ");
    rx.signal(Signal::HUP);
    rx.line("hang-up: the log file was reopened; the station continues");
    field.hub.plug(4);
    rx.line("port back: --tty ");
    let end = Instant::now() + LIMIT;
    let is_louder = |said: &Value| said["relay"]["receiver_w"].as_f64().unwrap() > 1.3 * rx_w;
    while !is_louder(&asked(&field.status(2))) {
        std::fs::write(&level, format!("{:e}\n", 2.0 * rx_w)).unwrap();
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(300));
    }
    let said = asked(&field.status(4));
    assert_eq!(said["station"]["hears"], serde_json::json!([1, 2, 3]));
    assert_eq!(said["links"]["ports"][0]["times_gone"], 1);
    assert!(
        said["measurements"]["handed_on"].as_u64().unwrap() >= 2,
        "{said:#}"
    );
    assert_eq!(said["measurements"]["refused"], 1);
    tx.signal(Signal::USR1);
    let status = tx.line("\"event\":\"status\"");
    let status: Value = serde_json::from_str(&status).unwrap();
    assert_eq!(status["measurements"]["handed_on"], 1, "{status:#}");

    // A lost relay is reported because measurements are sent to it.
    drop(relays.remove(2));
    let end = Instant::now() + LIMIT;
    while !rx.has_said("lost: relay 3 does not answer") {
        std::fs::write(&level, format!("{rx_w:e}\n")).unwrap();
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(300));
    }
    for station in [tx, rx] {
        station.signal(Signal::TERM);
        let Ended {
            status,
            stdout,
            stderr,
        } = station.end();
        assert_eq!((status, stderr), (Some(0), Vec::new()));
        let last = stdout.last().unwrap();
        assert!(last.contains("stopped"), "{last}");
    }
    println!("{} ms in all", begun.elapsed().as_millis());
}

#[test]
fn options_of_a_station_that_are_wrong_are_named() {
    let files = Files::new();
    let signed = files.options("key", "ground");
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().to_str().unwrap();
    let refused = |more: &[&str], status: i32, parts: &[&str]| {
        let mut options = vec!["--end", "rx", "--of", "3"];
        options.extend(signed.iter().map(String::as_str));
        options.extend(more);
        let ended = Relay::ground(&options).end();
        assert_eq!(
            (ended.status, ended.stderr.len()),
            (Some(status), 1),
            "{more:?}: {ended:?}"
        );
        for part in parts {
            assert!(ended.stderr[0].contains(part), "{part} not in {ended:?}");
        }
    };
    let tty = crate::pty::Pty::new();
    let at = |more: &[&'static str]| [&["--tty", tty.path().to_str().unwrap()], more].concat();
    refused(&at(&[]), 2, &["--version", "not provided"]);
    refused(
        &at(&["--stand", "--new-altitude", "30"]),
        2,
        &["--version", "not provided"],
    );
    let told = ["--version", "1", "--measurements", "udp:9000"];
    refused(&at(&told), 2, &["--stand", "not provided"]);
    let allowed = "must be udp:PORT or udp:HOST:PORT, PORT within 1 to 65535";
    for from in ["udp:", "udp:0", "udp:65536", "udp::9000", "udp:localhost:x"] {
        let line = format!("--measurements {from}: {allowed}");
        refused(&at(&["--stand", "--measurements", from]), 1, &[&line]);
    }
    let line = format!("--measurements {folder}: Is a directory");
    refused(
        &[&at(&["--stand", "--measurements"])[..], &[folder]].concat(),
        1,
        &[&line],
    );
    let away = ["--stand", "--measurements", "/nowhere/level"];
    refused(
        &at(&away),
        1,
        &["--measurements /nowhere/level: No such file"],
    );
    for version in ["--version", "-V"] {
        let ended = Relay::ground(&[version]).end();
        let expected = format!("linux_ground {}", env!("CARGO_PKG_VERSION"));
        assert_eq!((ended.status, ended.stdout), (Some(0), vec![expected]));
    }
}

/// Checks that a station uploads a mission, reports the result and stays on duty.
#[test]
fn a_station_that_stands_uploads_and_stands_on() {
    let files = Files::new();
    let wire = crate::medium::Medium::new(2, crate::medium::QUIET);
    let signed = files.options("key", "relay");
    let mut options = vec!["--index", "1", "--of", "1", "--upstream", wire.tty(0)];
    options.extend(signed.iter().map(String::as_str));
    let mut relay = Relay::start(&options);
    relay.line("converged: ");
    let folder = tempfile::tempdir().unwrap();
    let signed = files.options("key", "ground");
    let station = |version: &str, name: &str| {
        let (level, capture) = (
            fifo(folder.path(), name),
            folder.path().join(format!("{name}.pcapng")),
        );
        let mut options = vec!["--stand", "--end", "tx", "--of", "1", "--tty", wire.tty(1)];
        options.extend(["--version", version, "--new-altitude", "30"]);
        // A relay without a drone has no geofence.
        options.extend(["--yes", "--no-fence"]);
        options.extend(["--measurements", level.to_str().unwrap()]);
        options.extend(["--capture", capture.to_str().unwrap()]);
        options.extend(signed.iter().map(String::as_str));
        (Relay::ground(&options), level, capture)
    };
    let (mut first, level, capture) = station("2", "first");
    first.line("flown: 1 of 1 relays fly version 2, as relay 1 says");
    relay.line("adopted: flies version 2");
    write(&level, "1e-9\n");
    first.line("measurement: 1.000e-9 W by ");
    first.signal(Signal::TERM);
    let ended = first.end();
    assert_eq!(ended.status, Some(0), "{ended:?}");
    let said = std::fs::metadata(capture).unwrap().len();
    assert!(said > 500, "{said} bytes in the capture");

    let (mut second, ..) = station("1", "second");
    second.line("back: relay 1 is received");
    second.line("not flown: --version 1: must be within 3 to 65535, the relays hold version 2");
    second.signal(Signal::TERM);
    assert_eq!(second.end().status, Some(0), "it stood on");
}
