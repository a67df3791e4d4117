//! What a mission's chain can meet, in f64 and by the formulas of the reference alone.

use uav_relay_oracle::reference::joint::Place;
use uav_relay_oracle::reference::stochastic::StochasticLink;
use uav_relay_oracle::reference::{Link, Station};

/// How far above the best a target may be, relative: the rounding of f32 arithmetic.
const ABOVE: f64 = 1e-4;

/// The chain of a mission.
#[derive(Debug)]
pub(crate) enum Judge {
    /// With an interferer at a known place.
    Source {
        link: Link,
        /// The best that its relays can have, within their altitudes.
        optimum: f64,
    },
    /// In a field of interference.
    Field(StochasticLink),
}

impl Judge {
    /// SIRs of the N + 1 hops; those from or to a relay without a place mean nothing.
    pub(crate) fn hops(&self, places: &[Option<Place>]) -> Vec<f64> {
        let x: Vec<f64> = places
            .iter()
            .map(|place| place.map_or(0.0, |at| at.x_m))
            .collect();
        match self {
            Self::Source { link, .. } => {
                let stations = link.relays.iter().zip(places);
                let relays = stations.map(|(relay, place)| Station {
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

    /// How many times the SIR at `x_m` is what it would be with that Upsilon there, 1/W: 1 where it was agreed on.
    pub(crate) fn louder(&self, x_m: f64, measured_per_w: f64) -> f64 {
        match self {
            Self::Source { .. } => 1.0,
            Self::Field(link) => measured_per_w / link.upsilon_at(x_m),
        }
    }

    /// Whether there may be a chain that meets `target`, relays having measured no Upsilon above `measured_per_w`, 1/W.
    pub(crate) fn may_meet(&self, target: f64, measured_per_w: Option<f64>) -> bool {
        match self {
            Self::Source { optimum, .. } => target <= optimum * (1.0 + ABOVE),
            Self::Field(link) => match measured_per_w {
                // No hop is worse for an Upsilon that is larger everywhere.
                Some(measured) => {
                    let all = link.upsilon.iter().map(|(_, upsilon)| *upsilon);
                    let even = StochasticLink {
                        upsilon: vec![(0.0, all.fold(measured, f64::max))],
                        ..link.clone()
                    };
                    even.iid_optimum()
                        .is_some_and(|best| target <= best * (1.0 + ABOVE))
                }
                None => target <= link.best() * (1.0 + ABOVE),
            },
        }
    }
}
