//! Data link: how the hops share the radio, and the data rate that an SINR carries.
//!
//! B is the bandwidth, and b the spectral efficiency of a [`RateModel`] in bit/s/Hz. A chain of N + 1 hops carries
//!
//! ```text
//! slots      R = B b(SINR of the worst hop) / (N + 1)    one frequency, equal time slots, as the paper assumes
//! channels   R = B b(SINR of the worst hop)              a frequency for each hop
//! fitted     1 / R = sum over hops of 1 / (B b(SINR))    one frequency, each slot as long as its hop needs
//! ```
//!
//! These formulas are defined only here ([`Radio::chain_bps`]).
//!
//! If data goes both ways, each direction has half of the time: two slots for each hop. A chain can be planned for both
//! directions ([`Scenario::reverse`] r > 0), with r times as much data back to Tx as to Rx. Its fitted slots are as
//! long as the data of both directions needs ([`Radio::both_bps`]):
//!
//! ```text
//! fitted     1 / R = sum over hops of (1 / (B b(F)) + r / (B b(B)))      R to Rx and r R back, with the SINRs F and B of a hop
//! ```
//!
//! A chain is better if min(R to Rx, R back / r) is larger ([`worse_bps`]).

use std::fmt;

use serde::Deserialize;

use crate::Scenario;
use crate::number::factor;

/// Medium access: how the hops of a chain share frequencies and time.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Access {
    /// A single frequency for all hops. Each of the N + 1 hops has one of N + 1 equal time slots.
    #[default]
    Slots,
    /// A frequency of its own for each hop. All hops send at the same time.
    Channels,
    /// A single frequency for all hops, with time slots of different lengths.
    ///
    /// A hop's time slot is as long as the hop needs to carry the same amount of data as every other hop.
    Fitted,
}

impl Access {
    /// Names of the access methods in scenario files.
    pub const NAMES: &'static [&'static str] = &["slots", "channels", "fitted"];

    /// Returns the name of the access method in scenario files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Slots => "slots",
            Self::Channels => "channels",
            Self::Fitted => "fitted",
        }
    }

    /// Returns the number of time slots in which every hop sends once, or once each way if `both_ways`.
    ///
    /// If each hop has its own frequency, one slot per direction suffices, because all hops send at once.
    pub const fn slots(self, relays: u16, both_ways: bool) -> u32 {
        let hops = match self {
            Self::Slots | Self::Fitted => relays as u32 + 1,
            Self::Channels => 1,
        };
        if both_ways { 2 * hops } else { hops }
    }
}

/// A modulation and coding scheme of a radio: the SINR that it needs and its spectral efficiency.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RateStep {
    /// Lowest SINR at which the modulation and coding scheme works, dB, -60 to 90.
    pub sinr_db: f64,
    /// Spectral efficiency of the modulation and coding scheme, bit/s/Hz, above 0 and at most 100.
    pub bits_per_hz: f64,
}

/// Spectral efficiency of a hop as a function of its SINR.
#[derive(Debug, Clone, PartialEq)]
pub enum RateModel {
    /// Shannon's formula with a gap: log2(1 + SINR / gap) bit/s/Hz.
    Shannon {
        /// Loss of SINR relative to Shannon's limit, dB, 0 to 30.
        gap_db: f64,
    },
    /// Table of modulation and coding schemes. SINR and spectral efficiency increase strictly.
    ///
    /// A hop uses the last scheme in the table whose SINR it reaches. Below the first SINR its spectral efficiency is
    /// 0.
    Steps(Vec<RateStep>),
}

impl Default for RateModel {
    fn default() -> Self {
        Self::Shannon { gap_db: 0.0 }
    }
}

impl RateModel {
    /// Returns the spectral efficiency, bit/s/Hz, of a hop with the linear SINR `sinr`.
    pub fn bits_per_hz(&self, sinr: f64) -> f64 {
        match self {
            // `libm` gives the same result on every machine.
            Self::Shannon { gap_db } => {
                libm::log1p(sinr / factor(*gap_db)) / std::f64::consts::LN_2
            }
            Self::Steps(steps) => {
                let met = steps.iter().rfind(|step| sinr >= factor(step.sinr_db));
                met.map_or(0.0, |step| step.bits_per_hz)
            }
        }
    }

    /// Returns the lowest SINR (linear) that carries `bits_per_hz` bit/s/Hz. `None` if no SINR does.
    ///
    /// `bits_per_hz` must be above 0.
    pub fn sinr(&self, bits_per_hz: f64) -> Option<f64> {
        match self {
            Self::Shannon { gap_db } => {
                let sinr = libm::expm1(bits_per_hz * std::f64::consts::LN_2) * factor(*gap_db);
                sinr.is_finite().then_some(sinr)
            }
            Self::Steps(steps) => {
                let met = steps.iter().find(|step| step.bits_per_hz >= bits_per_hz);
                met.map(|step| factor(step.sinr_db))
            }
        }
    }
}

/// Returns the data rate by which plans are compared, bit/s: that of the worse direction.
///
/// It is the smaller one of `there_bps`, the rate to Rx, and `back_bps` / `reverse`, the scaled rate to Tx. If
/// `reverse` is 0, it is `there_bps`.
pub fn worse_bps([there_bps, back_bps]: [f64; 2], reverse: f64) -> f64 {
    if reverse > 0.0 {
        there_bps.min(back_bps / reverse)
    } else {
        there_bps
    }
}

/// Data link of a scenario: how hops share the radio, its bandwidth and its spectral efficiency.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Link {
    /// Medium access: how the hops share frequencies and time.
    pub access: Access,
    /// Bandwidth of each frequency that the hops use, Hz, 1 to 1e12.
    ///
    /// `None` to use the scenario's noise bandwidth.
    pub bandwidth_hz: Option<f64>,
    /// Spectral efficiency of a hop as a function of its SINR.
    pub model: RateModel,
}

/// Data link of a chain with a known bandwidth. This type computes data rates from SIRs.
#[derive(Debug, Clone, PartialEq)]
pub struct Radio {
    /// Medium access and spectral efficiency. The bandwidth in this `Link` is ignored.
    pub link: Link,
    /// Bandwidth of one frequency, Hz, 1 to 1e12.
    pub bandwidth_hz: f64,
}

/// Error: the bandwidth is missing, or given twice with different values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum BandwidthError {
    /// Neither the command's option nor the scenario gives a bandwidth.
    Missing,
    /// The command's option and the scenario give different bandwidths.
    Contradicts {
        /// Bandwidth in the command's option, Hz.
        option_hz: f64,
        /// Bandwidth in the scenario's `[link]`, Hz.
        file_hz: f64,
    },
}

impl fmt::Display for BandwidthError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => f.write_str(
                "the bandwidth is missing; give --bandwidth-hz, link.bandwidth_hz or noise.bandwidth_hz, 1 to 1e12 Hz",
            ),
            Self::Contradicts { option_hz, file_hz } => write!(
                f,
                "--bandwidth-hz {option_hz:?}: contradicts link.bandwidth_hz = {file_hz:?} of the scenario; leave one of the two out"
            ),
        }
    }
}

impl std::error::Error for BandwidthError {}

impl Radio {
    /// Creates the data link of `scenario`; without `[link]` in the file, the defaults of `[link]` apply.
    ///
    /// `option_hz` is the bandwidth in a command's option; `None` uses the bandwidth in the scenario.
    ///
    /// # Errors
    /// [`BandwidthError`] if neither gives a bandwidth, or if both give bandwidths that differ.
    pub fn new(scenario: &Scenario, option_hz: Option<f64>) -> Result<Self, BandwidthError> {
        let link = scenario.link.clone().unwrap_or_default();
        if let (Some(option_hz), Some(file_hz)) = (option_hz, link.bandwidth_hz)
            && option_hz.total_cmp(&file_hz).is_ne()
        {
            return Err(BandwidthError::Contradicts { option_hz, file_hz });
        }
        let bandwidth_hz = option_hz.or_else(|| scenario.bandwidth_hz());
        Ok(Self {
            link,
            bandwidth_hz: bandwidth_hz.ok_or(BandwidthError::Missing)?,
        })
    }

    /// Returns the data rate of a hop in its own time slot, bit/s, from its linear SIR.
    ///
    /// The interference is treated as noise.
    pub fn hop_bps(&self, sir: f64) -> f64 {
        self.bandwidth_hz * self.link.model.bits_per_hz(sir)
    }

    /// Returns the data rate of a chain in one direction, bit/s, from the linear SIR of each of its hops.
    ///
    /// The rate is 0 if `sirs` is empty, or if the rate of any hop is 0.
    pub fn chain_bps(&self, sirs: &[f64]) -> f64 {
        let rates = || sirs.iter().map(|sir| self.hop_bps(*sir));
        let worst = rates().reduce(f64::min).unwrap_or(0.0);
        match self.link.access {
            Access::Slots => worst / sirs.len().max(1) as f64,
            Access::Channels => worst,
            Access::Fitted if worst > 0.0 => 1.0 / rates().map(|rate| 1.0 / rate).sum::<f64>(),
            Access::Fitted => 0.0,
        }
    }

    /// Returns the data rates to Rx and back to Tx, bit/s, of a chain that sends in both directions.
    ///
    /// `there` and `back` are the linear SIRs of the hops toward Rx and toward Tx. `reverse` is the planned rate to Tx
    /// divided by the planned rate to Rx. With fitted slots and `reverse` above 0, the returned rates have this ratio.
    /// Otherwise each direction gets half of the time.
    pub fn both_bps(&self, there: &[f64], back: &[f64], reverse: f64) -> [f64; 2] {
        if reverse > 0.0 && self.link.access == Access::Fitted {
            let time = |sirs| match self.chain_bps(sirs) {
                rate_bps if rate_bps > 0.0 => 1.0 / rate_bps,
                _ => f64::INFINITY,
            };
            let rate_bps = 1.0 / (time(there) + reverse * time(back));
            return [rate_bps, reverse * rate_bps];
        }
        [there, back].map(|sirs| self.chain_bps(sirs) / 2.0)
    }

    /// Returns a description of how `hops` hops share the radio, without a full stop.
    pub fn sharing(&self, hops: usize) -> String {
        match self.link.access {
            Access::Slots => {
                format!("{hops} hops share one frequency in {hops} equal time slots")
            }
            Access::Channels => format!("each of the {hops} hops has its own frequency"),
            Access::Fitted => {
                format!(
                    "{hops} hops share one frequency in time slots of different length, fitted to each hop"
                )
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Access, BandwidthError, Link, Radio, RateModel, RateStep, worse_bps};
    use crate::Scenario;

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
    }

    #[test]
    fn access_divides_the_rates_of_the_hops() {
        let rate = |access, sirs: &[f64]| {
            let radio = Radio {
                link: Link {
                    access,
                    bandwidth_hz: None,
                    model: steps(),
                },
                bandwidth_hz: 1e6,
            };
            radio.chain_bps(sirs)
        };
        // The rates of the three hops are 2, 0.5 and 2 Mbit/s.
        let sirs = [10.0, 1.0, 20.0];
        assert!((rate(Access::Slots, &sirs) - 5e5 / 3.0).abs() < 1e-6);
        assert!((rate(Access::Channels, &sirs) - 5e5).abs() < 1e-6);
        assert!((rate(Access::Fitted, &sirs) - 1e6 / 3.0).abs() < 1e-6);
        for access in [Access::Slots, Access::Channels, Access::Fitted] {
            assert!(rate(access, &[10.0, 0.9]).abs() < f64::EPSILON);
            assert!(rate(access, &[]).abs() < f64::EPSILON);
        }
    }

    #[test]
    fn an_efficiency_needs_an_sinr() {
        let model = RateModel::Shannon { gap_db: 3.0 };
        for bits in [1e-6, 0.3, 8.0] {
            let again = model.bits_per_hz(model.sinr(bits).unwrap());
            assert!((again / bits - 1.0).abs() < 1e-12, "{bits} {again}");
        }
        assert_eq!(model.sinr(1e4), None);
        let found = [0.1, 0.5, 0.6, 2.0, 2.1].map(|bits| steps().sinr(bits));
        assert_eq!(found, [Some(1.0), Some(1.0), Some(10.0), Some(10.0), None]);
    }

    #[test]
    fn both_directions_share_the_time() {
        let radio = |access| Radio {
            link: Link {
                access,
                bandwidth_hz: None,
                model: steps(),
            },
            bandwidth_hz: 1e6,
        };
        // The rates of the two hops are 2 and 2 Mbit/s toward Rx, and 0.5 and 2 Mbit/s back.
        let (there, back) = ([10.0, 10.0], [1.0, 10.0]);
        let is = |access, reverse, expected: [f64; 2]| {
            let found = radio(access).both_bps(&there, &back, reverse);
            let near = found
                .iter()
                .zip(expected)
                .all(|(a, b)| (a - b).abs() < 1e-6);
            assert!(near, "{access:?} {reverse}: {found:?}");
        };
        for reverse in [0.0, 0.5] {
            is(Access::Slots, reverse, [5e5, 1.25e5]);
            is(Access::Channels, reverse, [1e6, 2.5e5]);
        }
        is(Access::Fitted, 0.0, [5e5, 2e5]);
        // One Mbit takes 1 s to Rx, and half a Mbit takes 1.25 s back to Tx.
        is(Access::Fitted, 0.5, [1e6 / 2.25, 0.5e6 / 2.25]);
        assert!((worse_bps([4.0, 1.0], 0.5) - 2.0).abs() < 1e-12);
        assert!((worse_bps([4.0, 1.0], 0.0) - 4.0).abs() < 1e-12);
        let none = radio(Access::Fitted).both_bps(&there, &[0.1, 10.0], 0.5);
        assert!(none.iter().all(|rate| rate.abs() < 1e-12), "{none:?}");
    }

    #[test]
    fn a_rate_needs_one_bandwidth() {
        let mut scenario = Scenario::default();
        assert_eq!(Radio::new(&scenario, None), Err(BandwidthError::Missing));
        let own = Radio::new(&scenario, Some(2e6)).unwrap();
        assert!((own.bandwidth_hz - 2e6).abs() < f64::EPSILON);
        scenario.link = Some(Link {
            bandwidth_hz: Some(1e6),
            ..Link::default()
        });
        assert!(Radio::new(&scenario, None).is_ok());
        assert!(Radio::new(&scenario, Some(1e6)).is_ok());
        let differs = Radio::new(&scenario, Some(2e6)).unwrap_err();
        assert!(
            differs
                .to_string()
                .starts_with("--bandwidth-hz 2000000.0: contradicts link.bandwidth_hz = 1000000.0")
        );
    }
}
