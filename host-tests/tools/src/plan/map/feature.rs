//! Map features of a plan and their geographic coordinates.

use std::fmt;

use uav_relay::{Geodetic, Placement};
use uav_relay_scenario::{Line, Scenario};

use crate::plan::found::Plan;

/// A feature of the map.
#[derive(Clone, PartialEq, Debug)]
pub struct Feature {
    /// Label.
    pub name: String,
    /// `tx`, `rx`, `relay`, `interferer` or `hop`.
    pub kind: &'static str,
    /// Coordinates: one point, or the two ends of a hop.
    pub at: Vec<Geodetic>,
    /// Numbers of the feature, by names that end in the unit.
    pub numbers: Vec<(&'static str, Number)>,
}

/// A number, rounded for display.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Number {
    /// A count.
    Whole(u16),
    /// A measure, rounded to three decimals: a millimetre, or a thousandth of a decibel.
    Rounded(f64),
    /// A ratio, rounded to six decimals.
    Ratio(f64),
}

impl Number {
    /// Returns the rounded value; counts are exact.
    pub(super) fn rounded(self) -> f64 {
        let (value, decimals) = match self {
            Self::Whole(count) => return f64::from(count),
            Self::Rounded(value) => (value, 1e3),
            Self::Ratio(value) => (value, 1e6),
        };
        // Adding 0 turns -0 into 0.
        (value * decimals).round() / decimals + 0.0
    }
}

impl fmt::Display for Number {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(count) => count.fmt(f),
            other => other.rounded().fmt(f),
        }
    }
}

/// A plan as map features.
#[derive(Clone, PartialEq, Debug)]
pub struct Map {
    /// Sites, relays, interferers, then the hops from Tx on.
    pub features: Vec<Feature>,
    /// Height of the mean sea level above the ellipsoid, m, if the scenario states it.
    pub geoid_m: Option<f64>,
    /// Numbers (from 1) of interferers too far from the line for geographic coordinates.
    pub left_out: Vec<usize>,
}

impl Map {
    /// Creates the map of `plan`.
    ///
    /// # Errors
    /// A line that says what the scenario lacks.
    pub fn new(scenario: &Scenario, plan: &Plan) -> Result<Self, String> {
        let line = scenario.line.as_ref().ok_or(
            "site: is missing; allowed: [site] with tx and rx, each { lat_deg, lon_deg, amsl_m }, which say where on earth the line is",
        )?;
        let [tx, rx] = line.sites;
        let site = |name: &str, kind, at| Feature {
            name: name.to_owned(),
            kind,
            at: vec![at],
            numbers: Vec::new(),
        };
        let mut features = vec![site("Tx", "tx", tx), site("Rx", "rx", rx)];
        let mut ends = vec![tx];
        for (index, (place, profile)) in (1..).zip(&plan.places) {
            let at = point(line, *place)
                .ok_or_else(|| format!("relay {index} is too far from the line"))?;
            ends.push(at);
            features.push(Feature {
                name: format!("relay {index}"),
                kind: "relay",
                at: vec![at],
                numbers: vec![
                    ("index", Number::Whole(index)),
                    ("x_m", Number::Rounded(place.x_m.into())),
                    ("y_m", Number::Rounded(place.y_m.into())),
                    ("h_m", Number::Rounded(place.altitude_m.into())),
                    ("eirp_dbm", Number::Rounded(dbm(profile.power_w.into()))),
                ],
            });
        }
        ends.push(rx);
        let mut left_out = Vec::new();
        for (number, (power_w, x_m, y_m)) in (1..).zip(scenario.sources()) {
            #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
            let ground = Placement {
                x_m: x_m as f32,
                y_m: y_m as f32,
                altitude_m: 0.0,
            };
            let Some(at) = point(line, ground) else {
                left_out.push(number);
                continue;
            };
            features.push(Feature {
                name: format!("interferer {number}"),
                kind: "interferer",
                at: vec![at],
                numbers: vec![
                    ("x_m", Number::Rounded(x_m)),
                    ("y_m", Number::Rounded(y_m)),
                    ("eirp_dbm", Number::Rounded(dbm(power_w))),
                ],
            });
        }
        let hops = ends.iter().zip(ends.iter().skip(1)).zip(&plan.sirs);
        for (number, ((from, to), sir)) in (1..).zip(hops) {
            features.push(Feature {
                name: format!("hop {number}: {:.2} dB", 10.0 * sir.log10()),
                kind: "hop",
                at: vec![*from, *to],
                numbers: vec![
                    ("hop", Number::Whole(number)),
                    ("sir_ratio", Number::Ratio(*sir)),
                    ("sir_db", Number::Rounded(10.0 * sir.log10())),
                ],
            });
        }
        Ok(Self {
            features,
            geoid_m: line.geoid_m,
            left_out,
        })
    }
}

fn point(line: &Line, place: Placement) -> Option<Geodetic> {
    line.axis.point(place)
}

fn dbm(power_w: f64) -> f64 {
    10.0 * power_w.log10() + 30.0
}

/// Returns longitude and latitude, degrees, and the height above mean sea level, m.
pub(super) fn position(at: Geodetic) -> [f64; 3] {
    [
        f64::from(at.lon_e7) / 1e7,
        f64::from(at.lat_e7) / 1e7,
        f64::from(at.amsl_mm) / 1e3,
    ]
}
