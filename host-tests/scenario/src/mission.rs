//! Converts a scenario to the mission that the relays fly.

use std::fmt;

use uav_relay::channel::{AirGround, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::{Band, Channel, Field, FieldPoint, Interferer, Mission, MissionConfig, Profile};

use crate::hypothetical::{self, Hypothetical};
use crate::link::{Access, Link, RateModel};
use crate::number::{factor, narrow};
use crate::scene::Scene;
use crate::{Interference, Scenario, Source};

/// Reason why a scenario is not a valid mission.
#[derive(Clone, Copy, PartialEq, Debug)]
#[non_exhaustive]
pub enum Refusal {
    /// An interferer may be anywhere in an area, but a mission needs one position.
    ///
    /// The fields are the index of the interferer, from 0, and the middle of its area as x and y, m.
    Area(usize, [f64; 2]),
    /// The scenario has several interferers, and no single hypothetical interferer can replace them.
    NoHypothetical,
    /// The distance from Tx to Rx is too short for the number of relays at their minimum separation.
    NoRoom {
        /// Number of relays in the mission.
        relays: u16,
        /// Minimum separation of two relays, m.
        apart_m: f32,
        /// Distance from Tx to Rx, m.
        distance_m: f32,
    },
    /// The scenario combines fitted slots with a table of rate steps. Relays compute fitted slots only by Shannon's
    /// formula.
    Steps,
    /// [`Mission`] rejects a value of the scenario.
    Mission(MissionError),
    /// [`Channel`] rejects a value of the scenario.
    Channel(ChannelError),
    /// [`Field`] rejects the distributions of the interference in the scenario.
    Field(FieldError),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Area(at, [x_m, y_m]) => write!(
                f,
                "interferer[{at}].area: only `cargo plan` accepts an area, because relays compute with one position of the interferer; allowed: x_m and y_m, for example the middle of the area, {x_m:.1} and {y_m:.1}"
            ),
            Self::NoHypothetical => {
                f.write_str("relays compute with a single interferer, but no single interferer has the same effect as all [[interferer]] of the scenario together: change the interferers' positions or powers, or leave some interferers out")
            }
            Self::NoRoom {
                relays,
                apart_m,
                distance_m,
            } => write!(
                f,
                "no placement: {relays} relays that stay {apart_m} m apart need {} m, but Tx and Rx are {distance_m} m apart: use fewer \
                 relays, or change geometry.min_separation_m or geometry.distance_m in a --scenario FILE",
                f32::from(relays.saturating_sub(1)) * apart_m
            ),
            Self::Steps => f.write_str(
                "link.access = \"fitted\" with link.steps: the method joint computes slot lengths only by Shannon's formula; use link.gap_db in place of link.steps, or another link.access"
            ),
            Self::Mission(error) => error.fmt(f),
            Self::Channel(error) => error.fmt(f),
            Self::Field(error) => write!(f, "field: {error}"),
        }
    }
}

impl std::error::Error for Refusal {}

/// Converts a scenario to a mission of `uavs` relays, and the profiles from its `[[relay]]` tables.
///
/// A profile is the altitude and the power of one relay; it comes with the relay's index, from 1. Several interferers
/// are replaced by one hypothetical interferer.
///
/// # Errors
/// [`Refusal`] for missions that cannot be flown, and for parameters that relays reject.
pub fn mission(
    scenario: &Scenario,
    uavs: u16,
    tolerance: f64,
) -> Result<(Mission, Vec<(u16, Profile)>), Refusal> {
    if let Some((at, source)) = scenario.areas.first_key_value() {
        return Err(Refusal::Area(*at, source.area.centre()));
    }
    let interference = match &scenario.interference {
        Interference::Sources(sources) if sources.is_empty() && scenario.listen.is_some() => {
            uav_relay::Interference::Unknown
        }
        Interference::Sources(sources) => {
            let one = if let [source] = sources.as_slice() {
                interferer(source)
            } else {
                let one = hypothetical(scenario).ok_or(Refusal::NoHypothetical)?;
                interferer(&one.source())
            };
            uav_relay::Interference::Source(one)
        }
        Interference::Field(spec) => {
            uav_relay::Interference::Field(field(spec).map_err(Refusal::Field)?)
        }
    };
    let common = Profile {
        altitude_m: narrow(scenario.altitude_m),
        power_w: narrow(scenario.uav_w),
    };
    let config = MissionConfig {
        relays: uavs,
        distance_m: narrow(scenario.distance_m),
        min_separation_m: narrow(scenario.min_separation_m),
        tx_power_w: narrow(scenario.tx_w),
        common,
        band: Band {
            least_m: narrow(scenario.altitude_min_m),
            most_m: narrow(scenario.altitude_max_m),
        },
        lateral: Band {
            least_m: narrow(scenario.lateral_min_m),
            most_m: narrow(scenario.lateral_max_m),
        },
        channel: channel(scenario).map_err(Refusal::Channel)?,
        interference,
        noise_w: narrow(scenario.noise.power_w()),
        reverse: narrow(scenario.reverse),
        rx_power_w: narrow(scenario.rx_w),
        fitted_gap: 0.0,
        tolerance: narrow(tolerance),
    };
    let mission = Mission::try_new(config).map_err(|error| match error {
        MissionError::TooManyForDistance => Refusal::NoRoom {
            relays: uavs,
            apart_m: config.min_separation_m,
            distance_m: config.distance_m,
        },
        other => Refusal::Mission(other),
    })?;
    let profiles = scenario
        .relays
        .iter()
        .filter(|(index, _)| **index <= uavs)
        .map(|(&index, own)| {
            let altitude_m = own.altitude_m.map_or(common.altitude_m, narrow);
            let power_w = own.power_w.map_or(common.power_w, narrow);
            (
                index,
                Profile {
                    altitude_m,
                    power_w,
                },
            )
        })
        .collect();
    Ok((mission, profiles))
}

/// Returns `mission` with fitted time slots if the scenario has them; otherwise with equal time slots.
///
/// Relays use fitted slots only with the method `joint`; with other methods all slots are equal.
///
/// # Errors
/// [`Refusal::Steps`] for fitted slots with a table of rate steps; [`Refusal::Mission`] if the SNR gap is out of range.
pub fn with_access(scenario: &Scenario, mission: &Mission) -> Result<Mission, Refusal> {
    let fitted_gap = match &scenario.link {
        Some(Link {
            access: Access::Fitted,
            model,
            ..
        }) => match model {
            RateModel::Shannon { gap_db } => narrow(factor(*gap_db)),
            RateModel::Steps(_) => return Err(Refusal::Steps),
        },
        _ => 0.0,
    };
    let config = MissionConfig {
        fitted_gap,
        ..*mission.config()
    };
    Mission::try_new(config).map_err(Refusal::Mission)
}

/// Returns the interferer whose interference is closest to that of all the scenario's interferers.
///
/// `None` if the scenario has fewer than two interferers, or if the search finds none.
pub fn hypothetical(scenario: &Scenario) -> Option<Hypothetical> {
    match &scenario.interference {
        Interference::Sources(sources) if sources.len() > 1 => {
            let scene = Scene::new(scenario, 1)?;
            let one = hypothetical::hypothetical(&scene)?;
            Some(one.sided(&scene, scenario.lateral_min_m, scenario.lateral_max_m))
        }
        _ => None,
    }
}

/// Returns an error line if the scenario has a `[[relay]]` with an index above `uavs`.
pub fn undescribed_relay_error(scenario: &Scenario, uavs: u16) -> Option<String> {
    let (index, _) = scenario.relays.last_key_value()?;
    (*index > uavs).then(|| {
        format!("[[relay]] index = {index}: the chain has only {uavs} relays; allowed: 1 to {uavs}")
    })
}

/// Returns the indices, from 1, of the relays up to `uavs` with a fixed altitude in the scenario.
pub fn fixed_altitude_relays(scenario: &Scenario, uavs: u16) -> Vec<u16> {
    scenario
        .relays
        .iter()
        .filter(|(index, own)| **index <= uavs && own.altitude_m.is_some())
        .map(|(index, _)| *index)
        .collect()
}

/// Returns `mission` with the same interference at every x, for the time before any measurement.
///
/// At every x, the mean of 1 / I gets its value at Rx; I is the interference power. A mission without a random field is
/// unchanged.
#[must_use]
pub fn with_uniform_field(mission: &Mission) -> Mission {
    let config = mission.config();
    let uav_relay::Interference::Field(field) = config.interference else {
        return *mission;
    };
    let point = FieldPoint {
        x_m: 0.0,
        upsilon_per_w: field.upsilon(config.distance_m),
    };
    Field::try_new(vec![point].leak())
        .ok()
        .and_then(|field| {
            let interference = uav_relay::Interference::Field(field);
            Mission::try_new(MissionConfig {
                interference,
                ..*config
            })
            .ok()
        })
        .unwrap_or(*mission)
}

/// Returns alpha and beta of the Beta distribution of I / `i_max_w` at `x_m`.
///
/// I is the interference power. Between two points of the field, alpha and the mean of `i_max_w` / I are interpolated.
/// beta is computed from these two values.
pub fn shapes(spec: &crate::Field, x_m: f64) -> (f64, f64) {
    let of = |point: &crate::BetaPoint| {
        let upsilon = (point.alpha + point.beta - 1.0) / (point.alpha - 1.0);
        (point.alpha, upsilon)
    };
    let after = spec.beta.partition_point(|point| point.x_m <= x_m);
    let (left, right) = (
        after.checked_sub(1).and_then(|at| spec.beta.get(at)),
        spec.beta.get(after),
    );
    let (alpha, upsilon) = match (left, right) {
        (Some(left), Some(right)) => {
            let part = (x_m - left.x_m) / (right.x_m - left.x_m);
            let ((a, u), (b, v)) = (of(left), of(right));
            (a + (b - a) * part, u + (v - u) * part)
        }
        (Some(end), None) | (None, Some(end)) => of(end),
        (None, None) => (2.0, 2.0),
    };
    (alpha, (upsilon - 1.0) * (alpha - 1.0))
}

/// Converts the scenario's random field of interference to the field of a mission.
///
/// The memory of the field's points is never freed, because a mission borrows them for the lifetime of the program.
fn field(spec: &crate::Field) -> Result<Field, FieldError> {
    let points: Option<Vec<FieldPoint>> = spec
        .beta
        .iter()
        .map(|point| {
            FieldPoint::from_beta(narrow(point.x_m), point.alpha, point.beta, spec.i_max_w)
        })
        .collect();
    Field::try_new(points.ok_or(FieldError::Upsilon)?.leak())
}

fn channel(scenario: &Scenario) -> Result<Channel, ChannelError> {
    let spec = &scenario.channel;
    let air_ground = match spec.air_ground {
        crate::AirGround::Los => AirGround::Los,
        crate::AirGround::Nlos => AirGround::Nlos,
        crate::AirGround::Weight(weight) => AirGround::Weighted(weight),
    };
    Channel::from_db(
        spec.carrier_hz,
        spec.excess_loss_los_db,
        spec.excess_loss_nlos_db,
        air_ground,
    )
}

fn interferer(source: &Source) -> Interferer {
    Interferer {
        power_w: narrow(source.power_w),
        x_m: narrow(source.x_m),
        y_m: narrow(source.y_m),
    }
}
