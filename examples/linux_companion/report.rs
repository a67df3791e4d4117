//! What the program says, one line each on standard output: seconds since the start, what happened, and every f32 also
//! as its bits, so that two relays (or a relay and a simulation) can be compared exactly.

use std::fmt;

use uav_relay::sensing::belief::{Belief, Told};
use uav_relay::wire::digest::digest;
use uav_relay::{Event, Identity, Instant, Mission, Placement, Relay, Side, Stats, Upload};

use crate::line::line;
use crate::site::Between;

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

    /// That the relay stands by what it has said in the votes on views before this start.
    #[expect(clippy::unused_self, reason = "as the other lines")]
    pub(crate) fn stands_by(&self) -> Result<(), String> {
        line(
            Instant::ZERO,
            format_args!(
                "stands by: what it has said in votes before this start; before another flight remove its --view-file"
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
            Event::NeighbourLost { side, node } => line(
                now,
                format_args!(
                    "lost: no sign of life from {} {}; look for that drone",
                    self.node(node),
                    stream(side)
                ),
            ),
            Event::NeighbourBack { side, node } => line(
                now,
                format_args!("back: {} {} is heard", self.node(node), stream(side)),
            ),
            Event::NotHeard { node } => line(
                now,
                format_args!(
                    "not heard: {} does not hear this relay; look at this one's transmitter and that one's receiver",
                    self.node(node)
                ),
            ),
            Event::MissionMismatch { node } => line(
                now,
                format_args!(
                    "mismatch: {} flies another mission than 0x{:04x}; load both with the same one",
                    self.node(node),
                    self.digest
                ),
            ),
            Event::KeyMismatch { node } => line(
                now,
                format_args!(
                    "key: {} signs with another key, or somebody does in its name; give both the same --key-file",
                    self.node(node)
                ),
            ),
            Event::EpochWentBack { node } => line(
                now,
                format_args!(
                    "epoch: that of {0} went back and it is refused; raise the number in the --epoch-file of {0} and start it again",
                    self.node(node)
                ),
            ),
            Event::IndexTaken { node } if relay.stands_down() => line(
                now,
                format_args!(
                    "index taken: another relay flies as relay {node}, and this one stands down; land one and give it its own --index"
                ),
            ),
            Event::IndexTaken { node } => line(
                now,
                format_args!(
                    "index taken: two relays fly as relay {node}; land one and give it its own --index"
                ),
            ),
            Event::LeaseLapsed => line(
                now,
                format_args!(
                    "lapsed: not all relays can be reached; holds its place and asks for a new view"
                ),
            ),
            Event::NoQuorum => line(
                now,
                format_args!(
                    "no quorum: too few relays can be reached; bring the missing ones into reach, or land these"
                ),
            ),
            Event::UploadRefused { why } => line(now, format_args!("refused: an upload; {why}")),
            Event::Uploaded => {
                let version = relay.upload().map_or(0, Upload::version);
                line(
                    now,
                    format_args!("uploaded: holds version {version} of the mission"),
                )
            }
            Event::Adopted => adopted(now, relay),
            Event::Reformed => line(
                now,
                format_args!(
                    "formed anew: relay {} of {}, view {}",
                    relay.index(),
                    relay.mission().relays(),
                    relay.view().number()
                ),
            ),
            Event::Believed => believed(now, relay.belief()),
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

    fn node(&self, node: u16) -> String {
        match node {
            0 => "the transmitter".to_owned(),
            _ if node > self.relays => "the receiver".to_owned(),
            _ => format!("relay {node}"),
        }
    }
}

/// Which mission is flown, and between which sites, if they are other ones than those that were loaded.
fn adopted(now: Instant, relay: &Relay) -> Result<(), String> {
    let what = format_args!("adopted: flies version {} of the mission", relay.version());
    match relay.sites() {
        Some(sites) => line(now, format_args!("{what}, {}", Between(sites))),
        None => line(now, what),
    }
}

const fn stream(side: Side) -> &'static str {
    match side {
        Side::Upstream => "upstream",
        Side::Downstream => "downstream",
    }
}

/// What is believed of the interference from now on.
fn believed(now: Instant, told: Told) -> Result<(), String> {
    match told.belief {
        Belief::Source { source, receiver_w } => line(
            now,
            format_args!(
                "believed: interferer {} W, x {} m, y {} m; at the receiver {receiver_w:.3e} W",
                Exact(source.power_w),
                Exact(source.x_m),
                Exact(source.y_m)
            ),
        ),
        Belief::Unknown(spread) => line(
            now,
            format_args!("believed: nothing is known; spread {spread:?}"),
        ),
        Belief::Mission => line(now, format_args!("believed: what the mission says")),
    }
}

/// Where to fly, for people and other programs: `place.x_m` metres from the transmitter toward the receiver,
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
