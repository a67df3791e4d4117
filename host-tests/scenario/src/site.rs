//! Geographic positions of Tx and Rx, and the distance between them.

use serde::Deserialize;
use uav_relay::Geodetic;
use uav_relay::flight::axis::{Axis, AxisError};

use crate::check::mistake;
use crate::error::{Problem, ScenarioError};
use crate::keys::number;
use crate::spec::Line;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSites {
    tx: RawSite,
    rx: RawSite,
    geoid_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawSite {
    lat_deg: f64,
    lon_deg: f64,
    amsl_m: f64,
}

/// Returns the geographic line, if there are sites, and the distance from Tx to Rx. The given one, or that of the sites.
pub(super) fn line(
    file: &str,
    sites: Option<RawSites>,
    distance_m: Option<f64>,
) -> Result<(Option<Line>, f64), ScenarioError> {
    let Some(sites) = sites else {
        let missing = || {
            let allowed = "a number, 1 to 1e6 m, or [site]".to_owned();
            mistake(file, "geometry.distance_m", None, Problem::Missing, allowed)
        };
        return distance_m.map(|given| (None, given)).ok_or_else(missing);
    };
    let line = on_earth(file, &sites)?;
    let along = line.axis.distance_m();
    match distance_m {
        #[expect(clippy::cast_possible_truncation, reason = "as a mission has it")]
        Some(given) if !line.axis.is_of(given as f32) => {
            let allowed = format!("{along:.3} m, as [site] has it, or none");
            Err(mistake(
                file,
                "geometry.distance_m",
                Some(number(given)),
                Problem::OtherDistance,
                allowed,
            ))
        }
        _ => Ok((Some(line), along)),
    }
}

fn on_earth(file: &str, sites: &RawSites) -> Result<Line, ScenarioError> {
    let geoid_m = sites.geoid_m;
    let sites @ [tx, rx] = [&sites.tx, &sites.rx].map(|site| {
        // The ranges have been checked.
        Geodetic::from_degrees(site.lat_deg, site.lon_deg, site.amsl_m).unwrap_or_default()
    });
    let axis = Axis::try_new(tx, rx).map_err(|error| {
        let value = match error {
            AxisError::TooShort { distance_m } | AxisError::TooLong { distance_m } => {
                format!("{distance_m:.2} m from tx to rx")
            }
            AxisError::Tx(_) | AxisError::Rx(_) => error.to_string(),
        };
        let allowed = "10 to 1e5 m".to_owned();
        mistake(file, "site", Some(value), Problem::OutOfRange, allowed)
    })?;
    Ok(Line {
        axis,
        sites,
        geoid_m,
    })
}
