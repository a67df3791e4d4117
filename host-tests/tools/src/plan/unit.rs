//! Formatting of SIRs in the unit of the request.

/// Unit of SIRs.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Unit {
    /// Ratio of powers.
    #[default]
    Linear,
    /// Decibels.
    Decibels,
}

impl Unit {
    /// Formats an SIR (linear) in this unit, rounded as a result.
    pub fn say(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir:.6}"),
            Self::Decibels => format!("{:.3} dB", 10.0 * sir.log10()),
        }
    }

    /// Formats an SIR (linear) in this unit with all the digits of the request.
    pub fn asked(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir}"),
            // Rounds off the error of converting decibels to linear and back.
            Self::Decibels => format!("{} dB", (10.0 * sir.log10() * 1e9).round() / 1e9),
        }
    }

    /// Formats an SIR (linear) in both units, this one first.
    pub fn both(self, sir: f64) -> String {
        let sir_db = 10.0 * sir.log10();
        match self {
            Self::Linear => format!("SIR {sir:.6} ({sir_db:.3} dB)"),
            Self::Decibels => format!("{sir_db:.3} dB (SIR {sir:.6})"),
        }
    }
}
