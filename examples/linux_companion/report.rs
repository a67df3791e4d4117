//! What the program says, one line each on standard output: seconds since the start, what happened, and every f32 also
//! as its bits, so that two relays (or a relay and a simulation) can be compared exactly.

use std::fmt;

use uav_relay::wire::digest::digest;
use uav_relay::{Event, Identity, Instant, Mission, Placement, Relay, Side, Stats, Upload};

use crate::line::line;

/// An f32 for people and, exactly, for programs.
struct Exact(f32);

impl fmt::Display for Exact {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let digits = f.precision().unwrap_or(3);
        write!(f, "{:.digits$} (0x{:08x})", self.0, self.0.to_bits())
    }
}

/// Writes the lines of one relay.
#[derive(Debug)]
pub(crate) struct Report {
    identity: Identity,
    relays: u16,
    digest: u16,
}

impl Report {
    pub(crate) fn new(identity: Identity, mission: &Mission) -> Self {
        Self {
            identity,
            relays: mission.relays(),
            digest: digest(mission),
        }
    }

    /// Who listens where. The digest of the mission is the same at all relays if they were given the same one.
    ///
    /// # Errors
    /// As every line: where standard output takes it no more.
    pub(crate) fn started(&self, ttys: &[String], baud: u32) -> Result<(), String> {
        let Identity { network, index } = self.identity;
        let (relays, digest) = (self.relays, self.digest);
        let ttys = if ttys.is_empty() {
            "no tty".to_owned()
        } else {
            ttys.join(", ")
        };
        line(
            Instant::ZERO,
            format_args!(
                "started: relay {index} of {relays}, network {network}, mission 0x{digest:04x}, {ttys}, {baud} baud"
            ),
        )
    }

    /// With which epoch frames are signed, if they are.
    #[expect(clippy::unused_self, reason = "as the other lines")]
    pub(crate) fn signs(&self, epoch: Option<u32>) -> Result<(), String> {
        match epoch {
            Some(epoch) => line(
                Instant::ZERO,
                format_args!("signed: frames carry a tag, epoch {epoch}"),
            ),
            None => line(
                Instant::ZERO,
                format_args!("unsigned: no --key-file, anybody can send frames"),
            ),
        }
    }

    /// That the relay flies what was uploaded before this start.
    #[expect(clippy::unused_self, reason = "as the other lines")]
    pub(crate) fn resumed(&self, relay: &Relay) -> Result<(), String> {
        line(
            Instant::ZERO,
            format_args!(
                "resumed: flies version {} of the mission, uploaded before this start",
                relay.version()
            ),
        )
    }

    pub(crate) fn event(&self, now: Instant, event: Event, relay: &Relay) -> Result<(), String> {
        match event {
            Event::SetpointChanged => match relay.setpoint() {
                Some(place) => fly_to(now, place),
                None => Ok(()),
            },
            Event::Converged => {
                let target = relay.target().unwrap_or_default();
                let db = 10.0 * target.log10();
                line(
                    now,
                    format_args!("converged: target SIR {:.6}, {db:.3} dB", Exact(target)),
                )
            }
            Event::Infeasible => line(now, format_args!("infeasible: no target can be met")),
            Event::NeighbourLost(side) => line(
                now,
                format_args!("lost: no sign of life from {}", self.neighbour(side)),
            ),
            Event::NeighbourBack(side) => line(
                now,
                format_args!("back: {} is heard again", self.neighbour(side)),
            ),
            Event::MissionMismatch(side) => line(
                now,
                format_args!(
                    "mismatch: {} flies another mission than 0x{:04x}",
                    self.neighbour(side),
                    self.digest
                ),
            ),
            Event::Uploaded => {
                let version = relay.upload().map_or(0, Upload::version);
                line(
                    now,
                    format_args!("uploaded: holds version {version} of the mission"),
                )
            }
            Event::Adopted => line(
                now,
                format_args!("adopted: flies version {} of the mission", relay.version()),
            ),
            other => line(now, format_args!("event: {other:?}")),
        }
    }

    pub(crate) fn stopped(&self, now: Instant, stats: &Stats) -> Result<(), String> {
        line(
            now,
            format_args!(
                "stopped: relay {}, {} frames sent, {} received, {} refused",
                self.identity.index,
                stats.sent,
                stats.received,
                stats.rejected()
            ),
        )
    }

    fn neighbour(&self, side: Side) -> String {
        let index = self.identity.index;
        match side {
            Side::Upstream => format!("relay {} upstream", index.saturating_sub(1)),
            Side::Downstream => format!("relay {} downstream", index.saturating_add(1)),
        }
    }
}

/// Replace this by what your autopilot wants to hear: `place.x_m` metres from the transmitter toward the receiver,
/// `place.y_m` to the right of that line as seen from above, at `place.altitude_m` above the ground.
fn fly_to(now: Instant, place: Placement) -> Result<(), String> {
    line(
        now,
        format_args!(
            "setpoint: x {} m, y {} m, altitude {} m",
            Exact(place.x_m),
            Exact(place.y_m),
            Exact(place.altitude_m)
        ),
    )
}
