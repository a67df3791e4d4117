//! Typed form of the file, and checks that involve several keys.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Table;

use crate::check::{mistake, unread};
use crate::error::{Problem, ScenarioError};
use crate::interferer::{RawSource, Room, sources};
use crate::keys::number;
use crate::plan::{Planned, PlannedMethod, PlannedPlace};
use crate::power::{Powers, RawPower, Said, powers};
use crate::site::{self, RawSites};
use crate::spec::{
    AirGround, BetaPoint, ChannelSpec, Field, Interference, ListenSpec, Noise, RelayOverride,
    Scenario,
};

/// Scenario file as serde reads it. `deny_unknown_fields` guards the table of keys: a key that is listed there but missing here
/// fails at once.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RawFile {
    geometry: RawGeometry,
    power: RawPower,
    #[serde(default)]
    channel: RawChannel,
    interferer: Option<Vec<RawSource>>,
    #[serde(default)]
    relay: Vec<RawRelay>,
    #[serde(default)]
    noise: RawNoise,
    field: Option<RawField>,
    site: Option<RawSites>,
    listen: Option<RawListen>,
    plan: Option<RawPlan>,
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

/// Converts a table that [`crate::check::table`] has accepted.
pub(super) fn from_table(file: &str, table: &Table) -> Result<RawFile, ScenarioError> {
    let table = table.clone();
    table.try_into().map_err(|error| unread(file, &error))
}

/// Builds the scenario after checking that its keys agree with each other.
pub(super) fn build(file: &str, raw: RawFile) -> Result<Scenario, ScenarioError> {
    let geometry = raw.geometry;
    let altitude_m = geometry.altitude_m;
    let altitude_min_m = geometry.altitude_min_m.unwrap_or(altitude_m);
    let altitude_max_m = geometry.altitude_max_m.unwrap_or(altitude_m);
    let band = |key: &str, value, side: &str| {
        let allowed = format!("at {side} altitude_m, {} m", number(altitude_m));
        Err(mistake(
            file,
            key,
            Some(number(value)),
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
    let (line, distance_m) = site::line(file, raw.site, geometry.distance_m)?;
    let powers = powers(file, &raw.power)?;
    let room = Room {
        line: line.as_ref(),
        distance_m,
        altitudes_m: [altitude_min_m, altitude_max_m],
        lateral_m: [geometry.lateral_min_m, geometry.lateral_max_m],
    };
    let interference = interference(
        file,
        raw.interferer.as_deref(),
        raw.field,
        raw.listen.is_some(),
        &room,
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
        uav_w: powers.uav_w,
        channel: channel(file, &raw.channel)?,
        interference,
        listen: raw.listen.map(|raw| ListenSpec {
            following: raw.following,
            every_s: raw.every_s,
            half_life_s: raw.half_life_s,
            relative_error: raw.relative_error,
        }),
        noise: noise(&raw.noise, &powers),
        relays: relays(file, raw.relay, powers.uav_gain_dbi)?,
        plan: raw.plan.map(|plan| planned(file, plan)).transpose()?,
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
    // Reports a key that the file contains.
    let (key, value, allowed) = match raw.excess_loss_nlos_db {
        Some(_) => (
            "channel.excess_loss_nlos_db",
            nlos,
            format!("{} (excess_loss_los_db) to 200 dB", number(los)),
        ),
        None => (
            "channel.excess_loss_los_db",
            los,
            format!("0 to {} dB (excess_loss_nlos_db by default)", number(nlos)),
        ),
    };
    Err(mistake(
        file,
        key,
        Some(number(value)),
        Problem::OutOfRange,
        allowed,
    ))
}

fn interference(
    file: &str,
    raw: Option<&[RawSource]>,
    field: Option<RawField>,
    listens: bool,
    room: &Room,
) -> Result<Interference, ScenarioError> {
    let one = || "either one [field] or one or more [[interferer]]".to_owned();
    match (raw, field) {
        (None, None) if listens => Ok(Interference::Sources(Vec::new())),
        (None, Some(_)) if listens => Err(mistake(
            file,
            "listen",
            Some("[listen] beside a [field]".to_owned()),
            Problem::TwoInterferences,
            "[listen] alone or beside [[interferer]]".to_owned(),
        )),
        (None, None) => Err(mistake(
            file,
            "interferer",
            None,
            Problem::NoInterference,
            one(),
        )),
        (Some(raw), Some(_)) => {
            let both = format!("[field] beside {} [[interferer]]", raw.len());
            Err(mistake(
                file,
                "field",
                Some(both),
                Problem::TwoInterferences,
                one(),
            ))
        }
        (Some(raw), None) => Ok(Interference::Sources(sources(file, raw, room)?)),
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
                        "above {} (the x_m of the entry before it) to 1e7 m",
                        number(before.x_m)
                    );
                    return Err(mistake(
                        file,
                        &key,
                        Some(number(here.x_m)),
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
        let said = Said {
            table: &table,
            in_w: ("power_w", raw.power_w),
            in_dbm: ("power_dbm", raw.power_dbm),
            eirp: ("", None),
            gain: ("power.uav_gain_dbi", Some(gain_dbi)),
        };
        let power_w = said.of_ours(file)?;
        if raw.altitude_m.is_none() && power_w.is_none() {
            return fail(
                Problem::NothingDiffers,
                "altitude_m, power_w (or power_dbm) or both beside index".to_owned(),
            );
        }
        let relay = RelayOverride {
            altitude_m: raw.altitude_m,
            power_w,
        };
        if relays.insert(raw.index, relay).is_some() {
            let allowed = "1 to 1000, each in one [[relay]] only".to_owned();
            return fail(Problem::DuplicateRelay, allowed);
        }
    }
    Ok(relays)
}

/// Builds the plan and checks that it has a position for every relay.
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
