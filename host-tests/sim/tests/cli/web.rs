//! `--web`: a page in a browser that shows the run while it is simulated.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Command, Stdio};

use super::{chain, refusal, refusals};

const WRONG: &[&str] = &[
    "--web 127.0.0.1:8080",
    "--fly --web 8080",
    "--fly --web 127.0.0.1",
    "--fly --web 127.0.0.1:65536",
    "--fly --web example.org:80",
    "--fly --web 192.0.2.1:8080",
    "--fly --speed 2",
    "--fly --web 127.0.0.1:0 --speed 0",
    "--fly --web 127.0.0.1:0 --speed 101",
    "--fly --web 127.0.0.1:0 --speed fast",
    "--fly --web 127.0.0.1:0 --json",
    "--fly --web 127.0.0.1:0 --svg a.svg",
    "--fly --web 127.0.0.1:0 --forge 10",
    "--fly --web 127.0.0.1:0 --traffic",
];

#[test]
fn wrong_options_of_the_screen_are_named_with_what_is_allowed() {
    insta::assert_snapshot!(refusals(WRONG));
}

#[test]
fn a_port_in_use_is_named() {
    let other = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = other.local_addr().unwrap();
    let (status, line) = refusal(&format!("--fly --web {address}"));
    assert_eq!(status, 2);
    let port = address.port();
    assert_eq!(
        line.trim_end(),
        format!(
            "--web {address}: port {port} is in use by another program: give another port, or 0 for any free port"
        )
    );
}

#[test]
fn help_explains_the_screen() {
    let help = String::from_utf8(chain("--help").stdout).unwrap();
    let (_, screen) = help.split_once("Screen:").unwrap();
    for words in [
        "--web <ADDRESS:PORT>",
        "--speed <X>",
        "until Ctrl-C",
        "127.0.0.1:8080",
    ] {
        assert!(screen.contains(words), "{words}: {screen}");
    }
}

/// Running `cargo chain`, which is killed at the end of a test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        _ = self.0.kill();
        _ = self.0.wait();
    }
}

/// Starts `cargo chain` with the options `arguments`. Returns the process, and the address (host and port) of its web
/// page.
fn started(arguments: &str) -> (Running, String) {
    let child = Command::new(env!("CARGO_BIN_EXE_chain"))
        .args(arguments.split(' '))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut running = Running(child.unwrap());
    let mut line = String::new();
    let mut errors = BufReader::new(running.0.stderr.take().unwrap());
    errors.read_line(&mut line).unwrap();
    let address = line.strip_prefix("open http://").unwrap();
    let (address, rest) = address.split_once('/').unwrap();
    assert_eq!(rest, " in a browser; Ctrl-C ends the run\n");
    (running, address.to_owned())
}

#[test]
fn a_flight_goes_on_after_the_drones_hover_until_it_is_ended() {
    let (mut running, address) =
        started("--fly --uavs 3 --kill 2@30 --web 127.0.0.1:0 --speed 100");
    let mut stream = TcpStream::connect(&address).unwrap();
    write!(stream, "GET /events HTTP/1.1\r\nHost: {address}\r\n\r\n").unwrap();
    let mut lines = BufReader::new(stream).lines().map(Result::unwrap);
    let mut snapshot = |from_s: f64| loop {
        let line = lines.next().unwrap();
        let Some(text) = line.strip_prefix("data: {") else {
            continue;
        };
        let json: serde_json::Value = serde_json::from_str(&format!("{{{text}")).unwrap();
        if json["time_s"].as_f64() >= Some(from_s) {
            return json;
        }
    };
    let first = snapshot(0.0);
    assert_eq!(first["relays"].as_array().unwrap().len(), 3);
    assert_eq!(
        first["frame"]["azimuth_deg"].as_f64().unwrap().round(),
        90.0
    );
    // This time is much later than the end of the same run without a screen.
    let last = snapshot(300.0);
    let mut alarms = last["alarms"].as_array().unwrap().iter();
    assert!(alarms.any(|alarm| alarm["text"] == "relay 2 lost: reported by relays 1 and 3"));
    let lost = &last["relays"][1];
    assert_eq!(lost["condition"], "lost");
    assert!(lost["age_s"].as_f64() > Some(200.0), "{lost}");
    assert_eq!(running.0.try_wait().unwrap(), None, "it runs until Ctrl-C");
}

#[test]
fn a_soak_ends_the_flight_with_its_report() {
    let (mut running, _) = started("--fly --uavs 2 --soak 60 --web 127.0.0.1:0 --speed 100");
    let mut report = String::new();
    let mut output = running.0.stdout.take().unwrap();
    output.read_to_string(&mut report).unwrap();
    assert!(running.0.wait().unwrap().success());
    assert!(report.contains("availability"), "{report}");
}
