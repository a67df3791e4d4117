//! State of a chain at one time, as the page shows it.
//!
//! Everything but the numbers of relays is optional, because a station on the ground knows a relay only by the telemetry that has
//! reached it. The page shows unknown values as a dash. Coordinates are metres of the line from Tx to Rx: x from Tx toward Rx, y to
//! the right as seen toward Rx.

use std::fmt;

use serde::{Serialize, Serializer};

/// State of a chain at one time.
///
/// The page shows texts as plain text, without control characters and direction marks, and cut at 300 characters.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct Snapshot {
    /// Time of the state, s since the start of the flight or of the program.
    pub time_s: Option<f64>,
    /// Name of the chain, which the page shows as its heading.
    pub name: Option<String>,
    /// Origin and direction of the coordinates on earth.
    pub frame: Option<Frame>,
    /// Position of the transmitter.
    pub tx: Option<Position>,
    /// Position of the receiver.
    pub rx: Option<Position>,
    /// Known relays, including lost relays.
    pub relays: Vec<RelaySnapshot>,
    /// Number of relays in the chain, and number that is meant to fly; `None` if the latter is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chain_size: Option<ChainSize>,
    /// Hops of the chain, from Tx to Rx.
    pub hops: Vec<Hop>,
    /// Known or estimated interferers.
    pub interferers: Vec<InterfererSnapshot>,
    /// Geofence of the setpoints.
    pub geofence: Option<Fence>,
    /// No-fly areas, each as a list of its corners, x and y in m.
    pub no_fly: Vec<Vec<[f64; 2]>>,
    /// Ground below the line from Tx to Rx.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground: Option<GroundProfile>,
    /// Alarms of the flight, both lasting and ended. No two alarms have the same number.
    pub alarms: Vec<Alarm>,
    /// Data for the page's script `desk.js`, which gives tasks to the program.
    ///
    /// `None` if the page cannot give tasks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub desk: Option<serde_json::Value>,
    /// Log lines since the previous snapshot. The server keeps the last 1000 lines.
    #[serde(skip)]
    pub log: Vec<LogLine>,
}

/// Origin and direction of a snapshot's coordinates on earth.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Frame {
    /// Latitude and longitude of Tx, the origin, degrees (WGS 84).
    pub origin_deg: Option<[f64; 2]>,
    /// Direction of the x axis, degrees clockwise from true north, 0 to 360.
    pub azimuth_deg: Option<f64>,
}

/// Position in the chain's coordinates.
#[derive(Clone, Copy, PartialEq, Debug, Default, Serialize)]
pub struct Position {
    /// Distance from Tx along the line toward Rx, m.
    pub x_m: f64,
    /// Distance from the line Tx-Rx, m, positive to the right as seen from Tx toward Rx.
    pub y_m: f64,
    /// Altitude above the ground of Tx, m.
    pub altitude_m: Option<f64>,
}

/// Known state of a relay.
#[derive(Clone, PartialEq, Debug, Default, Serialize)]
pub struct RelaySnapshot {
    /// Number of the relay in the mission, from 1 next to Tx.
    pub number: u16,
    /// Age of this state, s: time since the relay reported it.
    pub age_s: Option<f64>,
    /// Overall condition, which determines the colour and the symbol.
    pub condition: Option<Condition>,
    /// Position of the drone.
    pub position: Option<Position>,
    /// Setpoint that the relay gives to its autopilot now.
    pub setpoint: Option<Position>,
    /// Position on which the chain has agreed: the destination of the relay.
    pub agreed: Option<Position>,
    /// Phase of the protocol, for example "agreed" or "view change".
    pub phase: Option<String>,
    /// State of the control of the drone, for example "engaged" or "on the ground".
    pub control: Option<String>,
    /// Reason why the drone holds its position before it reaches the agreed position.
    pub hold_reason: Option<String>,
    /// Numbers of the neighbours that the relay reports as lost.
    pub lost_neighbours: Vec<u16>,
}

impl RelaySnapshot {
    /// Creates the state of a relay of which only the number is known.
    pub fn new(number: u16) -> Self {
        Self {
            number,
            ..Self::default()
        }
    }
}

/// Number of relays in the chain, and number that is meant to fly.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub struct ChainSize {
    /// Number of relays in the chain, by their reports. Lost relays do not count.
    pub present: u16,
    /// Number of relays that are meant to fly: `fleet.flying` of the scenario.
    pub meant: u16,
}

/// Overall condition of a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// The relay flies its agreed position or is on the way to it.
    Normal,
    /// The relay waits: for its pilot, for an agreement or for a neighbour.
    Waiting,
    /// The relay has a fault, for example an autopilot without a position.
    Fault,
    /// The relay is lost: no member of the chain receives it.
    Lost,
}

/// Node of a chain, at either end of a hop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Node {
    /// Transmitter on the ground.
    Tx,
    /// Relay with this number.
    Relay(u16),
    /// Receiver on the ground.
    Rx,
}

impl fmt::Display for Node {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tx => f.write_str("Tx"),
            Self::Relay(number) => number.fmt(f),
            Self::Rx => f.write_str("Rx"),
        }
    }
}

impl Serialize for Node {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// Hop between two neighbours, with its signal-to-interference ratios (SIR).
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Hop {
    /// Node of the hop nearer to Tx.
    pub from: Node,
    /// Node of the hop nearer to Rx.
    pub to: Node,
    /// SIR toward Rx by the model, dB.
    pub sir_db: Option<f64>,
    /// SIR toward Tx by the model, dB.
    pub sir_back_db: Option<f64>,
    /// Measured SIR toward Rx, dB.
    pub measured_db: Option<f64>,
    /// Measured SIR toward Tx, dB.
    pub measured_back_db: Option<f64>,
}

impl Hop {
    /// Creates a hop whose SIRs are unknown.
    pub const fn new(from: Node, to: Node) -> Self {
        Self {
            from,
            to,
            sir_db: None,
            sir_back_db: None,
            measured_db: None,
            measured_back_db: None,
        }
    }
}

/// Known or estimated interferer on the ground.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct InterfererSnapshot {
    /// Position of the interferer.
    pub position: Position,
    /// Transmit power, W.
    pub power_w: Option<f64>,
    /// Radius around the position within which the interferer is expected, m; `None` if unknown.
    pub uncertainty_m: Option<f64>,
    /// True if the relays estimate the interferer by measurements.
    pub is_estimated: bool,
}

/// Geofence: a rectangle along the line from Tx to Rx.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Fence {
    /// Smallest and largest distance x from Tx toward Rx, m.
    pub x_m: [f64; 2],
    /// Smallest and largest lateral position y, m, positive to the right as seen from Tx toward Rx.
    pub y_m: [f64; 2],
    /// Lowest and highest altitude of the geofence, m.
    pub altitude_m: Option<[f64; 2]>,
}

/// Ground below the line from Tx to Rx.
///
/// Its heights are measured from the same level as the relays' altitudes.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct GroundProfile {
    /// Distance from Tx to Rx, m.
    pub length_m: f64,
    /// Height of the antennas of Tx and Rx above the ground, m.
    pub mast_m: f64,
    /// Heights of the ground at equally spaced points from Tx to Rx, both included, m. At least two heights.
    pub heights_m: Vec<f64>,
}

/// Urgency of an alarm. The page lists the most urgent alarms first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Urgency {
    /// The operator should know, and need not act.
    Notice,
    /// The operator should look into it.
    Warning,
    /// The operator has to act now.
    Critical,
}

/// Alarm for the operator.
///
/// The page gives a sound until the operator acknowledges the alarm or the alarm ends.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Alarm {
    /// Number of the alarm, from 1, which no other alarm of the flight has.
    pub number: u32,
    /// Time when the alarm began, s on the scale of [`Snapshot::time_s`].
    pub time_s: f64,
    /// Urgency of the alarm.
    pub urgency: Urgency,
    /// Text of the alarm, for example "relay 3 lost: reported by relay 2".
    pub text: String,
    /// Time when the reason of the alarm ended; `None` while it lasts.
    pub cleared_s: Option<f64>,
    /// Number of the relay that the alarm reports as lost; `None` for other alarms.
    pub lost: Option<u16>,
}

/// Line of the log of the whole chain.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct LogLine {
    /// Time of the event, s on the scale of [`Snapshot::time_s`].
    pub time_s: f64,
    /// Text of the line. It names the relay, if the event is about one.
    pub text: String,
}
