//! Data link: how the hops share the radio, and the data rate that an SINR carries.
//!
//! ```text
//! R = B b(SINR of the worst hop) / slots
//! ```
//!
//! with the bandwidth B, and the spectral efficiency b in bit/s/Hz of a [`RateModel`]. On one frequency every hop has a time slot of
//! its own, as the paper assumes; with a frequency for each hop all hops send at the same time.

use serde::Deserialize;

use crate::number::factor;

/// Access of the hops to the radio.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// A single frequency, with one of N + 1 equal time slots for each hop.
    #[default]
    Slots,
    /// A frequency for each hop.
    Channels,
}

impl Access {
    /// Names in files.
    pub const NAMES: &'static [&'static str] = &["slots", "channels"];

    /// Returns the name in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slots => "slots",
            Self::Channels => "channels",
        }
    }

    /// Returns the number of time slots in which a chain of `relays` relays forwards one packet per hop.
    pub const fn slots(self, relays: u16) -> u32 {
        match self {
            Self::Slots => relays as u32 + 1,
            Self::Channels => 1,
        }
    }
}

/// Step of a radio's modulation and coding.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RateStep {
    /// Lowest SINR at which the step works, dB, -60 to 90.
    pub sinr_db: f64,
    /// Spectral efficiency, bit/s/Hz, above 0 and at most 100.
    pub bits_per_hz: f64,
}

/// Spectral efficiency of a hop as a function of its SINR.
#[derive(Debug, Clone, PartialEq)]
pub enum RateModel {
    /// log2(1 + SINR / gap).
    Shannon {
        /// Gap to Shannon's limit, dB, 0 to 30.
        gap_db: f64,
    },
    /// The step with the largest SINR that the hop has; 0 below the first. Both numbers increase strictly.
    Steps(Vec<RateStep>),
}

impl Default for RateModel {
    fn default() -> Self {
        Self::Shannon { gap_db: 0.0 }
    }
}

impl RateModel {
    /// Returns the spectral efficiency at `sinr` (linear), bit/s/Hz.
    pub fn bits_per_hz(&self, sinr: f64) -> f64 {
        match self {
            Self::Shannon { gap_db } => (sinr / factor(*gap_db)).ln_1p() / std::f64::consts::LN_2,
            Self::Steps(steps) => {
                let met = steps.iter().rfind(|step| sinr >= factor(step.sinr_db));
                met.map_or(0.0, |step| step.bits_per_hz)
            }
        }
    }

    /// Returns the lowest SINR (linear) with this spectral efficiency, bit/s/Hz; `None` if no step has it.
    pub fn sinr_for(&self, bits_per_hz: f64) -> Option<f64> {
        match self {
            Self::Shannon { gap_db } => {
                Some((bits_per_hz * std::f64::consts::LN_2).exp_m1() * factor(*gap_db))
            }
            Self::Steps(steps) => {
                let enough = steps.iter().find(|step| step.bits_per_hz >= bits_per_hz);
                enough.map(|step| factor(step.sinr_db))
            }
        }
    }
}

/// Data link of a scenario.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Link {
    /// Access of the hops to the radio.
    pub access: Access,
    /// Bandwidth of one frequency, Hz, 1 to 1e12; `None` for that of the noise.
    pub bandwidth_hz: Option<f64>,
    /// Spectral efficiency.
    pub model: RateModel,
}

#[cfg(test)]
mod tests {
    use super::{RateModel, RateStep};

    fn steps() -> RateModel {
        RateModel::Steps(vec![
            RateStep {
                sinr_db: 0.0,
                bits_per_hz: 0.5,
            },
            RateStep {
                sinr_db: 10.0,
                bits_per_hz: 2.0,
            },
        ])
    }

    #[test]
    fn a_gap_divides_the_sinr() {
        let model = RateModel::Shannon { gap_db: 3.0 };
        let expected = (1.0 + 7.0 / 10_f64.powf(0.3)).log2();
        assert!((model.bits_per_hz(7.0) - expected).abs() < 1e-12);
        let back = model.sinr_for(expected).unwrap();
        assert!((back - 7.0).abs() < 1e-9, "{back}");
    }

    #[test]
    fn a_step_holds_until_the_next() {
        let model = steps();
        for (sinr, bits) in [
            (0.999, 0.0),
            (1.0, 0.5),
            (9.99, 0.5),
            (10.0, 2.0),
            (1e6, 2.0),
        ] {
            assert!(
                (model.bits_per_hz(sinr) - bits).abs() < f64::EPSILON,
                "{sinr}"
            );
        }
        assert_eq!(model.sinr_for(0.1), Some(1.0));
        assert_eq!(model.sinr_for(0.6), Some(10.0));
        assert_eq!(model.sinr_for(2.1), None);
    }
}
