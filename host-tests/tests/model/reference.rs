//! Performance that a mission's chain can reach, in f64 and by the reference formulas alone.

use uav_relay_oracle::reference::joint::Place;
use uav_relay_oracle::reference::stochastic::StochasticLink;
use uav_relay_oracle::reference::{Link, Relay};

/// Largest relative excess of an agreed target SIR over the optimum that f32 rounding may cause.
const ABOVE: f64 = 1e-4;

/// Reference model of a mission's chain, in f64.
#[derive(Debug)]
pub(crate) enum Reference {
    /// Chain with an interferer at a known position.
    Source {
        link: Link,
        /// Highest target SIR within the relays' altitude limits.
        optimum: f64,
    },
    /// Chain in a field of interference (a distribution along x).
    Field(StochasticLink),
}

impl Reference {
    /// Returns the SIRs of the N + 1 hops. The SIRs of the hops at a relay without a position are meaningless.
    pub(crate) fn hops(&self, places: &[Option<Place>]) -> Vec<f64> {
        let x: Vec<f64> = places
            .iter()
            .map(|place| place.map_or(0.0, |at| at.x_m))
            .collect();
        match self {
            Self::Source { link, .. } => {
                let stations = link.relays.iter().zip(places);
                let relays = stations.map(|(relay, place)| Relay {
                    altitude_m: place.map_or(relay.altitude_m, |at| at.altitude_m),
                    ..*relay
                });
                let flown = Link {
                    relays: relays.collect(),
                    ..link.clone()
                };
                flown.sir_hops(&x)
            }
            Self::Field(link) => link.hop_sirs(&x),
        }
    }

    /// Returns the SIR at `x_m` by the measured Upsilon, divided by the SIR by the true Upsilon.
    ///
    /// Upsilon = E[1/I], with the interference power I. `measured_per_w` is the measured Upsilon in 1/W. Returns 1
    /// for a known interferer.
    pub(crate) fn sir_ratio(&self, x_m: f64, measured_per_w: f64) -> f64 {
        match self {
            Self::Source { .. } => 1.0,
            Self::Field(link) => measured_per_w / link.upsilon_at(x_m),
        }
    }

    /// Returns true if a chain can meet `target`, given the largest Upsilon = E[1/I] that a relay measured.
    /// `measured_per_w` is that Upsilon in 1/W, or `None` without a measurement.
    pub(crate) fn can_meet(&self, target: f64, measured_per_w: Option<f64>) -> bool {
        match self {
            Self::Source { optimum, .. } => target <= optimum * (1.0 + ABOVE),
            Self::Field(link) => match measured_per_w {
                // No hop gets worse when Upsilon is larger everywhere.
                Some(measured) => {
                    let all = link.upsilon.iter().map(|(_, upsilon)| *upsilon);
                    let even = StochasticLink {
                        upsilon: vec![(0.0, all.fold(measured, f64::max))],
                        ..link.clone()
                    };
                    even.iid_optimum()
                        .is_some_and(|best| target <= best * (1.0 + ABOVE))
                }
                None => target <= link.best_apart(0.0) * (1.0 + ABOVE),
            },
        }
    }
}
