//! Log lines of the relay.
//!
//! Each f32 is also printed as its bits, so that two relays, or relay and simulation, can be compared exactly.

use std::fmt;

use serde_json::json;
use uav_relay::Geofence;
use uav_relay::sensing::estimate::{InterferenceEstimate, NumberedEstimate, Spread};

use uav_relay::{
    Event, Identity, Instant, LineError, Mission, Placement, Relay, Side, SlotShares, Stats, Upload,
};

use crate::movement::Movement;
use crate::status;
use uav_relay_linux::counters::counted;
use uav_relay_linux::log::Log;
use uav_relay_linux::site::Between;

struct Exact(f32);

impl fmt::Display for Exact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(3);
        write!(f, "{:.digits$} (0x{:08x})", self.0, self.0.to_bits())
    }
}

#[derive(Debug)]
pub(crate) struct Report {
    log: Log,
    identity: Identity,
    /// Number of relays in the mission at the start. Relays keep their numbers when some relays are lost.
    relays: u16,
    digest: u16,
    fence: Option<Geofence>,
    movement: Movement,
}

impl Report {
    /// Creates the writer of the relay's log lines. `flies` is true if this program sends setpoints to an autopilot.
    pub(crate) fn new(
        log: Log,
        identity: Identity,
        mission: &Mission,
        fence: Option<Geofence>,
        flies: bool,
    ) -> Self {
        Self {
            movement: Movement::new(flies),
            log,
            identity,
            fence,
            relays: mission.relays(),
            digest: mission.digest(),
        }
    }

    /// Logs the relay's identity, ports and mission digest. Relays with the same mission have the same digest.
    pub(crate) fn started(&self, ttys: &[String], baud: u32) {
        let Identity { network, index } = self.identity;
        let (relays, digest) = (self.relays, self.digest);
        let ports = if ttys.is_empty() {
            "no serial port".to_owned()
        } else {
            format!("{}, {baud} bit/s", ttys.join(", "))
        };
        self.log.event(
            Instant::ZERO,
            "started",
            json!({
                "relays": relays, "network": network, "mission": digest, "ports": ttys, "baud": baud,
                "version": env!("CARGO_PKG_VERSION"),
            }),
            format_args!(
                "relay {index} of {relays}, network {network}, mission digest 0x{digest:04x}, {ports}"
            ),
        );
    }

    /// Logs the signing epoch; `None` means that frames are not signed.
    pub(crate) fn signing(&self, epoch: Option<u32>) {
        match epoch {
            Some(epoch) => self.log.signed(epoch),
            None => self.log.line(
                Instant::ZERO,
                "unsigned",
                "no --key-file: frames are not signed, so anybody in range can forge them",
            ),
        }
    }

    /// Logs that the relay flies a mission that was uploaded to it before this start.
    pub(crate) fn resumed(&self, relay: &Relay) {
        let version = relay.version();
        self.log.event(
            Instant::ZERO,
            "resumed",
            json!({ "version": version }),
            format_args!("this relay flies version {version} of the mission, which was uploaded to it before this start"),
        );
    }

    /// Logs that the relay's votes on the chain's members were restored from an earlier start.
    pub(crate) fn votes_restored(&self) {
        self.log.line(
            Instant::ZERO,
            "restored",
            "this relay's earlier votes on the chain's membership were read from --view-file; on the ground, remove that file before the next flight",
        );
    }

    pub(crate) fn event(&mut self, now: Instant, event: Event, relay: &Relay) {
        let tell = |word: &str, text: &str| self.log.line(now, word, text);
        match event {
            Event::SetpointChanged => {
                if let Some(step) = self.movement.setpoint_changed(now, relay) {
                    step.log(now, &self.log);
                }
            }
            Event::Converged => {
                self.converged(now, relay.target().unwrap_or_default());
                if let Some(slots) = relay.slot_shares() {
                    self.log_slots(now, slots);
                }
            }
            Event::Infeasible => tell(
                "infeasible",
                "no positions give every hop one of the tried target SIRs, so all relays keep their positions; check the mission's interferer, distance and minimum separation",
            ),
            Event::Adopted => self.adopted(now, relay),
            Event::ViewAccepted => self.view_accepted(now, relay),
            Event::NewEstimate => self.log_estimate(now, relay.interference_estimate()),
            Event::LeaseLapsed => tell(
                "lease expired",
                "not all relays are reachable, so the last agreement on positions has expired; this relay keeps its setpoint, and asks the others to agree which relays form the chain (a new view)",
            ),
            Event::NoQuorum => tell(
                "no quorum",
                "too few relays receive each other to agree on the chain's members, so this relay keeps its setpoint; bring the missing relays into range, or land this part of the chain",
            ),
            Event::UploadRefused { why } => self.refused(now, why),
            Event::Uploaded => {
                let version = relay.upload().map_or(0, Upload::version);
                self.log.event(
                    now,
                    "uploaded",
                    json!({ "version": version }),
                    format_args!("version {version} of the mission was received and stored"),
                );
            }
            Event::InterfererUnclear => tell(
                "interferer unclear",
                "the measurements do not fit a single interferer on the ground, or are too few; the relays keep their last estimate",
            ),
            Event::MayLeave => tell(
                "may leave",
                "the chain works without this relay now, so this drone has permission to leave",
            ),
            Event::EnduranceUnknown => self.log.event(
                now,
                "endurance unknown",
                json!({ "leaves_below_s": relay.endurance_limit_s() }),
                "the drone's remaining time of flight is invalid, or has not been received for 10 s; the relay counts down from the last valid value, if there is one; watch the battery",
            ),
            Event::AtReserve => self.log.event(
                now,
                "at the reserve",
                json!({ "endurance_s": relay.endurance_s(now), "must_leave": relay.must_leave() }),
                "the drone's battery lasts only for the way home and the reserve: fly the drone home now",
            ),
            other => self.node_event(now, other, relay),
        }
    }

    /// Logs a new setpoint or the drone's arrival, if there is one to log. Returns the time of the next check.
    ///
    /// `drone` is the drone's position.
    pub(crate) fn log_movement(
        &mut self,
        now: Instant,
        relay: &Relay,
        drone: Option<Placement>,
    ) -> Option<Instant> {
        let (step, again) = self.movement.poll(now, relay, drone);
        if let Some(step) = step {
            step.log(now, &self.log);
        }
        again
    }

    /// Logs a rejected upload. If the upload violates the geofence, the log line has the permitted range.
    fn refused(&self, now: Instant, why: LineError) {
        const EVENT: &str = "upload refused";
        let range_m = match (why, self.fence) {
            (LineError::Altitude, Some(of)) => [of.least_altitude_m, of.most_altitude_m],
            (LineError::Lateral, Some(of)) => [of.least_y_m, of.most_y_m],
            (LineError::Length, Some(of)) => [of.least_x_m, of.most_x_m],
            _ => return self.log.line(now, EVENT, why),
        };
        let what = format_args!("{why}, {} to {} m", range_m[0], range_m[1]);
        self.log
            .event(now, EVENT, json!({ "range_m": range_m }), what);
    }

    fn node_event(&self, now: Instant, event: Event, relay: &Relay) {
        let (node, side) = match event {
            Event::NeighbourLost { side, node }
            | Event::NeighbourBack { side, node }
            | Event::MayLeaveTold { side, node } => (node, Some(side)),
            Event::NotHeard { node }
            | Event::MissionMismatch { node }
            | Event::KeyMismatch { node }
            | Event::EpochWentBack { node }
            | Event::DuplicateIndex { node }
            | Event::SensorOff { node } => (node, None),
            other => return self.log.line(now, "event", format_args!("{other:?}")),
        };
        let name = self.name(node);
        let toward = side.map_or("", direction);
        let fields = json!({ "node": node, "name": name, "side": side.map(stream) });
        let say = |word: &str, text: fmt::Arguments<'_>| self.log.event(now, word, fields, text);
        match event {
            Event::NeighbourLost { .. } => say(
                "lost",
                format_args!("{name} {toward} does not reply; look for that drone"),
            ),
            Event::NeighbourBack { .. } => {
                say("back", format_args!("{name} is now the neighbour {toward}"));
            }
            Event::MayLeaveTold { .. } => say(
                "told",
                format_args!(
                    "{name} {toward} is outside of the chain, and has permission to leave; when its drone has left, send the command `clear-lost` with its number"
                ),
            ),
            Event::NotHeard { .. } => say(
                "not heard",
                format_args!(
                    "{name} does not receive this relay; check this relay's transmitter and the receiver of {name}"
                ),
            ),
            Event::MissionMismatch { .. } => say(
                "mismatch",
                format_args!(
                    "{name} has another mission than this relay (digest of this relay's mission: 0x{:04x}); load the same mission into both",
                    self.mission_digest(relay)
                ),
            ),
            Event::KeyMismatch { .. } => say(
                "key",
                format_args!(
                    "{name} signs with another key than this relay, or an attacker uses its number; give both relays the same --key-file"
                ),
            ),
            Event::EpochWentBack { .. } => say(
                "epoch",
                format_args!(
                    "{name} has started with an epoch (start counter) that is not above its last one, and its frames are rejected; raise the number in its --epoch-file and restart it"
                ),
            ),
            Event::SensorOff { .. } => say(
                "sensor",
                format_args!(
                    "the interference measured by {name} does not fit the other measurements and is ignored; check the receiver of {name}"
                ),
            ),
            _ if relay.is_passive() => say(
                "duplicate index",
                format_args!(
                    "another relay uses number {node}, too, so this relay is passive and has no setpoint; land one of the two, and give it its own --index"
                ),
            ),
            _ => say(
                "duplicate index",
                format_args!(
                    "two relays use number {node}; land one of the two, and give it its own --index"
                ),
            ),
        }
    }

    pub(crate) fn stopped(&self, now: Instant, stats: &Stats) {
        self.log.event(
            now,
            "stopped",
            counted(stats),
            format_args!(
                "relay {}, {} frames sent, {} received, {} rejected",
                self.identity.index,
                stats.sent,
                stats.received,
                stats.rejected()
            ),
        );
    }

    /// Returns the number of this relay, which never changes.
    pub(crate) const fn index(&self) -> u16 {
        self.identity.index
    }

    /// Returns the name of a node (Tx, relay or Rx) for the log.
    ///
    /// `node` is the node's number at the start: 0 is the transmitter; in a mission of N relays, N + 1 is the receiver.
    pub(crate) fn name(&self, node: u16) -> String {
        match node {
            0 => "the transmitter".to_owned(),
            _ if node > self.relays => "the receiver".to_owned(),
            _ => format!("relay {node}"),
        }
    }

    /// Returns the digest of the relay's present mission.
    fn mission_digest(&self, relay: &Relay) -> u16 {
        match relay.upload() {
            Some(upload) if relay.version() == upload.version() => upload.id().digest,
            _ => self.digest,
        }
    }

    /// Logs that the chain flies a new mission, with the Tx and Rx positions of this mission, if any.
    fn adopted(&self, now: Instant, relay: &Relay) {
        let version = relay.version();
        let fields = json!({ "version": version });
        let sites = relay.sites();
        let sites = sites.map_or(String::new(), |sites| format!(", {}", Between(sites)));
        let what = format_args!("the chain flies version {version} of the mission{sites}");
        self.log.event(now, "adopted", fields, what);
    }

    fn view_accepted(&self, now: Instant, relay: &Relay) {
        // A drone keeps its number. Its place in the chain changes when a relay between it and Tx is lost.
        let (place, relays) = (relay.index(), relay.mission().relays());
        let view = relay.view().number();
        let noun = if relays == 1 { "relay" } else { "relays" };
        self.log.event(
            now,
            "view accepted",
            json!({ "place": place, "relays": relays, "view": view }),
            format_args!("the chain has {relays} {noun}; this relay is at place {place}, counted from the transmitter (view {view})"),
        );
    }

    fn converged(&self, now: Instant, target: f32) {
        let db = 10.0 * target.log10();
        let fields = json!({ "target_sir": target, "target_sir_db": db });
        if target > 0.0 {
            let text = format_args!(
                "positions agreed, target SIR {:.6}, {db:.3} dB",
                Exact(target)
            );
            self.log.event(now, "converged", fields, text);
        } else {
            let text = "the relays spread along the line to measure the interferer";
            self.log.event(now, "converged", fields, text);
        }
    }

    /// Logs begin and end of the time slots in which this relay sends and receives, fitted to its hops.
    ///
    /// The values are fractions of the frame, which is the period of all slots.
    fn log_slots(&self, now: Instant, slots: SlotShares) {
        let said = |name: &str, [begin, end]: [f32; 2]| {
            format!("{name} {:.6} to {:.6}", Exact(begin), Exact(end))
        };
        let there = [said("from Tx", slots.from_tx), said("to Rx", slots.to_rx)];
        let back = [said("from Rx", slots.from_rx), said("to Tx", slots.to_tx)];
        let [begin, end] = slots.to_tx;
        let used = there
            .into_iter()
            .chain(back.into_iter().filter(|_| end > begin));
        let used = used.collect::<Vec<_>>().join(", ");
        let text = format_args!(
            "time slots, as shares of the period of all slots: {used}; the chain carries {:.6} bit/s/Hz",
            Exact(slots.bits_per_hz)
        );
        self.log.event(now, "slots", status::slots(slots), text);
    }

    fn log_estimate(&self, now: Instant, numbered: NumberedEstimate) {
        match numbered.estimate {
            InterferenceEstimate::Source { source, receiver_w } => self.log.event(
                now,
                "estimate",
                json!({
                    "power_w": source.power_w, "x_m": source.x_m, "y_m": source.y_m, "receiver_w": receiver_w,
                }),
                format_args!(
                    "interferer {} W, x {} m, y {} m; interference at the receiver {receiver_w:.3e} W",
                    Exact(source.power_w),
                    Exact(source.x_m),
                    Exact(source.y_m)
                ),
            ),
            InterferenceEstimate::Unknown(spread) => {
                let spread = match spread {
                    Spread::Even => "evenly",
                    Spread::TowardTx => "toward the transmitter",
                    Spread::TowardRx => "toward the receiver",
                };
                let what =
                    format_args!("interference unknown; the relays spread {spread} to measure it");
                self.log.line(now, "estimate", what);
            }
            InterferenceEstimate::Mission => {
                let what = "the chain uses the interferer given in the mission";
                self.log.line(now, "estimate", what);
            }
        }
    }
}

/// Returns the words of the log for the direction toward `side`, such as `upstream (toward Tx)`.
pub(crate) const fn direction(side: Side) -> &'static str {
    match side {
        Side::Upstream => "upstream (toward Tx)",
        Side::Downstream => "downstream (toward Rx)",
    }
}

const fn stream(side: Side) -> &'static str {
    match side {
        Side::Upstream => "upstream",
        Side::Downstream => "downstream",
    }
}
