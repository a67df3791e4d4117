//! Error for an invalid pair of sites.

use crate::geodetic::Geodetic;

/// Minimum length of a line, at which one unit of latitude turns it by a thousandth.
#[cfg_attr(
    not(feature = "internals"),
    allow(unreachable_pub, reason = "public with the feature `internals`")
)]
pub const SHORTEST_M: f64 = 10.0;

/// Maximum length of a line for which the accuracy is known.
#[cfg_attr(
    not(feature = "internals"),
    allow(unreachable_pub, reason = "public with the feature `internals`")
)]
pub const LONGEST_M: f64 = 100_000.0;

/// Reason why a pair of sites is rejected.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisError {
    /// The latitude or longitude of the transmitter is not on earth.
    Tx(Geodetic),
    /// The latitude or longitude of the receiver is not on earth.
    Rx(Geodetic),
    /// The sites are less than 10 m apart.
    TooShort {
        /// The distance, m.
        distance_m: f64,
    },
    /// The sites are more than 100 km apart.
    TooLong {
        /// Length of the chord, m.
        distance_m: f64,
    },
}

impl core::fmt::Display for AxisError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let site = |f: &mut core::fmt::Formatter<'_>, name, site: &Geodetic| {
            let Geodetic { lat_e7, lon_e7, .. } = site;
            write!(
                f,
                "site {name}: latitude {lat_e7} and longitude {lon_e7} in 1e-7 degrees: allowed are ±900000000 and ±1800000000"
            )
        };
        match self {
            Self::Tx(at) => site(f, "tx", at),
            Self::Rx(at) => site(f, "rx", at),
            Self::TooShort { distance_m } => write!(
                f,
                "the sites are {distance_m:.2} m apart: allowed are {SHORTEST_M} to {LONGEST_M} m"
            ),
            Self::TooLong { distance_m } => write!(
                f,
                "the sites are {distance_m:.0} m apart: allowed are {SHORTEST_M} to {LONGEST_M} m"
            ),
        }
    }
}

impl core::error::Error for AxisError {}
