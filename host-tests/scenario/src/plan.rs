//! What a planner found: how many relays fly, by which method, and where they are expected.

use serde::Deserialize;

/// A plan that a scenario file carries on, from `cargo plan --out` to `cargo provision`.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Number of relays, 1 to 1000.
    pub uavs: u16,
    /// How the relays find their places.
    pub method: PlannedMethod,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
    /// SIR of the worst hop at these places, in dB, -400 to 400.
    pub sir_db: f64,
    /// Where the relays go, relay 1 first; as many as there are relays.
    pub places: Vec<PlannedPlace>,
}

/// How relays that fly a plan find their places.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlannedMethod {
    /// At the altitudes they hold: Algorithm 1, in a field Algorithm 4.
    Align,
    /// Places, sides and altitudes together.
    Joint,
}

/// Where a relay goes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedPlace {
    /// Along the line from Tx, in metres.
    pub x_m: f64,
    /// To the right of it as seen from above, in metres.
    pub y_m: f64,
    /// Above the ground, in metres, 0.1 to 1e5.
    pub altitude_m: f64,
}

impl PlannedMethod {
    /// Every method, as files have it.
    pub const NAMES: &'static [&'static str] = &["align", "joint"];

    /// As files have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Align => "align",
            Self::Joint => "joint",
        }
    }
}
