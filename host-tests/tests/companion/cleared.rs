//! Clearing of a silent relay by an operator.

use std::io::{Read as _, Write as _};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::medium::{Medium, QUIET};
use crate::positions::{fifo, write};
use crate::process::{LIMIT, Relay, bits};
use crate::stays::asked;

/// Sends a command to the socket. Returns true if it was executed, with the text of the answer.
fn commanded(socket: &Path, command: &str) -> (bool, String) {
    let mut stream = UnixStream::connect(socket).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    writeln!(stream, "{command}").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let said: Value = serde_json::from_str(&text).unwrap();
    let text = said["text"].as_str().unwrap();
    (said["done"].as_bool().unwrap(), text.to_owned())
}

/// Three drones 20 m apart; relays 1 and 2 follow their setpoints, relay 3 does not move.
struct Drones {
    folder: tempfile::TempDir,
    relays: Vec<Relay>,
    fifos: Vec<PathBuf>,
    at: Vec<[f32; 3]>,
    /// Log lines of each relay.
    said: Vec<Vec<String>>,
}

impl Drones {
    fn start(channel: &Medium) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let fifos: Vec<PathBuf> = (1..=3)
            .map(|index| fifo(folder.path(), &format!("positions{index}")))
            .collect();
        let start = |index: usize| {
            let (number, tty) = (index.to_string(), channel.tty(index - 1));
            let socket = folder.path().join(format!("status{index}"));
            let files = [fifos[index - 1].to_str().unwrap(), socket.to_str().unwrap()];
            let options = ["--index", &number, "--of", "3", "--shared", tty];
            let quick = ["--probe-after-ms", "500", "--dead-after-ms", "1500"];
            let files = ["--positions", files[0], "--status-socket", files[1]];
            Relay::start(&[&options[..], &quick, &files].concat())
        };
        Self {
            relays: (1..=3).map(start).collect(),
            fifos,
            at: [10.0, 30.0, 50.0].map(|x_m| [x_m, 0.0, 20.0]).to_vec(),
            said: vec![Vec::new(); 3],
            folder,
        }
    }

    fn socket(&self, index: usize) -> PathBuf {
        self.folder.path().join(format!("status{index}"))
    }

    fn has_said(&self, index: usize, part: &str) -> bool {
        self.said[index - 1].iter().any(|line| line.contains(part))
    }

    /// Flies until the condition holds.
    fn fly_until(&mut self, is_so: impl Fn(&Self) -> bool) {
        let end = Instant::now() + LIMIT;
        while !is_so(self) {
            assert!(Instant::now() < end, "{:?}: {:#?}", self.at, self.said);
            for (k, relay) in self.relays.iter_mut().enumerate() {
                let [x, y, h] = self.at[k];
                write(&self.fifos[k], &format!("{x} {y} {h}\n"));
                let lines = relay.lines_with("");
                let setpoint = lines.iter().rfind(|line| line.contains("setpoint: "));
                if let Some(line) = setpoint.filter(|_| k < 2) {
                    let to = bits(line).into_iter().map(f32::from_bits);
                    self.at[k] = to.collect::<Vec<_>>().try_into().unwrap();
                }
                self.said[k].extend(lines);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn an_operator_clears_a_relay_that_fell_silent_and_the_others_fly_on() {
    let channel = Medium::new(3, QUIET);
    let mut drones = Drones::start(&channel);
    drones.fly_until(|all| (1..=3).all(|index| all.has_said(index, "converged: ")));
    drop(drones.relays.pop());
    drones.fly_until(|all| all.has_said(2, "a lost relay may still hover between"));
    let socket = drones.socket(2);
    assert_eq!(asked(&socket)["relay"]["lost"], serde_json::json!([3]));
    for (command, why) in [
        ("land", "unknown command; the command is clear-lost N"),
        ("clear-lost", "name the relays that have landed"),
        ("clear-lost 2", "relay 2 is this relay"),
        ("clear-lost 1", "relay 1 is received and not lost"),
        ("clear-lost 4", "relay 4: must be within 1 to 3"),
        ("clear-lost x", "relay x: must be within 1 to 3"),
    ] {
        let (is_done, text) = commanded(&socket, command);
        assert!(!is_done && text.starts_with(why), "{command}: {text}");
    }
    // Relay 2 stays 4 m clear of the silent relay.
    let still = Instant::now();
    drones.fly_until(|_| still.elapsed() > Duration::from_secs(2));
    assert!(drones.at[1][0] <= 46.0, "{:?}", drones.at);
    let said = "relay 3 is cleared: no lost relay downstream limits this relay any more";
    assert_eq!(commanded(&socket, "clear-lost 3"), (true, said.to_owned()));
    let uid = rustix::process::getuid().as_raw();
    let process = std::process::id();
    let line =
        format!("relay 2  cleared: {said} (`clear-lost 3` by user {uid}, process {process})");
    drones.fly_until(|all| all.has_said(2, &line));
    drones.fly_until(|all| all.at[1][0] > 60.0);
    assert_eq!(asked(&socket)["relay"]["lost"], serde_json::json!([]));
}

/// Checks clients that send nothing, like `nc -U`, or half a command: they are answered at once.
#[test]
fn a_client_that_sends_a_part_of_a_command_is_answered() {
    let folder = tempfile::tempdir().unwrap();
    let socket = folder.path().join("status");
    let options = ["--index", "1", "--of", "1", "--status-socket"];
    let mut relay = Relay::start(&[&options[..], &[socket.to_str().unwrap()]].concat());
    relay.line("converged: ");
    let mut stream = UnixStream::connect(&socket).unwrap();
    stream.set_read_timeout(Some(LIMIT)).unwrap();
    write!(stream, "clear-lo").unwrap();
    let mut text = String::new();
    stream.read_to_string(&mut text).unwrap();
    let said: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(said["done"], false, "{text}");
    relay.line("command refused: unknown command; the command is clear-lost N");
    assert_eq!(asked(&socket)["relay"]["index"], 1);
    let mut silent = UnixStream::connect(&socket).unwrap();
    silent.set_read_timeout(Some(LIMIT)).unwrap();
    let mut text = String::new();
    silent.read_to_string(&mut text).unwrap();
    assert!(text.contains("\"has_lease\""), "the state: {text}");
}

/// Checks clearing through the neighbour's autopilot, as a ground station does it.
#[test]
fn an_operator_clears_a_relay_by_a_mavlink_command() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (link, socket) = (path("tty"), path("status"));
    let at = crate::peer::on_earth(300.0, 0.0).map(|number| number.to_string());
    let [lat, lon, amsl] = &at;
    let mut drone = crate::peer::Peer::start("autopilot.py", &["px4", &link, lat, lon, amsl]);
    let channel = Medium::new(2, QUIET);
    let distance = crate::peer::distance_m().to_string();
    let quick = ["--probe-after-ms", "500", "--dead-after-ms", "1500"];
    let second = ["--index", "2", "--of", "2", "--distance", &distance];
    let second = [&second[..], &["--shared", channel.tty(1)], &quick].concat();
    let second = Relay::start(&second);
    let options = crate::peer::options(&link);
    let mut first: Vec<&str> = options.iter().map(String::as_str).collect();
    first[3] = "2";
    first.extend(["--shared", channel.tty(0), "--status-socket", &socket]);
    first.extend(quick);
    let mut relay = Relay::start(&first);
    relay.line("converged: ");
    relay.line("autopilot: on the ground");
    drop(second);
    relay.line("lost: ");
    assert_eq!(
        asked(Path::new(&socket))["relay"]["lost"],
        serde_json::json!([2])
    );
    let answer = |drone: &crate::peer::Peer, result: u64| {
        let ack = drone.hears(|heard| heard.is("COMMAND_ACK") && heard.0["result"] == result);
        assert_eq!(ack.0["command"], 31_010);
        let to = [&ack.0["target_system"], &ack.0["target_component"]];
        assert_eq!(to, [255, 190]);
        assert_eq!(ack.0["from"], serde_json::json!([7, 191]));
    };
    drone.order("clear 1");
    answer(&drone, 2);
    relay.line(
        "command refused: the command has to name all lost relays of one side, and no others (`MAV_CMD_USER_1 1` by MAVLink system 255, component 190)",
    );
    drone.order("clear 2");
    answer(&drone, 0);
    relay.line(
        "cleared: relay 2 is cleared: no lost relay downstream limits this relay any more (`MAV_CMD_USER_1 2` by MAVLink system 255, component 190)",
    );
    assert_eq!(
        asked(Path::new(&socket))["relay"]["lost"],
        serde_json::json!([])
    );
}
