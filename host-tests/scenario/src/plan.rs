//! Section `[plan]`: number of relays, method and expected positions.

use serde::Deserialize;

/// A plan in a scenario file, from `cargo plan --out` to `cargo provision`.
#[derive(Debug, Clone, PartialEq)]
pub struct Planned {
    /// Number of relays, 1 to 1000.
    pub uavs: u16,
    /// Placement method of the relays.
    pub method: PlannedMethod,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
    /// SIR of the worst hop at these positions, dB, -400 to 400.
    pub sir_db: f64,
    /// Positions, relay 1 first; one per relay.
    pub places: Vec<PlannedPlace>,
}

/// Placement method of relays that fly a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PlannedMethod {
    /// Fixed altitudes: Algorithm 1, in a field Algorithm 4.
    Align,
    /// Positions, sides and altitudes together.
    Joint,
}

/// Position of a relay.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlannedPlace {
    /// Distance along the line from Tx, m.
    pub x_m: f64,
    /// Lateral position, m; positive to the right as seen from above.
    pub y_m: f64,
    /// Altitude above ground, m, 0.1 to 1e4.
    pub altitude_m: f64,
}

impl PlannedMethod {
    /// Names of the methods in files.
    pub const NAMES: &'static [&'static str] = &["align", "joint"];

    /// Returns the name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Align => "align",
            Self::Joint => "joint",
        }
    }
}
