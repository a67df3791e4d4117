//! Typed content of a scenario file, and the checks that compare several of its keys.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use toml::Table;
use uav_relay::flight::axis::{Axis, AxisError};
use uav_relay::{Geodetic, Placement};

use super::area::{Area, NoFly, SourceArea};
use super::check::{internal_mismatch, mistake};
use super::error::{Problem, ScenarioError};
use super::keys::MOST_CORNERS;
use super::link::{Access, Link, RateModel, RateStep};
use super::number::{brief, factor, watts};
use super::spec::{
    AirGround, BetaPoint, ChannelSpec, Field, Interference, Line, ListenSpec, Noise, Planned,
    PlannedMethod, PlannedPlace, RelayOverride, Scenario, Source, TerrainSpec,
};

/// Content of a scenario file as serde reads it, before its keys are compared with each other.
///
/// Because of `deny_unknown_fields`, parsing fails if the table of allowed keys has a key that this type lacks.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFile {
    geometry: RawGeometry,
    power: RawPower,
    #[serde(default)]
    channel: RawChannel,
    interferer: Option<Vec<RawSource>>,
    #[serde(default)]
    no_fly: Vec<RawNoFly>,
    #[serde(default)]
    relay: Vec<RawRelay>,
    #[serde(default)]
    noise: RawNoise,
    link: Option<RawDataLink>,
    field: Option<RawField>,
    site: Option<RawSites>,
    listen: Option<RawListen>,
    terrain: Option<RawTerrain>,
    plan: Option<RawPlan>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTerrain {
    files: Vec<String>,
    mast_m: Option<f64>,
    above_ground_m: Option<f64>,
    above_ground_max_m: Option<f64>,
    error_m: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNoFly {
    area: Option<RawArea>,
    file: Option<String>,
    lowest_m: Option<f64>,
    highest_m: Option<f64>,
}

/// Area in a scenario file: exactly one of the keys below is given.
///
/// Keys that end in `_deg` have latitudes and longitudes, degrees. The other keys have x and y, m.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawArea {
    rectangle: Option<[[f64; 2]; 2]>,
    polygon: Option<Vec<[f64; 2]>>,
    circle: Option<[f64; 3]>,
    rectangle_deg: Option<[[f64; 2]; 2]>,
    polygon_deg: Option<Vec<[f64; 2]>>,
    circle_deg: Option<[f64; 3]>,
}

/// Power of an interferer: one value, or the least and the greatest value.
#[derive(Deserialize, Clone, Copy)]
#[serde(untagged)]
enum RawPowers {
    One(f64),
    Range([f64; 2]),
}

impl RawPowers {
    /// Returns the least power if the argument `end` is 0, and the greatest power if it is 1.
    fn end(self, end: usize) -> f64 {
        match self {
            Self::One(one) => one,
            Self::Range(range) => range.get(end).copied().unwrap_or_default(),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawListen {
    #[serde(default)]
    following: bool,
    every_s: Option<f64>,
    half_life_s: Option<f64>,
    relative_error: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(
    clippy::struct_field_names,
    reason = "the fields are the keys of the file"
)]
struct RawGeometry {
    distance_m: Option<f64>,
    altitude_m: f64,
    altitude_min_m: Option<f64>,
    altitude_max_m: Option<f64>,
    #[serde(default)]
    lateral_min_m: f64,
    #[serde(default)]
    lateral_max_m: f64,
    #[serde(default)]
    min_separation_m: f64,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawChannel {
    carrier_hz: Option<f64>,
    excess_loss_los_db: Option<f64>,
    excess_loss_nlos_db: Option<f64>,
    air_ground: Option<RawAirGround>,
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct RawNoise {
    bandwidth_hz: Option<f64>,
    figure_db: Option<f64>,
    power_dbm: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDataLink {
    access: Option<Access>,
    bandwidth_hz: Option<f64>,
    gap_db: Option<f64>,
    steps: Option<Vec<RateStep>>,
    reverse: Option<f64>,
}

impl RawDataLink {
    /// Returns true if `[link]` describes a data link: it is empty, or has a key other than `reverse`.
    const fn has_radio(&self) -> bool {
        self.access.is_some()
            || self.bandwidth_hz.is_some()
            || self.gap_db.is_some()
            || self.steps.is_some()
            || self.reverse.is_none()
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum RawAirGround {
    Link(RawLink),
    Weight(f64),
}

#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum RawLink {
    Los,
    Nlos,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawRelay {
    index: u16,
    altitude_m: Option<f64>,
    power_w: Option<f64>,
    power_dbm: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawField {
    i_max_w: f64,
    beta: Vec<RawBeta>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawBeta {
    x_m: f64,
    alpha: f64,
    beta: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPlan {
    uavs: u16,
    method: PlannedMethod,
    tolerance: f64,
    sir_db: f64,
    places: Vec<PlannedPlace>,
}

/// Converts the table of a file to [`RawFile`]. [`crate::check::table`] must have accepted the table.
pub(super) fn from_table(file: &str, table: &Table) -> Result<RawFile, ScenarioError> {
    let table = table.clone();
    table
        .try_into()
        .map_err(|error| internal_mismatch(file, &error))
}

/// Builds the scenario from a file's content. Returns an error if keys of the file contradict each other.
pub(super) fn build(file: &str, raw: RawFile) -> Result<Scenario, ScenarioError> {
    let geometry = raw.geometry;
    let altitude_m = geometry.altitude_m;
    let altitude_min_m = geometry.altitude_min_m.unwrap_or(altitude_m);
    let altitude_max_m = geometry.altitude_max_m.unwrap_or(altitude_m);
    let band = |key: &str, value, side: &str| {
        let allowed = format!("at {side} altitude_m, {} m", brief(altitude_m));
        Err(mistake(
            file,
            key,
            Some(brief(value)),
            Problem::OutOfRange,
            allowed,
        ))
    };
    if altitude_min_m > altitude_m {
        return band("geometry.altitude_min_m", altitude_min_m, "most");
    }
    if altitude_max_m < altitude_m {
        return band("geometry.altitude_max_m", altitude_max_m, "least");
    }
    let (line, distance_m) = line(file, raw.site, geometry.distance_m)?;
    let has_site = line.is_some();
    let powers = powers(file, &raw.power)?;
    let room = RelayArea {
        line: line.as_ref(),
        distance_m,
        altitudes_m: [altitude_min_m, altitude_max_m],
        lateral_m: [geometry.lateral_min_m, geometry.lateral_max_m],
    };
    let areas = source_areas(file, raw.interferer.as_deref().unwrap_or_default(), &room)?;
    let no_fly = no_fly(file, raw.no_fly, line.as_ref())?;
    let masts = raw.interferer.iter().flatten().enumerate();
    let masts_m = masts
        .filter_map(|(at, raw)| Some((at, raw.mast_m?)))
        .collect();
    let interference = interference(
        file,
        raw.interferer.as_deref(),
        raw.field,
        raw.listen.is_some(),
        &room,
        &areas,
    )?;
    Ok(Scenario {
        line,
        distance_m,
        altitude_m,
        altitude_min_m,
        altitude_max_m,
        lateral_min_m: geometry.lateral_min_m,
        lateral_max_m: geometry.lateral_max_m,
        min_separation_m: geometry.min_separation_m,
        tx_w: powers.tx_w,
        rx_w: powers.rx_w,
        uav_w: powers.uav_w,
        channel: channel(file, &raw.channel)?,
        interference,
        areas,
        masts_m,
        no_fly,
        listen: raw.listen.map(|raw| ListenSpec {
            following: raw.following,
            every_s: raw.every_s,
            half_life_s: raw.half_life_s,
            relative_error: raw.relative_error,
        }),
        noise: noise(&raw.noise, &powers),
        reverse: reverse(file, raw.link.as_ref().and_then(|link| link.reverse))?,
        link: raw
            .link
            .filter(RawDataLink::has_radio)
            .map(|link| data_link(file, link, raw.noise.bandwidth_hz))
            .transpose()?,
        relays: relays(file, raw.relay, powers.uav_gain_dbi)?,
        terrain: raw
            .terrain
            .as_ref()
            .map(|raw| terrain(file, raw, has_site))
            .transpose()?,
        plan: raw.plan.map(|plan| planned(file, plan)).transpose()?,
    })
}

/// Converts the `[terrain]` table of a file.
///
/// Paths of elevation files are relative to the folder of `file`.
fn terrain(file: &str, raw: &RawTerrain, has_site: bool) -> Result<TerrainSpec, ScenarioError> {
    if !has_site {
        let allowed = "a [site] with the geographic positions of Tx and Rx, or no [terrain]";
        return Err(mistake(
            file,
            "terrain",
            None,
            Problem::NoSite,
            allowed.to_owned(),
        ));
    }
    let folder = Path::new(file).parent().unwrap_or(Path::new(""));
    let default = TerrainSpec::of(raw.files.iter().map(|name| folder.join(name)).collect());
    let least = raw.above_ground_m.unwrap_or(default.above_ground_m);
    if let Some(most) = raw.above_ground_max_m.filter(|most| *most < least) {
        return Err(mistake(
            file,
            "terrain.above_ground_max_m",
            Some(brief(most)),
            Problem::OutOfRange,
            format!("at least above_ground_m, {} m", brief(least)),
        ));
    }
    Ok(TerrainSpec {
        mast_m: raw.mast_m.unwrap_or(default.mast_m),
        above_ground_m: least,
        above_ground_max_m: raw.above_ground_max_m,
        error_m: raw.error_m.unwrap_or(default.error_m),
        ..default
    })
}

fn noise(raw: &RawNoise, powers: &Powers) -> Noise {
    let default = Noise::default();
    Noise {
        bandwidth_hz: raw.bandwidth_hz.unwrap_or(default.bandwidth_hz),
        figure_db: raw.figure_db.unwrap_or(default.figure_db),
        power_dbm: raw.power_dbm,
        gains_dbi: [powers.uav_gain_dbi, powers.rx_gain_dbi],
    }
}

/// Smallest `link.reverse` above 0. A smaller value would be 0 in the missions of the relays, which have 32-bit floats.
const LEAST_REVERSE: f64 = 1e-9;

fn reverse(file: &str, reverse: Option<f64>) -> Result<f64, ScenarioError> {
    let reverse = reverse.unwrap_or(0.0);
    if reverse > 0.0 && reverse < LEAST_REVERSE {
        return Err(mistake(
            file,
            "link.reverse",
            Some(brief(reverse)),
            Problem::OutOfRange,
            format!("0.0, or {LEAST_REVERSE:e} to 1.0"),
        ));
    }
    Ok(reverse)
}

fn data_link(file: &str, raw: RawDataLink, noise_hz: Option<f64>) -> Result<Link, ScenarioError> {
    // A noise bandwidth of 0 means that there is no noise.
    if let (Some(own), Some(noise)) = (raw.bandwidth_hz, noise_hz.filter(|hz| *hz > 0.0))
        && own.total_cmp(&noise).is_ne()
    {
        return Err(mistake(
            file,
            "link.bandwidth_hz",
            Some(brief(own)),
            Problem::OtherBandwidth,
            format!(
                "{} Hz (noise.bandwidth_hz), or only one of the two keys",
                brief(noise)
            ),
        ));
    }
    let steps = raw.steps.unwrap_or_default();
    for (index, (before, here)) in (1..).zip(steps.iter().zip(steps.iter().skip(1))) {
        let pairs = [
            ("sinr_db", before.sinr_db, here.sinr_db, "90 dB"),
            (
                "bits_per_hz",
                before.bits_per_hz,
                here.bits_per_hz,
                "100 bit/s/Hz",
            ),
        ];
        for (key, before, here, most) in pairs {
            if here <= before {
                return Err(mistake(
                    file,
                    &format!("link.steps[{index}].{key}"),
                    Some(brief(here)),
                    Problem::Unsorted,
                    format!(
                        "above {} (the {key} of the previous entry) to {most}",
                        brief(before)
                    ),
                ));
            }
        }
    }
    Ok(Link {
        access: raw.access.unwrap_or_default(),
        bandwidth_hz: raw.bandwidth_hz,
        model: if steps.is_empty() {
            RateModel::Shannon {
                gap_db: raw.gap_db.unwrap_or_default(),
            }
        } else {
            RateModel::Steps(steps)
        },
    })
}

fn channel(file: &str, raw: &RawChannel) -> Result<ChannelSpec, ScenarioError> {
    let default = ChannelSpec::default();
    let spec = ChannelSpec {
        carrier_hz: raw.carrier_hz.unwrap_or(default.carrier_hz),
        excess_loss_los_db: raw.excess_loss_los_db.unwrap_or(default.excess_loss_los_db),
        excess_loss_nlos_db: raw
            .excess_loss_nlos_db
            .unwrap_or(default.excess_loss_nlos_db),
        air_ground: match raw.air_ground {
            Some(RawAirGround::Link(RawLink::Los)) => AirGround::Los,
            Some(RawAirGround::Link(RawLink::Nlos)) => AirGround::Nlos,
            Some(RawAirGround::Weight(weight)) => AirGround::Weight(weight),
            None => default.air_ground,
        },
    };
    let (los, nlos) = (spec.excess_loss_los_db, spec.excess_loss_nlos_db);
    if nlos >= los {
        return Ok(spec);
    }
    // The error must name a key that the file has.
    let (key, value, allowed) = match raw.excess_loss_nlos_db {
        Some(_) => (
            "channel.excess_loss_nlos_db",
            nlos,
            format!(
                "{} dB (the value of excess_loss_los_db) to 200 dB",
                brief(los)
            ),
        ),
        None => (
            "channel.excess_loss_los_db",
            los,
            format!(
                "0 to {} dB (the upper limit is the default of excess_loss_nlos_db)",
                brief(nlos)
            ),
        ),
    };
    Err(mistake(
        file,
        key,
        Some(brief(value)),
        Problem::OutOfRange,
        allowed,
    ))
}

fn interference(
    file: &str,
    raw: Option<&[RawSource]>,
    field: Option<RawField>,
    listens: bool,
    room: &RelayArea,
    areas: &BTreeMap<usize, SourceArea>,
) -> Result<Interference, ScenarioError> {
    let one = || "either one [field] or one or more [[interferer]]".to_owned();
    match (raw, field) {
        (None, None) if listens => Ok(Interference::Sources(Vec::new())),
        (None, Some(_)) if listens => Err(mistake(
            file,
            "listen",
            Some("[listen] together with a [field]".to_owned()),
            Problem::MeasuredField,
            "[listen] alone or together with [[interferer]]".to_owned(),
        )),
        (None, None) => Err(mistake(
            file,
            "interferer",
            None,
            Problem::NoInterference,
            one(),
        )),
        (Some(raw), Some(_)) => {
            let both = format!("[field] together with {} [[interferer]]", raw.len());
            Err(mistake(
                file,
                "field",
                Some(both),
                Problem::TwoInterferences,
                one(),
            ))
        }
        (Some(raw), None) => Ok(Interference::Sources(sources(file, raw, room, areas)?)),
        (None, Some(raw)) => {
            let points = raw.beta.into_iter();
            let beta: Vec<_> = points
                .map(|raw| BetaPoint {
                    x_m: raw.x_m,
                    alpha: raw.alpha,
                    beta: raw.beta,
                })
                .collect();
            for (index, (before, here)) in (1..).zip(beta.iter().zip(beta.iter().skip(1))) {
                if here.x_m <= before.x_m {
                    let key = format!("field.beta[{index}].x_m");
                    let allowed = format!(
                        "above {} (the x_m of the previous entry) to 1e7 m",
                        brief(before.x_m)
                    );
                    return Err(mistake(
                        file,
                        &key,
                        Some(brief(here.x_m)),
                        Problem::Unsorted,
                        allowed,
                    ));
                }
            }
            Ok(Interference::Field(Field {
                i_max_w: raw.i_max_w,
                beta,
            }))
        }
    }
}

fn relays(
    file: &str,
    raw: Vec<RawRelay>,
    gain_dbi: f64,
) -> Result<BTreeMap<u16, RelayOverride>, ScenarioError> {
    let mut relays = BTreeMap::new();
    for (place, raw) in raw.into_iter().enumerate() {
        let key = format!("relay[{place}].index");
        let fail = |problem, allowed| {
            Err(mistake(
                file,
                &key,
                Some(raw.index.to_string()),
                problem,
                allowed,
            ))
        };
        let table = format!("relay[{place}].");
        let said = GivenPower {
            table: &table,
            in_w: ("power_w", raw.power_w),
            in_dbm: ("power_dbm", raw.power_dbm),
            eirp: ("", None),
            gain: ("power.uav_gain_dbi", Some(gain_dbi)),
        };
        let power_w = said.chain_eirp_w(file)?;
        if raw.altitude_m.is_none() && power_w.is_none() {
            return fail(
                Problem::NothingDiffers,
                "an index, and at least one of altitude_m, power_w and power_dbm".to_owned(),
            );
        }
        let relay = RelayOverride {
            altitude_m: raw.altitude_m,
            power_w,
        };
        if relays.insert(raw.index, relay).is_some() {
            let allowed = "1 to 1000, each in only one [[relay]]".to_owned();
            return fail(Problem::DuplicateRelay, allowed);
        }
    }
    Ok(relays)
}

/// Converts the `[plan]` table of a file.
///
/// Returns an error unless the number of positions in the table is its number of relays `uavs`.
fn planned(file: &str, raw: RawPlan) -> Result<Planned, ScenarioError> {
    if raw.places.len() != usize::from(raw.uavs) {
        return Err(mistake(
            file,
            "plan.places",
            Some(format!("{} places", raw.places.len())),
            Problem::OtherNumber,
            format!("{} places, one for each of plan.uavs", raw.uavs),
        ));
    }
    Ok(Planned {
        uavs: raw.uavs,
        method: raw.method,
        tolerance: raw.tolerance,
        sir_db: raw.sir_db,
        places: raw.places,
    })
}

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

/// Returns the geographic line from Tx to Rx, and the distance from Tx to Rx, m.
///
/// With `[site]`, the distance is computed from the geographic positions of Tx and Rx, and a different `distance_m` is
/// an error. Without `[site]` the line is `None`, and the distance is `distance_m`.
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
    let line = line_on_earth(file, &sites)?;
    let along = line.axis.distance_m();
    match distance_m {
        #[expect(clippy::cast_possible_truncation, reason = "as a mission has it")]
        Some(given) if !line.axis.is_of(given as f32) => {
            let allowed =
                format!("{along:.3} m, the distance from Tx to Rx of [site], or no distance_m");
            Err(mistake(
                file,
                "geometry.distance_m",
                Some(brief(given)),
                Problem::OtherDistance,
                allowed,
            ))
        }
        _ => Ok((Some(line), along)),
    }
}

fn line_on_earth(file: &str, sites: &RawSites) -> Result<Line, ScenarioError> {
    let geoid_m = sites.geoid_m;
    let sites @ [tx, rx] = [&sites.tx, &sites.rx].map(|site| {
        // The check of the keys has already accepted these ranges.
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

// Data sheets give powers in W or dBm, and antenna gains. The model uses EIRPs.
//
// The channel model has only a path loss: of a sent power P, P / (mu d^2) is received. With antenna gains `G_t` and
// `G_r` (Friis) it is `P G_t G_r / (mu d^2)`. With the interferers' `P_i G_i` and the receiver's noise N, the SINR is
//
// ```text
// P G_t G_r / (mu d^2)                      P G_t / (mu d^2)
// --------------------------------  =  ------------------------------
// sum P_i G_i G_r / (mu_i d_i^2) + N   sum P_i G_i / (mu_i d_i^2) + N / G_r
// ```
//
// A sender's gain is therefore part of its power: the EIRP counts. A receiver's gain raises signal and interference
// alike, so it only divides the noise. Without noise it has no effect.
//
// A mission has one N for all receivers. If the gains of the relays and of Rx differ, the lower one is used: exact for receivers
// with that gain, and a lower bound on the SINR at the others.
//
// An antenna has the same gain in all directions; a null toward the interferer is not modelled.

/// Range of the EIRPs, W, that a mission accepts for Tx, Rx and relays.
const EIRP: [f64; 2] = [1e-6, 1e6];
/// Range of the EIRPs, W, that a mission accepts for interferers.
const SOURCE_EIRP: [f64; 2] = [1e-6, 1e9];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawPower {
    tx_w: Option<f64>,
    tx_dbm: Option<f64>,
    tx_gain_dbi: Option<f64>,
    tx_eirp_dbm: Option<f64>,
    uav_w: Option<f64>,
    uav_dbm: Option<f64>,
    uav_gain_dbi: Option<f64>,
    rx_w: Option<f64>,
    rx_dbm: Option<f64>,
    rx_gain_dbi: Option<f64>,
}

pub(super) struct Powers {
    pub(super) tx_w: f64,
    pub(super) rx_w: f64,
    pub(super) uav_w: f64,
    pub(super) uav_gain_dbi: f64,
    pub(super) rx_gain_dbi: f64,
}

/// Power of a sender in a scenario file: in W, in dBm, or as an EIRP.
///
/// Each field is a pair: the name of the power's key in the file, and the power if the file has this key.
pub(super) struct GivenPower<'a> {
    /// Prefix of a key's name in error messages, such as `interferer[0].`: the table's name and a dot.
    pub(super) table: &'a str,
    pub(super) in_w: (&'a str, Option<f64>),
    pub(super) in_dbm: (&'a str, Option<f64>),
    pub(super) eirp: (&'a str, Option<f64>),
    /// Antenna gain: the name of its key, and its value in dBi; `None` if the file has no value.
    pub(super) gain: (&'a str, Option<f64>),
}

impl GivenPower<'_> {
    fn eirp_w(&self, file: &str, [least, most]: [f64; 2]) -> Result<Option<f64>, ScenarioError> {
        let gain = self.gain.1.map_or(1.0, factor);
        let ((key, given), eirp_w) = match (self.in_w, self.in_dbm, self.eirp) {
            (said @ (_, Some(power_w)), _, _) => (said, power_w * gain),
            (_, said @ (_, Some(dbm)), _) => (said, watts(dbm) * gain),
            (_, _, said @ (_, Some(dbm))) => (said, watts(dbm)),
            _ => return Ok(None),
        };
        // A limit in dBm differs from the same limit in W by a rounding error.
        if (least * (1.0 - 1e-9)..=most * (1.0 + 1e-9)).contains(&eirp_w) {
            return Ok(Some(eirp_w.clamp(least, most)));
        }
        let (antenna, gain) = self.gain;
        let said = format!(
            "{} with {antenna} = {}, an EIRP of {eirp_w:.3e} W,",
            brief(given.unwrap_or_default()),
            brief(gain.unwrap_or_default())
        );
        let allowed = format!("an EIRP of {} to {} W", brief(least), brief(most));
        let key = format!("{}{key}", self.table);
        Err(mistake(
            file,
            &key,
            Some(said),
            Problem::OutOfRange,
            allowed,
        ))
    }

    pub(super) fn chain_eirp_w(&self, file: &str) -> Result<Option<f64>, ScenarioError> {
        self.eirp_w(file, EIRP)
    }

    pub(super) fn source_eirp_w(&self, file: &str) -> Result<Option<f64>, ScenarioError> {
        self.eirp_w(file, SOURCE_EIRP)
    }
}

pub(super) fn powers(file: &str, raw: &RawPower) -> Result<Powers, ScenarioError> {
    let table = "power.";
    let tx = GivenPower {
        table,
        in_w: ("tx_w", raw.tx_w),
        in_dbm: ("tx_dbm", raw.tx_dbm),
        eirp: ("tx_eirp_dbm", raw.tx_eirp_dbm),
        gain: ("tx_gain_dbi", raw.tx_gain_dbi),
    };
    let uav = GivenPower {
        table,
        in_w: ("uav_w", raw.uav_w),
        in_dbm: ("uav_dbm", raw.uav_dbm),
        eirp: ("", None),
        gain: ("uav_gain_dbi", raw.uav_gain_dbi),
    };
    let rx = GivenPower {
        table,
        in_w: ("rx_w", raw.rx_w),
        in_dbm: ("rx_dbm", raw.rx_dbm),
        eirp: ("", None),
        gain: ("rx_gain_dbi", raw.rx_gain_dbi),
    };
    let tx_w = tx.chain_eirp_w(file)?.unwrap_or_default();
    Ok(Powers {
        tx_w,
        rx_w: rx.chain_eirp_w(file)?.unwrap_or(tx_w),
        uav_w: uav.chain_eirp_w(file)?.unwrap_or_default(),
        uav_gain_dbi: raw.uav_gain_dbi.unwrap_or_default(),
        rx_gain_dbi: raw.rx_gain_dbi.unwrap_or_default(),
    })
}

/// Largest accepted error of the interference power, dB, from ignoring an interferer's height.
///
/// An interferer whose height causes a larger error is rejected. The error is checked at all positions that relays or
/// Rx may have.
const MAX_HEIGHT_ERROR_DB: f64 = 1.0;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawSource {
    power_w: Option<RawPowers>,
    power_dbm: Option<RawPowers>,
    gain_dbi: Option<f64>,
    eirp_dbm: Option<RawPowers>,
    area: Option<RawArea>,
    x_m: Option<f64>,
    y_m: Option<f64>,
    lat_deg: Option<f64>,
    lon_deg: Option<f64>,
    amsl_m: Option<f64>,
    mast_m: Option<f64>,
}

pub(super) struct RelayArea<'a> {
    pub(super) line: Option<&'a Line>,
    pub(super) distance_m: f64,
    pub(super) altitudes_m: [f64; 2],
    pub(super) lateral_m: [f64; 2],
}

impl RawSource {
    /// Returns the EIRP, W: the least EIRP if the argument `end` is 0, the greatest EIRP if it is 1.
    fn eirp_w(&self, file: &str, table: &str, end: usize) -> Result<f64, ScenarioError> {
        let of = |powers: Option<RawPowers>| powers.map(|powers| powers.end(end));
        let said = GivenPower {
            table,
            in_w: ("power_w", of(self.power_w)),
            in_dbm: ("power_dbm", of(self.power_dbm)),
            eirp: ("eirp_dbm", of(self.eirp_dbm)),
            gain: ("gain_dbi", self.gain_dbi),
        };
        Ok(said.source_eirp_w(file)?.unwrap_or_default())
    }
}

/// Converts the areas of the `[[interferer]]` tables.
///
/// The keys of the result are the indices of the tables. An area with Tx or Rx inside is an error.
fn source_areas(
    file: &str,
    raw: &[RawSource],
    room: &RelayArea,
) -> Result<BTreeMap<usize, SourceArea>, ScenarioError> {
    let mut areas = BTreeMap::new();
    for (at, raw) in raw.iter().enumerate() {
        let table = format!("interferer[{at}].");
        let powers = [
            ("power_w", raw.power_w),
            ("power_dbm", raw.power_dbm),
            ("eirp_dbm", raw.eirp_dbm),
        ];
        let Some(given) = &raw.area else {
            for (key, power) in powers {
                if let Some(RawPowers::Range([low, high])) = power {
                    let value = format!("[{}, {}]", brief(low), brief(high));
                    let allowed =
                        "one number; or a range, if the key area is also given".to_owned();
                    let key = format!("{table}{key}");
                    return Err(mistake(
                        file,
                        &key,
                        Some(value),
                        Problem::NeedsArea,
                        allowed,
                    ));
                }
            }
            continue;
        };
        let key = format!("{table}area");
        let area = given.area(file, &key, room.line)?;
        for (site, x_m) in [("Tx", 0.0), ("Rx", room.distance_m)] {
            let apart_m = area.distance_m([x_m, 0.0]);
            if apart_m < LEAST_APART_M {
                let value = format!("with {site} (x = {} m, y = 0)", brief(x_m));
                let allowed = format!(
                    "an area at least {LEAST_APART_M} m from Tx and Rx, because an interferer at {site} reduces the SIR there to 0; this one is {apart_m:.4} m from {site}"
                );
                return Err(mistake(
                    file,
                    &key,
                    Some(value),
                    Problem::ContainsSite,
                    allowed,
                ));
            }
        }
        let least_w = raw.eirp_w(file, &table, 0)?;
        areas.insert(at, SourceArea { area, least_w });
    }
    Ok(areas)
}

impl RawArea {
    fn area(&self, file: &str, key: &str, line: Option<&Line>) -> Result<Area, ScenarioError> {
        let from_two = |[[a, b], [c, d]]: [[f64; 2]; 2]| vec![[a, b], [c, b], [c, d], [a, d]];
        let to_circle = |centre, radius_m| Ok(Area::Circle { centre, radius_m });
        let (kind, corners) = match self {
            Self {
                circle: Some([x, y, r]),
                ..
            } => return to_circle([*x, *y], *r),
            Self {
                circle_deg: Some([lat, lon, r]),
                ..
            } => {
                let key = format!("{key}.circle_deg");
                return to_circle(near_line(file, &key, line, [*lat, *lon])?, *r);
            }
            Self {
                rectangle: Some(two),
                ..
            } => ("rectangle", from_two(*two)),
            Self {
                polygon: Some(corners),
                ..
            } => ("polygon", corners.clone()),
            Self {
                rectangle_deg: Some(two),
                ..
            } => ("rectangle_deg", from_two(*two)),
            Self {
                polygon_deg: Some(corners),
                ..
            } => ("polygon_deg", corners.clone()),
            _ => ("polygon", Vec::new()),
        };
        let key = format!("{key}.{kind}");
        let corners = if kind.ends_with("_deg") {
            let each = corners.iter().enumerate();
            each.map(|(at, point)| near_line(file, &format!("{key}[{at}]"), line, *point))
                .collect::<Result<_, _>>()?
        } else {
            corners
        };
        polygon(file, &key, corners)
    }
}

fn polygon(file: &str, key: &str, corners: Vec<[f64; 2]>) -> Result<Area, ScenarioError> {
    Area::polygon(corners).map_err(|why| {
        let allowed = "3 or more corners in order, whose edges neither cross nor touch".to_owned();
        mistake(
            file,
            &format!("{key}: {why}:"),
            None,
            Problem::NoArea,
            allowed,
        )
    })
}

/// Converts latitude and longitude, degrees, to x and y, m.
///
/// x is the distance from Tx toward Rx, and y the offset to the right as seen from Tx.
fn near_line(
    file: &str,
    key: &str,
    line: Option<&Line>,
    point @ [lat, lon]: [f64; 2],
) -> Result<[f64; 2], ScenarioError> {
    let value = Some(format!("[{lat}, {lon}]"));
    let Some(line) = line else {
        let allowed = "a rectangle, polygon or circle given by x and y in m; or latitudes and longitudes together with a [site], the geographic positions of Tx and Rx".to_owned();
        return Err(mistake(file, key, value, Problem::NoSite, allowed));
    };
    let place = |[lat, lon]: [f64; 2]| {
        let at = line.axis.place(Geodetic::from_degrees(lat, lon, 0.0)?)?;
        Some([f64::from(at.x_m), f64::from(at.y_m)])
    };
    place(point).ok_or_else(|| {
        let allowed = far_from(line, point);
        mistake(file, key, value, Problem::OutOfRange, allowed)
    })
}

/// Describes the allowed positions, for the error message about a position that is too far away.
fn far_from(line: &Line, [lat, lon]: [f64; 2]) -> String {
    let at = |lat, lon| Geodetic::from_degrees(lat, lon, 0.0);
    let away_m = at(lat, lon).and_then(|point| line.axis.away_m(point));
    let is_near = at(lon, lat).is_some_and(|point| line.axis.place(point).is_some());
    let hint = match away_m {
        _ if is_near => "; latitude and longitude are swapped".to_owned(),
        Some(away_m) if away_m > SWAPPED_M => format!(
            "; this one is {:.0} km away: are latitude and longitude swapped?",
            away_m / 1e3
        ),
        Some(away_m) => format!("; this one is {:.0} km away", away_m / 1e3),
        None => String::new(),
    };
    format!(
        "a position up to {} m from the line between the two sites of [site] and from its ends{hint}",
        Axis::AROUND_M
    )
}

fn no_fly(
    file: &str,
    raw: Vec<RawNoFly>,
    line: Option<&Line>,
) -> Result<Vec<NoFly>, ScenarioError> {
    let mut all = Vec::new();
    for (at, raw) in raw.into_iter().enumerate() {
        let key = format!("no_fly[{at}]");
        let (low, high) = (raw.lowest_m.unwrap_or(0.0), raw.highest_m.unwrap_or(1e4));
        if low >= high {
            let (name, value, allowed) = match raw.highest_m {
                Some(high) => (
                    "highest_m",
                    high,
                    format!("above lowest_m, {} m", brief(low)),
                ),
                None => (
                    "lowest_m",
                    low,
                    "below highest_m, by default 1e4 m".to_owned(),
                ),
            };
            let key = format!("{key}.{name}");
            return Err(mistake(
                file,
                &key,
                Some(brief(value)),
                Problem::OutOfRange,
                allowed,
            ));
        }
        let area = |key: String, corners| NoFly {
            key,
            corners,
            altitudes_m: low..=high,
        };
        match (&raw.area, &raw.file) {
            (Some(raw), _) => {
                let own = raw.area(file, &format!("{key}.area"), line)?;
                all.push(area(key, own.corners()));
            }
            (None, name) => {
                let path = format!("{key}.file");
                let name = name.as_deref().unwrap_or_default();
                for (number, corners) in geojson(file, &path, name)?.into_iter().enumerate() {
                    let path = format!("{path} = {name:?}, polygon {number}");
                    let each = corners.iter().enumerate().map(|(at, point)| {
                        near_line(file, &format!("{path}, corner {at}"), line, *point)
                    });
                    let own = polygon(file, &path, each.collect::<Result<_, _>>()?)?;
                    all.push(area(
                        format!("{key}, polygon {number} of {name:?}"),
                        own.corners(),
                    ));
                }
            }
        }
    }
    Ok(all)
}

/// Reads the outer boundary of each polygon in a GeoJSON file: latitudes and longitudes, degrees.
///
/// The path `name` is relative to the folder of the scenario file. A hole in a polygon counts as part of the area.
fn geojson(file: &str, key: &str, name: &str) -> Result<Vec<Vec<[f64; 2]>>, ScenarioError> {
    let fail = |why: String| {
        let allowed = format!(
            "a GeoJSON file (RFC 7946) with Polygon or MultiPolygon geometries of 3 to {MOST_CORNERS} corners, each [longitude, latitude]"
        );
        let key = format!("{key} = {name:?}: {why}:");
        mistake(file, &key, None, Problem::NoArea, allowed)
    };
    let path = Path::new(file).parent().unwrap_or(Path::new("")).join(name);
    let text = super::check::text_of(&path).map_err(|error| fail(error.problem.to_string()))?;
    let value: serde_json::Value =
        serde_json::from_str(&text).map_err(|error| fail(error.to_string()))?;
    let mut polygons = Vec::new();
    let mut open = vec![&value];
    while let Some(value) = open.pop() {
        let Some(kind) = value.get("type").and_then(|kind| kind.as_str()) else {
            return Err(fail("has an object without a type".to_owned()));
        };
        // An area that is ignored here would be a no-fly area into which relays fly.
        let lacks = |part: &str| fail(format!("has a {kind} without {part}"));
        let list = |key: &str| {
            let list = value.get(key).and_then(|list| list.as_array());
            list.filter(|list| !list.is_empty())
                .ok_or_else(|| lacks(key))
        };
        match kind {
            "FeatureCollection" => open.extend(list("features")?.iter().rev()),
            "GeometryCollection" => open.extend(list("geometries")?.iter().rev()),
            "Feature" => open.push(value.get("geometry").ok_or_else(|| lacks("geometry"))?),
            "Polygon" => polygons.push(list("coordinates")?),
            "MultiPolygon" => {
                for polygon in list("coordinates")? {
                    let polygon = polygon.as_array().filter(|rings| !rings.is_empty());
                    polygons.push(polygon.ok_or_else(|| lacks("a boundary"))?);
                }
            }
            _ => return Err(fail(format!("has a {kind}"))),
        }
    }
    let point = |at: &serde_json::Value| {
        let degrees = |axis: usize| at.get(axis).and_then(serde_json::Value::as_f64);
        Some([degrees(1)?, degrees(0)?])
    };
    let ring = |ring: &serde_json::Value| {
        let all = ring.as_array()?;
        // The last corner repeats the first one.
        let is_allowed = (3..=MOST_CORNERS + 1).contains(&all.len());
        let corners = is_allowed.then(|| all.iter().map(point).collect::<Option<Vec<_>>>())?;
        let mut corners = corners?;
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        Some(corners)
    };
    if polygons.is_empty() {
        return Err(fail("has no polygon".to_owned()));
    }
    let mut boundaries = Vec::new();
    for (number, rings) in polygons.into_iter().enumerate() {
        let rings: Option<Vec<_>> = rings.iter().map(ring).collect();
        let rings = rings.ok_or_else(|| fail("has a polygon with wrong corners".to_owned()))?;
        let mut rings = rings.into_iter();
        let boundary = Area::Polygon(rings.next().unwrap_or_default());
        for (hole, corners) in (2..).zip(rings) {
            // The tolerance is about a centimetre, in degrees, because a hole may touch the boundary.
            if corners.iter().any(|at| boundary.distance_m(*at) > 1e-7) {
                return Err(fail(format!(
                    "polygon {number}: ring {hole} is not inside ring 1, and the first ring has to be the outer boundary"
                )));
            }
        }
        boundaries.push(boundary.corners());
    }
    Ok(boundaries)
}

/// Least distance of an interferer from Tx and Rx, m.
const LEAST_APART_M: f64 = 1.0;

/// Distance from the line Tx-Rx, m, above which latitude and longitude are probably swapped.
const SWAPPED_M: f64 = 1e6;

/// Converts the `[[interferer]]` tables, whose keys have been checked, to EIRPs and positions.
pub(super) fn sources(
    file: &str,
    raw: &[RawSource],
    room: &RelayArea,
    areas: &BTreeMap<usize, SourceArea>,
) -> Result<Vec<Source>, ScenarioError> {
    let each = raw.iter().enumerate();
    each.map(|(at, raw)| {
        let table = format!("interferer[{at}].");
        let power_w = raw.eirp_w(file, &table, 1)?;
        let (x_m, y_m) = match (raw.lat_deg, raw.lon_deg, areas.get(&at)) {
            (.., Some(source)) => source.area.centre().into(),
            (Some(lat), Some(lon), _) => on_earth(file, &table, raw, [lat, lon], room)?,
            _ => (raw.x_m.unwrap_or_default(), raw.y_m.unwrap_or_default()),
        };
        for (site, site_m) in [("Tx", 0.0), ("Rx", room.distance_m)] {
            let apart_m = (x_m - site_m).hypot(y_m);
            if apart_m < LEAST_APART_M && raw.area.is_none() {
                let (key, value) = match (raw.lat_deg, raw.lon_deg) {
                    (Some(lat), Some(lon)) => ("lat_deg", format!("{lat}, lon_deg = {lon}")),
                    _ => ("x_m", format!("{}, y_m = {}", brief(x_m), brief(y_m))),
                };
                let allowed = format!(
                    "a position at least {LEAST_APART_M} m from Tx and Rx, because an interferer at {site} reduces the SIR there to 0; this one is {apart_m:.4} m from {site}"
                );
                let key = format!("{table}{key}");
                return Err(mistake(file, &key, Some(value), Problem::OutOfRange, allowed));
            }
        }
        Ok(Source { power_w, x_m, y_m })
    })
    .collect()
}

/// Converts an interferer's latitude and longitude to x and y, m.
///
/// Returns an error if the file has no `[site]`, if the interferer is too far away, or if its height changes the
/// interference too much.
fn on_earth(
    file: &str,
    table: &str,
    raw: &RawSource,
    [lat_deg, lon_deg]: [f64; 2],
    room: &RelayArea,
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
        let allowed = "x_m and y_m instead, or a [site] with the geographic positions of Tx and Rx";
        return fail(Problem::NoSite, allowed);
    };
    let point = Geodetic::from_degrees(lat_deg, lon_deg, raw.amsl_m.unwrap_or_default());
    let Some(place) = point.and_then(|point| line.axis.place(point)) else {
        let allowed = far_from(line, [lat_deg, lon_deg]);
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
        let off_db = room.height_error_db(x_m, y_m, above_m);
        if off_db > MAX_HEIGHT_ERROR_DB {
            let value = format!(
                "{}, {above_m:.1} m above the straight line from Tx to Rx,",
                brief(amsl_m)
            );
            let allowed = format!(
                "no amsl_m, or a height that changes the interference by at most {MAX_HEIGHT_ERROR_DB} dB everywhere; \
                 this one changes it by {off_db:.1} dB, because interferers are computed as if on the ground"
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

impl RelayArea<'_> {
    /// Returns the largest error of the interference power, dB, from ignoring the interferer's height.
    ///
    /// The interferer is at (`x_m`, `y_m`), `above_m` over the ground, m. The error is largest at Rx or above the relay
    /// position nearest to the interferer. It is computed at Rx, and at 65 altitudes at that relay position.
    fn height_error_db(&self, x_m: f64, y_m: f64, above_m: f64) -> f64 {
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
        // The SIR at Rx is 0 if the interferer is at Rx, whatever its height.
        let at_rx = (x_m - self.distance_m).hypot(y_m);
        let at_rx = if at_rx > 0.0 {
            ratio_db(at_rx, 0.0)
        } else {
            0.0
        };
        at_relays.fold(at_rx, f64::max)
    }
}
