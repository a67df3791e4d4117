//! Request to the planner.

/// Requested number of relays.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// A given number, 1 to 1000: the plan has their best positions.
    Of(u16),
    /// The fewest that give every hop this SIR, linear, above 0.
    Meeting(f64),
}

/// Request to the planner.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PlanRequest {
    /// Number of relays.
    pub number: Number,
    /// True if altitudes may be chosen from the scenario's band.
    pub free_altitude: bool,
    /// Required x of the only relay, m, 0 to D; its altitude is then chosen from the band.
    pub x_m: Option<f64>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
}
