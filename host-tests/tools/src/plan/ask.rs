//! What a plan is asked for.

/// How many relays.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// So many, 1 to 1000: the best places are asked for.
    Of(u16),
    /// The fewest that give every hop this SIR, linear, above 0.
    Meeting(f64),
}

/// What a plan is asked for.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Ask {
    /// How many relays.
    pub number: Number,
    /// Whether altitudes may be chosen from the scenario's band.
    pub free_altitude: bool,
    /// Where the only relay has to stand along x, m, 0 to D; its altitude is then chosen from the band.
    pub x_m: Option<f64>,
    /// Relative tolerance on the achieved SIR, 1e-6 to 0.1.
    pub tolerance: f64,
}
