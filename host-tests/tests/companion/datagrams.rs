//! Restarts of the companion with an autopilot over UDP that answers only the first peer address.

use std::net::UdpSocket;

use crate::files::Files;
use crate::peer::{Peer, ReceivedMessage, relay};
use crate::process::Relay;

/// Free UDP ports of this computer for an autopilot (`port`) and its companion (`local`).
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ports {
    pub(crate) port: u16,
    /// UDP port on which the companion program receives.
    pub(crate) local: u16,
}

impl Ports {
    /// Returns a free pair of UDP ports of PX4's simulation.
    ///
    /// Simulated drone i has the ports 14580 + i (autopilot) and 14540 + i (companion).
    fn of_px4() -> Self {
        let first = std::process::id() as u16;
        let pairs = (0..10).map(|i| (first.wrapping_add(i)) % 10);
        let mut pairs = pairs.map(|i| Self {
            port: 14_580 + i,
            local: 14_540 + i,
        });
        pairs
            .find(|pair| pair.are_free())
            .expect("one of ten pairs is free")
    }

    /// Returns a pair of free ports. The companion's port number is `apart` above the autopilot's port number.
    pub(crate) fn apart(apart: u16) -> Self {
        let mut pairs = (0..100).filter_map(|_| {
            let port = UdpSocket::bind("127.0.0.1:0").unwrap();
            let port = port.local_addr().unwrap().port();
            Some(Self {
                port,
                local: port.checked_add(apart)?,
            })
        });
        pairs
            .find(|pair| pair.are_free())
            .expect("one of a hundred pairs is free")
    }

    fn are_free(self) -> bool {
        let bound = [self.port, self.local].map(|port| UdpSocket::bind(("0.0.0.0", port)));
        bound.iter().all(Result::is_ok)
    }

    /// Starts a drone on the ground whose autopilot uses the autopilot's port of this pair.
    ///
    /// The drone sends to the UDP port `partner` until it receives a datagram.
    pub(crate) fn drone(self, partner: u16) -> Peer {
        Peer::autopilot("px4", &format!("udp:{}@{partner}", self.port), 380.0, None)
    }
}

/// Checks that the companion and its autopilot receive each other's messages.
fn check_both_receive(relay: &mut Relay, drone: &mut Peer) {
    relay.line("autopilot: found a PX4");
    relay.line("autopilot: on the ground, or not armed");
    drone.forget();
    drone.receive(|heard| heard.is("HEARTBEAT") && heard.0["from"] == serde_json::json!([7, 191]));
}

/// Checks that an autopilot answers a companion that restarts, first after a kill, then after an exit.
fn check_received_after_restarts(address: &str, ports: Ports) {
    let mut drone = ports.drone(ports.local);
    let mut first = relay(address, "");
    check_both_receive(&mut first, &mut drone);
    // Dropping kills it with SIGKILL.
    drop(first);
    let mut second = relay(address, "");
    check_both_receive(&mut second, &mut drone);
    second.stopped();
    let mut third = relay(address, "");
    check_both_receive(&mut third, &mut drone);
    let heard = drone.receive(ReceivedMessage::is_any);
    assert_eq!(heard.partner(), Some(ports.local), "{address}");
}

#[test]
fn a_restarted_companion_is_received_at_the_ports_of_px4() {
    let ports = Ports::of_px4();
    check_received_after_restarts(&format!("udp:127.0.0.1:{}", ports.port), ports);
}

#[test]
fn a_restarted_companion_is_received_at_any_other_port() {
    let ports = Ports::apart(1_000);
    check_received_after_restarts(&format!("udp:127.0.0.1:{}", ports.port), ports);
}

#[test]
fn a_restarted_companion_is_received_at_its_local_port() {
    let ports = Ports::apart(7);
    let address = format!("udp:localhost:{}@{}", ports.port, ports.local);
    check_received_after_restarts(&address, ports);
}

/// Checks that a companion that restarts in the air finds the autopilot and its flight state.
#[test]
fn a_companion_restarted_in_the_air_is_received() {
    let ports = Ports::apart(1_000);
    let address = format!("udp:127.0.0.1:{}", ports.port);
    let mut drone = ports.drone(ports.local);
    let mut first = relay(&address, "");
    check_both_receive(&mut first, &mut drone);
    drone.takes_off();
    first.line("autopilot: in the air");
    drop(first);
    let mut second = relay(&address, "");
    second.line("autopilot: found a PX4");
    second.line("autopilot: in the air");
}

/// Checks that the companion survives a closed autopilot port, at which its datagrams are refused.
#[test]
fn an_autopilot_that_restarts_is_found_again() {
    let ports = Ports::apart(1_000);
    // The drone does not send before it receives a datagram.
    let mut drone = ports.drone(9);
    let mut relay = relay(&format!("udp:127.0.0.1:{}", ports.port), "");
    check_both_receive(&mut relay, &mut drone);
    for _ in 0..2 {
        drone.order("unplug");
        relay.line("autopilot: no heartbeat");
        drone.order("reboot");
        drone.forget();
        drone.order("plug");
        relay.line("autopilot: on the ground, or not armed");
        let heard = drone.receive(ReceivedMessage::is_any);
        assert_eq!(heard.partner(), Some(ports.local));
    }
    relay.stopped();
}

/// Checks that the error line names the occupied local port and the option to choose another port.
#[test]
fn an_unavailable_local_port_is_named() {
    let ports = Ports::apart(1_000);
    let Ports { port, local } = ports;
    let taken = UdpSocket::bind(("0.0.0.0", local)).unwrap();
    let whole = format!("udp:127.0.0.1:{port}@{local}");
    let short = format!("udp:127.0.0.1:{port}");
    let own = format!("udp:127.0.0.1:{port}@{port}");
    let in_use = format!("local port {local} is in use by another program");
    for (address, parts) in [
        (&whole, [&*in_use, "udp:HOST:PORT@LOCAL, within 1 to 65535"]),
        (&short, [&*in_use, "udp:HOST:PORT@LOCAL, within 1 to 65535"]),
        (
            &own,
            [
                "is this program's own address and port",
                "LOCAL within 1 to 65535 that differs from PORT",
            ],
        ),
    ] {
        let line = relay(address, "").refused(1);
        let begin = format!("--autopilot {address}: ");
        assert!(line.starts_with(&begin), "{line}");
        for part in parts {
            assert!(line.contains(part), "{part} not in {line}");
        }
    }
    drop(taken);
}

#[test]
fn the_file_states_a_local_port() {
    let ports = Ports::apart(11);
    let drone = ports.drone(9);
    let text = include_str!("../../../examples/drone.toml");
    let autopilot = format!(
        "autopilot = \"udp:127.0.0.1:{}@{}\"\n",
        ports.port, ports.local
    );
    let others = "autopilot epoch_file upload_file view_file key_file shared";
    let kept = |line: &&str| !others.split(' ').any(|key| line.starts_with(key));
    let mut lines: Vec<&str> = text.lines().filter(kept).collect();
    let at = lines.iter().position(|line| *line == "[companion]");
    lines.insert(at.unwrap() + 1, &autopilot);
    let files = Files::new();
    let file = files.write("drone.toml", lines.join("\n"));
    let mut relay = Relay::start(&format!("--config {file} --index 1 --of 1"));
    relay.line("autopilot: found a PX4");
    let heard = drone.receive(ReceivedMessage::is_any);
    assert_eq!(heard.partner(), Some(ports.local));
}
