//! Drone whose battery falls: its relay asks to leave the chain, and its pilot flies it home.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::chain::{Chain, QUICK};
use crate::cleared::commanded;
use crate::files::{status_of, until, write};
use crate::medium::{Medium, QUIET};
use crate::peer::{self, Peer, ReceivedMessage};
use crate::process::Relay;

/// Relay options with long timeouts, so that relays on a busy computer do not lose each other.
const PATIENT: &str = "--probe-after-ms 1000 --dead-after-ms 5000";

/// Chain on a shared channel. One relay has an autopilot; the other drones hover, flown by their pilots.
struct Pair {
    chain: Chain,
    drone: Peer,
    /// Relay with the autopilot; `None` while it is restarted.
    relay: Option<Relay>,
    index: usize,
    own: String,
    _others: Vec<Relay>,
    /// Thread that reports the positions of the other drones until the flag is true.
    ///
    /// The motion guards of these drones need the positions.
    hover: (Arc<AtomicBool>, Option<JoinHandle<()>>),
}

impl Drop for Pair {
    fn drop(&mut self) {
        self.hover.0.store(true, Ordering::Relaxed);
        self.hover.1.take().map(JoinHandle::join);
    }
}

impl Pair {
    /// Starts all relays of a chain of `of` relays.
    ///
    /// The drone of relay `index` is on the ground; `battery` is the command that sets this drone's battery.
    fn grounded([index, of]: [usize; 2], kind: &str, more: &str, battery: &str) -> Self {
        let chain = Chain::on_channel(of, Medium::new(of, QUIET));
        let link = chain.files.text("autopilot");
        let mut drone = Peer::autopilot(kind, &link, 700.0, None);
        drone.order(battery);
        let socket = chain.files.text("status");
        let options = peer::options(&link);
        let places = options.split("--autopilot").next().unwrap();
        let mut others = Vec::new();
        let mut hovering = Vec::new();
        for other in (1..=of).filter(|other| *other != index) {
            let fifo = chain.files.fifo(&format!("positions-{other}"));
            let own = format!("{PATIENT} {places} --positions {fifo}");
            others.push(chain.relay(other, &own));
            let x_m = if other < index {
                300
            } else {
                700 + 150 * (other - index)
            };
            hovering.push((fifo, format!("{x_m} 0 20\n")));
        }
        let own = format!("{PATIENT} {options} --reserve 30 --status-socket {socket} {more}");
        let relay = chain.relay(index, &own);
        let over = Arc::new(AtomicBool::new(false));
        let is_over = Arc::clone(&over);
        let thread = std::thread::spawn(move || {
            while !is_over.load(Ordering::Relaxed) {
                for (fifo, line) in &hovering {
                    write(fifo, line);
                }
                std::thread::sleep(Duration::from_millis(200));
            }
        });
        let mut pair = Self {
            chain,
            drone,
            relay: Some(relay),
            index,
            own,
            _others: others,
            hover: (over, Some(thread)),
        };
        pair.line("autopilot: found a");
        pair
    }

    /// Stops the relay's companion program, calls `between`, and starts the program again.
    fn restart(&mut self, between: impl FnOnce(&mut Peer)) {
        drop(self.relay.take());
        between(&mut self.drone);
        self.relay = Some(self.chain.relay(self.index, &self.own));
    }

    /// Checks that the relay has left the chain, and does not rejoin it within 12 s.
    fn stays_outside(&mut self) {
        let line = self.line("departure: ");
        // The others may have said at once that they do not need it.
        let is_outside = [
            "this relay is outside of the chain",
            "this drone has permission to leave",
        ];
        assert!(is_outside.iter().any(|it| line.contains(it)), "{line}");
        std::thread::sleep(Duration::from_secs(12));
        let said = self.status();
        let departure = said["departure"].as_str().unwrap();
        assert!(["outside", "free"].contains(&departure), "{said:#}");
        assert!(!self.relay.as_mut().unwrap().has_printed("converged: "));
    }

    /// Takes off and starts setpoint control. Waits until the relay has a setpoint.
    fn engage(&mut self, kind: &str) {
        self.drone.takes_off();
        self.line("autopilot: in the air, and not controlled by the relay");
        self.line("autopilot: ready");
        if kind == "px4" {
            self.drone.receive(ReceivedMessage::is_target);
        }
        self.drone.order("mode companion");
        self.line("autopilot: setpoint control engaged");
        until(self.chain.files.path("status"), |said| {
            said["relay"]["setpoint"].is_object() && said["relay"]["relays"] == 2
        });
    }

    fn line(&mut self, part: &str) -> String {
        self.relay.as_mut().unwrap().line(part)
    }

    fn status(&self) -> serde_json::Value {
        status_of(self.chain.files.path("status"))["battery"].clone()
    }

    fn wait(&self, wanted: impl Fn(&serde_json::Value) -> bool) {
        until(self.chain.files.path("status"), |said| {
            wanted(&said["battery"])
        });
    }
}

/// Returns true for a command other than a request for a message, such as one to change the mode.
fn is_command(heard: &ReceivedMessage) -> bool {
    heard.is("COMMAND_LONG") && heard.0["command"] != 511 || heard.is("SET_MODE")
}

/// Checks that a relay with a low battery leaves the chain in flight, but not on the ground.
///
/// The relay restarts while the pilot flies the drone home. The restarted relay must not join the chain.
fn a_low_battery_leads_it_out_of_the_chain(kind: &str, more: &str, [full, low]: [&str; 2]) {
    let mut pair = Pair::grounded([2, 2], kind, more, low);
    // A member requests to leave after 15 s.
    std::thread::sleep(Duration::from_secs(18));
    let said = pair.status();
    assert_eq!(said["departure"], "member", "{said:#}");
    assert!(said["endurance_s"].is_null(), "{said:#}");
    pair.drone.order(full);
    pair.engage(kind);
    pair.wait(|said| said["endurance_s"].as_u64().is_some_and(|left| left > 700));
    let said = pair.status();
    assert_eq!(said["departure"], "member", "{said:#}");
    // 30 s of reserve, 60 s of the replacement, and the way home.
    let limit_s = said["leaves_below_s"].as_u64().unwrap();
    assert!((90..200).contains(&limit_s), "{limit_s}");
    pair.drone.forget();
    pair.drone.order(low);
    let line = pair.line("departure: ");
    assert!(line.contains("this relay asks to leave"), "{line}");
    pair.drone
        .receive(|heard| heard.is_text("battery: low, asks others to fill its place"));
    pair.wait(|said| said["departure"] == "free");
    pair.line("may leave: ");
    pair.drone
        .receive(|heard| heard.is_text("battery: low, has permission to leave"));
    for _ in 0..3 {
        let all = pair
            .drone
            .receive_until(|heard| heard.is_text("battery: leave now"));
        assert!(!all.iter().any(is_command), "{all:#?}");
    }
    pair.drone.order("mode pilot");
    pair.line("autopilot: setpoint control released: ");
    pair.drone.receive_for(Duration::from_secs(1));
    let heard = pair.drone.receive_for(Duration::from_secs(7));
    assert!(!heard.iter().any(|it| it.is_text("battery: leave now")));
    // The companion restarts while the pilot flies the drone home.
    pair.restart(|_| {});
    pair.stays_outside();
}

#[test]
fn a_low_battery_leads_a_px4_out_of_the_chain() {
    let batteries = ["battery 80 1200", "battery 5 60"];
    a_low_battery_leads_it_out_of_the_chain("px4", "", batteries);
}

#[test]
fn a_low_battery_leads_an_arducopter_out_of_the_chain() {
    let batteries = ["battery 80 0", "battery 4 0"];
    a_low_battery_leads_it_out_of_the_chain("arducopter", "--flight-time 1500", batteries);
}

/// Checks that relay 1, the initial leader, stays outside if it restarts with a low battery.
///
/// The autopilot is slow: its first message with the landed state comes after 3 s, and the next battery message is
/// lost.
#[test]
fn a_leader_with_a_slow_autopilot_restarts_outside_of_the_chain() {
    let mut pair = Pair::grounded([1, 3], "px4", "", "battery 80 1200");
    pair.drone.takes_off();
    pair.line("autopilot: in the air, and not controlled by the relay");
    until(pair.chain.files.path("status"), |said| {
        said["relay"]["relays"] == 3 && said["relay"]["has_lease"] == true
    });
    pair.restart(|drone| {
        drone.order("battery 5 60");
        drone.order("drop 245 147");
    });
    pair.line("autopilot: found a");
    std::thread::sleep(Duration::from_secs(3));
    pair.drone.order("drop 147");
    std::thread::sleep(Duration::from_secs(1));
    pair.drone.order("drop");
    pair.stays_outside();
}

/// Checks that a relay reads its endurance from lines of `--positions`.
///
/// An invalid line makes the endurance unknown. Then the relay must obey the operator's commands `stay` and `leave`.
#[test]
fn endurance_is_read_from_the_positions() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let (fifo, socket) = (chain.files.fifo("positions"), chain.files.text("status"));
    let own = format!("{QUICK} --reserve 180 --positions {fifo} --status-socket {socket} --json");
    let mut relay = chain.relay(2, &own);
    let status = || status_of(chain.files.path("status"))["battery"].clone();
    relay.line("\"event\":\"guarded\"");
    assert!(status()["endurance_s"].is_null(), "never known");
    write(&fifo, "700 0 20\nendurance 640 20\n");
    until(chain.files.path("status"), |said| {
        said["battery"]["endurance_s"].is_u64()
    });
    // 180 s of reserve, 18 s of the replacement, and the way home.
    assert_eq!(status()["leaves_below_s"], 218);
    write(&fifo, "endurance 640 soon\n");
    relay.line("\"event\":\"endurance unknown\"");
    assert!(status()["endurance_s"].is_null());
    assert_eq!(status()["endurance_losses"], 1);
    assert_eq!(status()["departure"], "member");
    flows(&fifo, "endurance 120 20\n");
    // Nobody but this log tells the pilot of a drone without an autopilot's link.
    let line = relay.line("\"event\":\"at the reserve\"");
    assert!(line.contains("\"must_leave\":true"), "{line}");
    let line = relay.line("\"event\":\"departure\"");
    assert!(line.contains("\"leaves_below_s\":218"), "{line}");
    assert_eq!(status()["at_reserve"], true);
    assert_eq!(status()["must_leave"], true);
    let (is_done, text) = commanded(&socket, "stay\n");
    assert!(
        is_done && text.contains("lasts only for the way home and the reserve"),
        "{text}"
    );
    let line = relay.line("\"event\":\"departure\"");
    assert!(line.contains("\"departure\":\"member\""), "{line}");
    assert_eq!(status()["must_leave"], false, "the operator's order");
    flows(&fifo, "endurance 118 20\n");
    assert_eq!(
        status()["departure"],
        "member",
        "the operator's order holds"
    );
    let limit_s = status()["leaves_below_s"].as_u64().unwrap();
    assert!((65..=70).contains(&limit_s), "{limit_s}");
    // That order does not silence the reserve.
    let line = relay.line("\"event\":\"at the reserve\"");
    assert!(line.contains("\"must_leave\":false"), "{line}");
    assert!(commanded(&socket, "leave\n").0);
    let line = relay.line("\"event\":\"departure\"");
    assert!(!line.contains("\"departure\":\"member\""), "{line}");
}

/// Writes `line` to the FIFO once a second for 18 s. This is longer than the 15 s after which a low endurance counts.
fn flows(fifo: &str, line: &str) {
    for _ in 0..18 {
        write(fifo, line);
        std::thread::sleep(Duration::from_secs(1));
    }
}

/// Checks that a relay without `--reserve` does not leave by itself. Invalid endurances are counted but not reported.
#[test]
fn without_a_reserve_no_endurance_counts() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let (fifo, socket) = (chain.files.fifo("positions"), chain.files.text("status"));
    let own = format!("{QUICK} --positions {fifo} --status-socket {socket} --json");
    let mut relay = chain.relay(2, &own);
    relay.line("\"event\":\"guarded\"");
    flows(&fifo, "700 0 20\nendurance 5 20\n");
    write(&fifo, "endurance soon 20\n");
    until(&socket, |said| said["battery"]["endurance_losses"] == 1);
    let said = status_of(&socket)["battery"].clone();
    assert_eq!(said["departure"], "member", "{said:#}");
    assert!(said["leaves_below_s"].is_null(), "{said:#}");
    assert!(!relay.has_printed("\"event\":\"departure\""));
    assert!(!relay.has_printed("\"event\":\"endurance unknown\""));
}

/// Checks that a relay with `--reserve` logs an unknown endurance if its FIFO has only positions.
#[test]
fn an_endurance_that_never_comes_is_told() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let fifo = chain.files.fifo("positions");
    let own = format!("{QUICK} --reserve 180 --positions {fifo}");
    let mut relay = chain.relay(2, &own);
    write(&fifo, "700 0 20\n");
    relay.line("endurance unknown: ");
}

#[test]
fn a_reserve_without_a_source_of_the_endurance_is_refused() {
    let chain = Chain::on_channel(2, Medium::new(2, QUIET));
    let refused = chain.arguments(2, "--reserve 180");
    let line = Relay::start(&refused).refused_at_once(2);
    assert!(
        line.contains("--reserve 180: needs --positions or --autopilot"),
        "{line}"
    );
}

#[test]
fn a_spare_waits_outside_of_the_chain() {
    // Relay 1 would be the first leader.
    for index in [2, 1] {
        let chain = Chain::on_channel(2, Medium::new(2, QUIET));
        let socket = chain.files.text("status");
        let mut relay = chain.relay(index, &format!("{QUICK} --spare --status-socket {socket}"));
        relay.line("departure: this relay waits outside of the chain as a spare");
        assert_eq!(status_of(&socket)["battery"]["departure"], "spare");
    }
}

#[test]
fn a_battery_that_does_not_outlast_its_reserve_is_refused() {
    let options = peer::options("/dev/null");
    let own = format!("--index 1 --of 1 {options} --reserve 180 --flight-time");
    let line = Relay::start(&format!("{own} 360")).refused_at_once(2);
    let why = "--flight-time 360: must be above 360 s, the sum of --reserve 180 s and 180 s for the replacement of this relay";
    assert!(line.contains(why), "{line}");
}

/// Checks that the leader calls a spare while the chain has fewer relays than `--flying`.
#[test]
fn a_spare_is_called_while_the_chain_has_too_few_relays() {
    let chain = Chain::on_channel(3, Medium::new(3, QUIET));
    let members = [1, 2].map(|index| chain.relay(index, &format!("{PATIENT} --flying 3")));
    let mut spare = chain.relay(3, &format!("{PATIENT} --flying 3 --spare"));
    spare.line("departure: this relay waits outside of the chain as a spare");
    spare.line("departure: this relay is a member of the chain, or joins it");
    spare.line("agreed");
    drop(members);
}

#[test]
fn a_number_of_relays_and_a_motion_out_of_range_are_refused() {
    let chain = Chain::on_channel(5, Medium::new(5, QUIET));
    for (options, why) in [
        (
            "--flying 2",
            "--flying 2: must be within 3 to 5, more than half of --of",
        ),
        (
            "--flying 6",
            "--flying 6: must be within 3 to 5, more than half of --of",
        ),
        (
            "--respacing 6.5",
            "--respacing 6.5: must be within 0 to 6 s, four times --dead-after-ms",
        ),
    ] {
        let line =
            Relay::start(&chain.arguments(1, &format!("{QUICK} {options}"))).refused_at_once(2);
        assert!(line.contains(why), "{line}");
    }
}
