//! SIRs in the unit in which they were asked for.

/// The unit of an answer.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum Unit {
    /// A ratio of powers.
    #[default]
    Linear,
    /// Decibels.
    Decibels,
}

impl Unit {
    /// An SIR (linear) in this unit, with the digits of a result.
    pub fn say(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir:.6}"),
            Self::Decibels => format!("{:.3} dB", 10.0 * sir.log10()),
        }
    }

    /// An SIR (linear) in this unit with all its digits, as it was asked for.
    pub fn asked(self, sir: f64) -> String {
        match self {
            Self::Linear => format!("{sir}"),
            // An SIR comes from decibels and goes back to them by logarithms.
            Self::Decibels => format!("{} dB", (10.0 * sir.log10() * 1e9).round() / 1e9),
        }
    }

    /// An SIR (linear) in both units, this one first.
    pub fn both(self, sir: f64) -> String {
        let sir_db = 10.0 * sir.log10();
        match self {
            Self::Linear => format!("SIR {sir:.6} ({sir_db:.3} dB)"),
            Self::Decibels => format!("{sir_db:.3} dB (SIR {sir:.6})"),
        }
    }
}
