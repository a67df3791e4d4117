//! Ground stations on duty with three relays in the air, which receive their measurements.

use std::fmt::Write as _;
use std::net::{TcpListener, UdpSocket};
use std::time::{Duration, Instant};

use host_tests::make;
use rustix::process::Signal;
use serde_json::Value;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::scene::Scene;

use crate::chain::Chain;
use crate::datagrams::Ports;
use crate::files::{Files, status_of, until, write};
use crate::medium::{Medium, QUIET};
use crate::process::{LIMIT, Relay};

/// Returns the command-line options of the relay or ground station at `tty`.
///
/// Three relays and two stations share one channel.
fn common(field: &Chain, tty: usize) -> String {
    let socket = field.files.text(&format!("status{tty}"));
    let signed = field.files.signed("key", &format!("epoch{tty}"));
    format!("--interferer unknown --status-socket {socket} {signed}")
}

/// Starts relay `index`, with a FIFO for its measurements.
fn relay(field: &Chain, index: usize) -> Relay {
    let fifo = field.files.fifo(&format!("positions{index}"));
    let listen = "--listen --listen-every 0.5 --probe-after-ms 2000 --dead-after-ms 6000";
    let common = common(field, index - 1);
    field.relay(index, &format!("{common} --positions {fifo} {listen}"))
}

fn station(field: &Chain, end: &str, from: &str, more: &str) -> Relay {
    let tty = if end == "tx" { 3 } else { 4 };
    let (name, common) = (field.media[0].tty(tty), common(field, tty));
    let stand = format!("--of 3 --end {end} --stand --measurements {from} --shared --tty {name}");
    Relay::ground(&format!("{stand} {common} {more}"))
}

fn is_about(said: &Value, expected: f64) -> bool {
    said.as_f64()
        .is_some_and(|said| (said / expected - 1.0).abs() < 1e-3)
}

/// Returns FIFO lines with three positions of relay `relay` and the interference power there, W.
fn fifo_lines(scene: &Scene, relay: usize) -> String {
    let mut lines = String::new();
    for step in 0..3_u8 {
        let at = make::placement(
            300.0 * relay as f32 - 250.0 + 80.0 * f32::from(step),
            40.0 - 40.0 * f32::from(step),
            20.0 + 10.0 * f32::from(step),
        );
        let power_w = scene.interference_w(at);
        writeln!(lines, "{} {} {} {power_w:e}", at.x_m, at.y_m, at.altitude_m).unwrap();
    }
    lines
}

/// Writes an interference power to a file repeatedly until `is_so` returns true.
///
/// The writing is repeated because a ground station reads the file only when it has changed.
fn write_until(level: &str, power_w: f64, mut is_so: impl FnMut() -> bool) {
    let end = Instant::now() + LIMIT;
    while !is_so() {
        std::fs::write(level, format!("{power_w:e}\n")).unwrap();
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(300));
    }
}

#[test]
fn the_relays_know_the_measurements_of_both_stations() {
    let begun = Instant::now();
    let field = Chain::on_channel(3, Medium::pluggable(5));
    let status = |tty: usize| field.files.path(&format!("status{tty}"));
    let scene = Scene::new(&Scenario::default(), 3).unwrap();
    let (tx_w, rx_w) = (2.5e-9, f64::from(scene.interference_rx_w() as f32));
    let mut relays: Vec<Relay> = (1..=3).map(|index| relay(&field, index)).collect();
    for relay in &mut relays {
        relay.line("guarded: ");
    }
    let port = Ports::apart(1).port;
    let level = field.files.write("level", "nonsense\n");
    let mut tx = station(&field, "tx", &format!("udp:{port}"), "--json");
    let mut rx = station(&field, "rx", &level, "");
    let started = tx.line("\"event\":\"started\"");
    assert!(started.contains("\"end\":\"transmitter\""));
    rx.line("started: receiver of a chain of 3 relays, ");
    rx.line(&format!("measurement: invalid line \"nonsense\" in --measurements {level} is ignored: \"nonsense\" is not a power in W without the unit, within 1e-30 to 1e6, or in dBm with the unit, for example -95 dBm; a valid line is POWER or receiver POWER; "));
    let meter = UdpSocket::bind(("127.0.0.1", 0)).unwrap();
    // Notation of a spectrum analyser.
    let tx_dbm = format!("{} dBm", 10.0 * f64::log10(tx_w) + 30.0);
    meter
        .send_to(tx_dbm.as_bytes(), ("127.0.0.1", port))
        .unwrap();
    std::fs::write(&level, format!("1\nreceiver {rx_w:e}\nhalf a li")).unwrap();
    tx.line("\"event\":\"back\"");
    rx.line("back: relay 3 and this station receive each other");
    for tty in 0..3 {
        until(status(tty), |said| {
            is_about(&said["relay"]["transmitter_w"], tx_w)
                && is_about(&said["relay"]["receiver_w"], rx_w)
        });
    }
    println!(
        "both levels are known after {} ms",
        begun.elapsed().as_millis()
    );
    // The chain's estimate includes the receiver's measurement.
    for (index, relay) in (1..).zip(&mut relays) {
        write(
            field.files.path(&format!("positions{index}")),
            &fifo_lines(&scene, index),
        );
        let line = relay.line("estimate: interferer ");
        let at = line.split("at the receiver ").nth(1).unwrap();
        let at: f64 = at.trim_end_matches(" W").parse().unwrap();
        assert!((at / rx_w - 1.0).abs() < 0.05, "{line}");
    }

    // The station's port is replugged and its log reopened; then it measures another level.
    field.media[0].pull(4);
    rx.line("port lost: --tty ");
    rx.signal(Signal::HUP);
    rx.line("hang-up: the log file was reopened after SIGHUP; the station continues");
    field.media[0].plug(4);
    rx.line("port back: --tty ");
    let is_louder = |said: &Value| said["relay"]["receiver_w"].as_f64().unwrap() > 1.3 * rx_w;
    write_until(&level, 2.0 * rx_w, || is_louder(&status_of(status(2))));
    let said = status_of(status(4));
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
    write_until(&level, rx_w, || {
        rx.has_printed("lost: relay 3 has not replied to this station for 5 s")
    });
    for station in [tx, rx] {
        let last = station.stopped().pop().unwrap();
        assert!(last.contains("stopped"), "{last}");
    }
    println!("{} ms in all", begun.elapsed().as_millis());
}

#[test]
fn wrong_options_of_a_station_are_named() {
    let files = Files::new();
    let (signed, tty) = (files.signed("key", "ground"), crate::pty::Pty::new());
    let folder = files.text("");
    let udp = "must be udp:PORT or udp:HOST:PORT, with PORT within 1 to 65535";
    let mut cases = vec![
        (String::new(), 2, "--version".to_owned()),
        (
            "--stand --new-altitude 30".to_owned(),
            2,
            "--version".to_owned(),
        ),
        (
            "--version 1 --measurements udp:9000".to_owned(),
            2,
            "--stand".to_owned(),
        ),
    ];
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let own = taken.local_addr().unwrap();
    for (address, why) in [
        (own.to_string(), format!("port {} is in use by", own.port())),
        (
            "192.0.2.1:80".to_owned(),
            "192.0.2.1 is not an address of".to_owned(),
        ),
    ] {
        let option = format!("--web {address}");
        let secret = format!("--web-password {}", files.text("key"));
        cases.push((
            format!("--stand {option} {secret}"),
            1,
            format!("{option}: {why}"),
        ));
    }
    let short = files.write_key("short", "1234567\n");
    for (option, status, why) in [
        (
            "--web 0.0.0.0:80".to_owned(),
            2,
            "other computers can reach this address, so it needs --web-password FILE",
        ),
        (format!("--web-password {short}"), 2, "--web <ADDRESS:PORT>"),
        (
            format!("--web 127.0.0.1:0 --web-password {short}"),
            2,
            "must have 8 to 200 characters in its first line",
        ),
    ] {
        cases.push((format!("--stand {option}"), status, why.to_owned()));
    }
    let range = "must be within 2 to 3, more than half of --of".to_owned();
    cases.push(("--stand --flying 1".to_owned(), 2, range));
    let from = ["udp:", "udp:0", "udp:65536", "udp::9000", "udp:localhost:x"];
    let from = from.map(|from| (from, udp));
    let files = [
        (&*folder, "Is a directory"),
        ("/nowhere/level", "No such file"),
    ];
    for (from, why) in from.into_iter().chain(files) {
        let option = format!("--measurements {from}");
        cases.push((format!("--stand {option}"), 1, format!("{option}: {why}")));
    }
    for (more, status, part) in cases {
        let good = format!("--end rx --of 3 {signed} --tty {}", tty.path().display());
        let line = Relay::ground(&format!("{good} {more}")).refused(status);
        assert!(line.contains(&part), "{part} not in {line}");
        let is_missing = status == 2 && part.starts_with("--");
        assert_eq!(line.contains("not provided"), is_missing, "{line}");
    }
    for version in ["--version", "-V"] {
        let expected = format!("linux_ground {}", env!("CARGO_PKG_VERSION"));
        assert_eq!(Relay::ground(version).succeeds(), [expected]);
    }
}

/// Checks that `linux_ground --stand` uploads a mission, reports the result and continues to run.
#[test]
fn a_running_station_uploads_and_keeps_running() {
    let chain = Chain::with_ground(1, QUIET);
    let files = &chain.files;
    let mut relay = chain.relay(1, &files.signed("key", "relay"));
    relay.line("converged: ");
    let station = |version: &str, name: &str| {
        let (level, capture) = (files.fifo(name), files.text(&format!("{name}.pcapng")));
        let (tty, signed) = (
            chain.tx.as_ref().unwrap().tty(0),
            files.signed("key", "ground"),
        );
        // A relay without a drone has no geofence.
        let upload = format!("--version {version} --new-altitude 30 --yes --no-fence");
        let own = format!("--measurements {level} --capture {capture} {signed}");
        let stand = format!("--stand --end tx --of 1 --tty {tty}");
        (
            Relay::ground(&format!("{stand} {upload} {own}")),
            level,
            capture,
        )
    };
    let (mut first, level, capture) = station("2", "first");
    first.line("flown: 1 of 1 relays fly version 2 of the mission, as relay 1 reports for the present members of the chain (view ");
    relay.line("adopted: the chain flies version 2");
    write(&level, "1e-9\n");
    first.line("measurement: measured interference 1.000e-9 W, from ");
    first.stopped();
    let said = std::fs::metadata(capture).unwrap().len();
    assert!(said > 500, "{said} bytes in the capture");

    let (mut second, ..) = station("1", "second");
    second.line("back: relay 1 and this station receive each other");
    second.line(
        "not flown: --version 1: must be within 3 to 65535, because the relays have version 2 of the mission",
    );
    second.signal(Signal::TERM);
    assert_eq!(second.end().status, Some(0), "it stood on");
}
