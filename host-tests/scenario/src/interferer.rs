//! Interferers: powers and positions, along the line or geographic.

use serde::Deserialize;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};

use crate::check::mistake;
use crate::error::{Problem, ScenarioError};
use crate::keys::number;
use crate::power::Said;
use crate::spec::{Line, Source};

/// Largest change of interference, dB, by ignoring an interferer's height. It holds anywhere that relays or Rx may be.
const MOST_OFF_DB: f64 = 1.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSource {
    power_w: Option<f64>,
    power_dbm: Option<f64>,
    gain_dbi: Option<f64>,
    eirp_dbm: Option<f64>,
    x_m: Option<f64>,
    y_m: Option<f64>,
    lat_deg: Option<f64>,
    lon_deg: Option<f64>,
    amsl_m: Option<f64>,
}

pub(super) struct Room<'a> {
    pub(super) line: Option<&'a Line>,
    pub(super) distance_m: f64,
    pub(super) altitudes_m: [f64; 2],
    pub(super) lateral_m: [f64; 2],
}

/// Returns the interferers of a file whose keys have been checked.
pub(super) fn sources(
    file: &str,
    raw: &[RawSource],
    room: &Room,
) -> Result<Vec<Source>, ScenarioError> {
    let each = raw.iter().enumerate();
    each.map(|(at, raw)| {
        let table = format!("interferer[{at}].");
        let said = Said {
            table: &table,
            in_w: ("power_w", raw.power_w),
            in_dbm: ("power_dbm", raw.power_dbm),
            eirp: ("eirp_dbm", raw.eirp_dbm),
            gain: ("gain_dbi", raw.gain_dbi),
        };
        let power_w = said.of_source(file)?.unwrap_or_default();
        let (x_m, y_m) = match (raw.lat_deg, raw.lon_deg) {
            (Some(lat), Some(lon)) => on_earth(file, &table, raw, [lat, lon], room)?,
            _ => (raw.x_m.unwrap_or_default(), raw.y_m.unwrap_or_default()),
        };
        Ok(Source { power_w, x_m, y_m })
    })
    .collect()
}

/// Converts geographic coordinates to a position along the line and to its right, m.
fn on_earth(
    file: &str,
    table: &str,
    raw: &RawSource,
    [lat_deg, lon_deg]: [f64; 2],
    room: &Room,
) -> Result<(f64, f64), ScenarioError> {
    let key = format!("{table}lat_deg");
    let value = format!("{lat_deg}, lon_deg = {lon_deg}");
    let fail = |problem, allowed: &str| {
        Err(mistake(
            file,
            &key,
            Some(value.clone()),
            problem,
            allowed.to_owned(),
        ))
    };
    let Some(line) = room.line else {
        let allowed = "x_m and y_m, or a [site] that says where the line is";
        return fail(Problem::NoSite, allowed);
    };
    let point = Geodetic::from_degrees(lat_deg, lon_deg, raw.amsl_m.unwrap_or_default());
    let Some(place) = point.and_then(|point| line.axis.place(point)) else {
        let allowed = format!(
            "up to {} m from the line of [site] and from its ends",
            Axis::AROUND_M
        );
        return fail(Problem::OutOfRange, &allowed);
    };
    let Placement {
        x_m,
        y_m,
        altitude_m,
    } = place;
    let (x_m, y_m) = (f64::from(x_m), f64::from(y_m));
    if let Some(amsl_m) = raw.amsl_m {
        let above_m = f64::from(altitude_m);
        let off_db = room.off_by_db(x_m, y_m, above_m);
        if off_db > MOST_OFF_DB {
            let value = format!(
                "{}, {above_m:.1} m above the straight line between the sites,",
                number(amsl_m)
            );
            let allowed = format!(
                "a height that changes the interference anywhere by at most {MOST_OFF_DB} dB, and this does by {off_db:.1} dB: \
                 interferers are on the ground; none, for one there"
            );
            let key = format!("{table}amsl_m");
            return Err(mistake(
                file,
                &key,
                Some(value),
                Problem::OutOfRange,
                allowed,
            ));
        }
    }
    Ok((x_m, y_m))
}

impl Room<'_> {
    /// Returns the largest difference, dB, of the interference by a source's height. The source is `above_m` over (`x_m`, `y_m`),
    /// or on the ground below.
    ///
    /// At a given altitude it is largest for the nearest relay position; altitudes are tried in steps. Rx is a further receiver.
    fn off_by_db(&self, x_m: f64, y_m: f64, above_m: f64) -> f64 {
        const STEPS: u32 = 64;
        let ratio_db = |beside_m: f64, h: f64| {
            let beside = beside_m * beside_m;
            let (ground, there) = (beside + h * h, beside + (h - above_m) * (h - above_m));
            (10.0 * (ground / there).log10()).abs()
        };
        let [low, high] = self.altitudes_m;
        let [left, right] = self.lateral_m;
        let nearest = (x_m - x_m.clamp(0.0, self.distance_m)).hypot(y_m - y_m.clamp(left, right));
        let at_relays = (0..=STEPS)
            .map(|step| low + (high - low) * f64::from(step) / f64::from(STEPS))
            .map(|h| ratio_db(nearest, h));
        // An interferer at Rx drowns it at any height.
        let at_rx = (x_m - self.distance_m).hypot(y_m);
        let at_rx = if at_rx > 0.0 {
            ratio_db(at_rx, 0.0)
        } else {
            0.0
        };
        at_relays.fold(at_rx, f64::max)
    }
}
