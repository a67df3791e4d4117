//! Drone whose battery falls: its relay asks to leave, and the drone flies beside the line and home.

use std::time::Duration;

use serde_json::Value;

use crate::chain::{Chain, QUICK};
use crate::files::{status_of, until, write};
use crate::medium::{Medium, QUIET};
use crate::peer::{self, Peer, ReceivedMessage, apart_m};
use crate::process::Relay;

/// Chain of two relays on a channel: relay 1 hovers by hand, relay 2 has an autopilot.
struct Pair {
    chain: Chain,
    drone: Peer,
    /// Relay 2.
    relay: Relay,
    first: Relay,
    fifo: String,
}

impl Pair {
    /// Starts both relays, relay 2 with `more` options, and waits until it controls its drone.
    fn engaged(kind: &str, more: &str) -> Self {
        let chain = Chain::on_channel(2, Medium::new(2, QUIET));
        let fifo = chain.files.fifo("positions");
        let link = chain.files.text("autopilot");
        let mut drone = Peer::autopilot(kind, &link, 700.0, None);
        let socket = chain.files.text("status");
        let options = peer::options(&link);
        let places = options.split("--autopilot").next().unwrap();
        let first = chain.relay(1, &format!("{QUICK} {places} --positions {fifo}"));
        let own = format!("{QUICK} {options} --reserve 20 --status-socket {socket} {more}");
        let mut relay = chain.relay(2, &own);
        relay.line("autopilot: found a");
        drone.takes_off();
        relay.line("autopilot: in the air, and not controlled by the relay");
        let mut pair = Self {
            chain,
            drone,
            relay,
            first,
            fifo,
        };
        pair.hover();
        pair.relay.line("autopilot: ready");
        if kind == "px4" {
            pair.drone.receive(ReceivedMessage::is_target);
        }
        pair.drone.order("mode companion");
        pair.relay.line("autopilot: setpoint control engaged");
        pair.wait(|said| said["relay"]["setpoint"].is_object() && said["relay"]["relays"] == 2);
        pair
    }

    /// Reports that drone 1 hovers upstream.
    fn hover(&self) {
        write(&self.fifo, "300 0 20\n");
    }

    /// Reports drone 1's position until the status of relay 2 is as `wanted`.
    fn wait(&self, wanted: impl Fn(&Value) -> bool) {
        until(self.chain.files.path("status"), |said| {
            self.hover();
            wanted(said)
        });
    }
}

fn is_return(heard: &ReceivedMessage) -> bool {
    heard.is("COMMAND_LONG") && heard.0["command"] == 20
}

/// Checks a drone whose battery falls. Without `--return rtl` no mode is commanded; with it, once the drone is beside the line.
#[test]
fn a_low_battery_leads_a_drone_out_of_the_chain() {
    for (kind, more, returns) in [
        ("px4", "", false),
        ("arducopter", "--exit 30", false),
        ("px4", "--exit -30 --return rtl", true),
        ("arducopter", "--return rtl", true),
    ] {
        let mut pair = Pair::engaged(kind, more);
        pair.drone.order("battery 80 900");
        pair.wait(|said| {
            said["battery"]["endurance_s"]
                .as_u64()
                .is_some_and(|left| left > 700)
        });
        let said = status_of(pair.chain.files.path("status"));
        assert_eq!(said["battery"]["departure"], "member", "{said:#}");
        // 20 s of reserve, 18 s of the replacement, and the way home.
        let limit_s = said["battery"]["leaves_below_s"].as_u64().unwrap();
        assert!((38..120).contains(&limit_s), "{limit_s}");
        pair.drone.forget();
        pair.drone.order("battery 5 40");
        let line = pair.relay.line("departure: ");
        assert!(line.contains("this relay asks to leave"), "{line}");
        pair.drone
            .receive(|heard| heard.is_text("battery: low, asks to leave the chain"));
        pair.wait(|said| said["battery"]["departure"] == "free");
        pair.relay.line("may leave: ");
        let before = pair
            .drone
            .receive(|heard| heard.is_text("battery: leave now"));
        // Without a place beside the line the command to return may have come first.
        let is_held = !returns || more.contains("--exit");
        assert!(before.mode() == "companion" || !is_held);
        let start = before.own();
        if more.contains("--exit") {
            pair.relay
                .line("exit: flies to its place beside the line: x ");
            pair.drone.receive(|heard| {
                heard.is_any() && (27.0..33.0).contains(&apart_m(heard.own(), start))
            });
        }
        if returns {
            pair.relay
                .line("return: commands the autopilot to return (RTL)");
            let told = pair.drone.receive(is_return);
            let away_m = apart_m(told.own(), start);
            assert_eq!(away_m > 27.0, more.contains("--exit"), "{away_m} m");
            pair.relay.line("autopilot: released: ");
            let heard = pair.drone.receive_for(Duration::from_secs(5));
            assert!(!heard.iter().any(is_return), "its own mode is left alone");
            assert_eq!(heard.last().unwrap().mode(), "rtl");
        } else {
            let heard = pair.drone.receive_for(Duration::from_secs(5));
            assert!(!heard.iter().any(is_return));
            assert_eq!(heard.last().unwrap().mode(), "companion");
        }
        drop(pair.first);
    }
}

/// Checks the lines of `--positions`: an endurance, an invalid one, and the options that are refused.
#[test]
fn endurance_is_read_from_the_positions() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let (fifo, socket) = (chain.files.fifo("positions"), chain.files.text("status"));
    let own = format!("{QUICK} --positions {fifo} --status-socket {socket} --json");
    let mut relay = chain.relay(2, &own);
    let status = || status_of(chain.files.path("status"));
    relay.line("\"event\":\"guarded\"");
    write(&fifo, "700 0 20\nendurance 640\n");
    until(chain.files.path("status"), |said| {
        said["battery"]["endurance_s"].is_u64()
    });
    // 180 s of reserve, and 18 s of the replacement.
    assert_eq!(status()["battery"]["leaves_below_s"], 198);
    write(&fifo, "700 100 20\nendurance 640\n");
    until(chain.files.path("status"), |said| {
        said["battery"]["leaves_below_s"] == 218
    });
    write(&fifo, "endurance soon\n");
    relay.line("\"event\":\"endurance unknown\"");
    let said = status();
    assert_eq!(said["battery"]["endurance_s"], Value::Null);
    assert_eq!(said["relay"]["counters"]["endurance_unknown"], 1);
    assert_eq!(said["battery"]["departure"], "member");
    write(&fifo, "endurance 30\n");
    let line = relay.line("\"event\":\"departure\"");
    assert!(line.contains("\"leaves_below_s\":218"), "{line}");
}

#[test]
fn a_spare_waits_outside_of_the_chain() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let socket = chain.files.text("status");
    let mut relay = chain.relay(2, &format!("{QUICK} --spare --status-socket {socket}"));
    relay.line("departure: this relay waits outside of the chain as a spare");
    assert_eq!(status_of(&socket)["battery"]["departure"], "spare");
    let refused = chain.arguments(1, "--spare");
    let line = Relay::start(&refused).refused_at_once(2);
    assert!(
        line.contains("--spare: relay 1 is the first leader"),
        "{line}"
    );
}
