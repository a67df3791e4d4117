//! Clearing of a silent relay by an operator.

use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::chain::{Chain, QUICK};
use crate::files::{Files, answer, status_of, write};
use crate::medium::{Medium, QUIET};
use crate::peer::Peer;
use crate::process::{LIMIT, Relay, bits};

/// Sends a command to the status socket of a process. Returns true if it was executed, and the text of the answer.
pub(crate) fn commanded(socket: impl AsRef<Path>, command: &str) -> (bool, String) {
    let said: Value = serde_json::from_str(&answer(socket, command, false)).unwrap();
    let text = said["text"].as_str().unwrap();
    (said["done"].as_bool().unwrap(), text.to_owned())
}

/// Three drones 20 m apart; relays 1 and 2 follow their setpoints, relay 3 does not move.
struct Drones {
    chain: Chain,
    fifos: [String; 3],
    at: [[f32; 3]; 3],
    /// Log lines that each relay has printed so far.
    lines: [Vec<String>; 3],
}

impl Drones {
    fn start() -> Self {
        let mut chain = Chain::on_channel(3, Medium::new(3, QUIET));
        let fifos = [1, 2, 3].map(|index| chain.files.fifo(&format!("positions{index}")));
        for (index, fifo) in (1..).zip(&fifos) {
            let socket = chain.files.text(&format!("status{index}"));
            let own = format!("{QUICK} --positions {fifo} --status-socket {socket}");
            let relay = chain.relay(index, &own);
            chain.relays.push(relay);
        }
        Self {
            chain,
            fifos,
            at: [10.0, 30.0, 50.0].map(|x_m| [x_m, 0.0, 20.0]),
            lines: Default::default(),
        }
    }

    fn has_logged(&self, index: usize, part: &str) -> bool {
        self.lines[index - 1].iter().any(|line| line.contains(part))
    }

    /// Moves drones 1 and 2 to their setpoints until `is_so` returns true.
    fn fly_until(&mut self, is_so: impl Fn(&Self) -> bool) {
        let end = Instant::now() + LIMIT;
        while !is_so(self) {
            assert!(Instant::now() < end, "{:?}: {:#?}", self.at, self.lines);
            for (k, relay) in self.chain.relays.iter_mut().enumerate() {
                let [x, y, h] = self.at[k];
                write(&self.fifos[k], &format!("{x} {y} {h}\n"));
                let lines = relay.lines_with("");
                let setpoint = lines.iter().rfind(|line| line.contains("setpoint: "));
                if let Some(line) = setpoint.filter(|_| k < 2) {
                    let to = bits(line).into_iter().map(f32::from_bits);
                    self.at[k] = to.collect::<Vec<_>>().try_into().unwrap();
                }
                self.lines[k].extend(lines);
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

#[test]
fn an_operator_clears_a_silent_relay_and_the_others_fly_on() {
    let mut drones = Drones::start();
    drones.fly_until(|all| (1..=3).all(|index| all.has_logged(index, "converged: ")));
    drop(drones.chain.relays.pop());
    drones.fly_until(|all| all.has_logged(2, "a lost relay may still hover between"));
    let socket = drones.chain.files.path("status2");
    assert_eq!(status_of(&socket)["relay"]["lost"], json!([3]));
    for (command, why) in [
        (
            "land",
            "unknown command `land`: allowed are `leave`, `stay` and `clear-lost N",
        ),
        ("clear-lost", "clear-lost names no relay"),
        ("clear-lost 2", "relay 2 is this relay"),
        ("clear-lost 1", "relay 1 is not lost"),
        (
            "clear-lost 4",
            "relay 4: the number of a relay must be within 1 to 3",
        ),
        (
            "clear-lost x",
            "relay x: the number of a relay must be within 1 to 3",
        ),
    ] {
        let (is_done, text) = commanded(&socket, &format!("{command}\n"));
        assert!(!is_done && text.starts_with(why), "{command}: {text}");
    }
    // Relay 2 stays 4 m clear of the silent relay.
    let still = Instant::now();
    drones.fly_until(|_| still.elapsed() > Duration::from_secs(2));
    assert!(drones.at[1][0] <= 46.0, "{:?}", drones.at);
    let said = "relay 3 is cleared: the operator reported that it has landed, so this relay no longer keeps clear of lost relays downstream (toward Rx)";
    assert_eq!(
        commanded(&socket, "clear-lost 3\n"),
        (true, said.to_owned())
    );
    let uid = rustix::process::getuid().as_raw();
    let process = std::process::id();
    let line = format!(
        "relay 2  cleared: {said} (command `clear-lost 3` from user {uid}, process {process})"
    );
    drones.fly_until(|all| all.has_logged(2, &line));
    drones.fly_until(|all| all.at[1][0] > 60.0);
    assert_eq!(status_of(&socket)["relay"]["lost"], json!([]));
}

/// Checks that a client that sends nothing, or half a command, is answered at once.
#[test]
fn an_incomplete_command_is_answered() {
    let files = Files::new();
    let socket = files.text("status");
    let mut relay = Relay::start(&format!("--index 1 --of 1 --status-socket {socket}"));
    relay.line("converged: ");
    let (is_done, text) = commanded(&socket, "clear-lo");
    assert!(!is_done, "{text}");
    relay.line("command refused: unknown command `clear-lo`: allowed are `leave`, `stay` and `clear-lost N");
    assert_eq!(status_of(&socket)["relay"]["index"], 1);
    let text = answer(&socket, "", false);
    assert!(text.contains("\"has_lease\""), "the state: {text}");
}

/// Checks that a relay forgets a lost neighbour on a MAVLink command that its autopilot forwards.
///
/// An operator sends that command with a ground station because the neighbour's drone is gone.
#[test]
fn an_operator_clears_a_relay_by_a_mavlink_command() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let (link, socket) = (chain.files.text("tty"), chain.files.text("status"));
    let mut drone = Peer::autopilot("px4", &link, 300.0, None);
    let distance = crate::peer::distance_to_m(crate::peer::RX);
    let second = chain.relay(2, &format!("--distance {distance} {QUICK}"));
    let own = crate::peer::options(&link);
    let mut relay = chain.relay(1, &format!("{own} --status-socket {socket} {QUICK}"));
    relay.wait_for("converged: ");
    relay.wait_for("autopilot: on the ground");
    drop(second);
    relay.line("lost: ");
    assert_eq!(status_of(&socket)["relay"]["lost"], json!([2]));
    let answer = |drone: &Peer, result: u64| {
        let ack = drone.receive(|heard| heard.is("COMMAND_ACK") && heard.0["result"] == result);
        assert_eq!(ack.0["command"], 31_010);
        let to = [&ack.0["target_system"], &ack.0["target_component"]];
        assert_eq!(to, [255, 190]);
        assert_eq!(ack.0["from"], json!([7, 191]));
    };
    drone.order("clear 1");
    answer(&drone, 2);
    relay.line(
        "command refused: the command must name all lost relays on one side of this relay (toward Tx or toward Rx), and no other relay (command `MAV_CMD_USER_1 1` from MAVLink system 255, component 190)",
    );
    drone.order("clear 2");
    answer(&drone, 0);
    relay.line(
        "cleared: relay 2 is cleared: the operator reported that it has landed, so this relay no longer keeps clear of lost relays downstream (toward Rx) (command `MAV_CMD_USER_1 2` from MAVLink system 255, component 190)",
    );
    assert_eq!(status_of(&socket)["relay"]["lost"], json!([]));
}
