//! From a scenario to the mission that the relays fly.

use std::fmt;

use uav_relay::channel::{AirGround, ChannelError};
use uav_relay::mission::MissionError;
use uav_relay::{Channel, Interferer, Mission, MissionConfig, Profile};

use crate::reference::{Link, Station};
use crate::scenario::{self, Interference, Scenario, Source};

/// Why a scenario is no mission.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Refusal {
    /// It asks for something that is not built yet.
    NotYet(&'static str),
    /// The relays cannot stand that far apart on that distance.
    NoRoom,
    /// The mission refuses a parameter.
    Mission(MissionError),
    /// The channel refuses a parameter.
    Channel(ChannelError),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotYet(what) => write!(f, "{what} not supported yet"),
            Self::NoRoom => f.write_str("no placement: (relays - 1) x geometry.min_separation_m is above geometry.distance_m"),
            Self::Mission(error) => error.fmt(f),
            Self::Channel(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for Refusal {}

/// The mission of `uavs` relays in `scenario`, and what single relays hold of their own (index from 1).
///
/// # Errors
/// [`Refusal`] for what the relays cannot do, and for numbers they do not take.
pub fn mission(
    scenario: &Scenario,
    uavs: u16,
    tolerance: f64,
) -> Result<(Mission, Vec<(u16, Profile)>), Refusal> {
    let source = match &scenario.interference {
        Interference::Sources(sources) => match sources.as_slice() {
            [source] => source,
            _ => {
                return Err(Refusal::NotYet(
                    "several [[interferer]] in one scenario are",
                ));
            }
        },
        Interference::Field(_) => return Err(Refusal::NotYet("a [field] of interference is")),
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
        channel: channel(scenario).map_err(Refusal::Channel)?,
        interferer: interferer(source),
        tolerance: narrow(tolerance),
    };
    let mission = Mission::try_new(config).map_err(|error| match error {
        MissionError::TooManyForDistance => Refusal::NoRoom,
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

fn channel(scenario: &Scenario) -> Result<Channel, ChannelError> {
    let spec = &scenario.channel;
    let air_ground = match spec.air_ground {
        scenario::AirGround::Los => AirGround::Los,
        scenario::AirGround::Nlos => AirGround::Nlos,
        scenario::AirGround::Weight(weight) => AirGround::Weighted(weight),
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

/// The nearest f32: what a relay works with.
#[expect(
    clippy::cast_possible_truncation,
    reason = "the ranges of a scenario lie well inside those of an f32"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// The mission of a reference link, and what single relays hold of their own; `None` where a relay would refuse its numbers.
///
/// The relays of a link may differ: the first one's profile is what the mission has in common.
pub fn of_link(link: &Link, tolerance: f64) -> Option<(Mission, Vec<(u16, Profile)>)> {
    // At this carrier the wave number is 1, and the excess factors are the path-loss factors themselves.
    let carrier_hz = 299_792_458.0 / (4.0 * std::f64::consts::PI);
    let weight = (link.mu_nlos - link.eta) / (link.mu_nlos - link.mu_los).max(f64::MIN_POSITIVE);
    let channel = Channel::new(
        carrier_hz,
        link.mu_los,
        link.mu_nlos,
        AirGround::Weighted(weight.clamp(0.0, 1.0)),
    )
    .ok()?;
    let profile = |station: &Station| Profile {
        altitude_m: narrow(station.altitude_m),
        power_w: narrow(station.power_w),
    };
    let common = profile(link.relays.first()?);
    let config = MissionConfig {
        relays: u16::try_from(link.len()).ok()?,
        distance_m: narrow(link.distance_m),
        min_separation_m: narrow(link.min_separation_m),
        tx_power_w: narrow(link.tx_w),
        common,
        channel,
        interferer: Interferer {
            power_w: narrow(link.interferer_w),
            x_m: narrow(link.x_i),
            y_m: narrow(link.y_i),
        },
        tolerance: narrow(tolerance),
    };
    let own = (1..)
        .zip(link.relays.iter().map(profile))
        .filter(|(_, profile)| *profile != common);
    Some((Mission::try_new(config).ok()?, own.collect()))
}

/// `link` with every number rounded to the f32 that a relay is given, so that only a relay's arithmetic is judged.
pub fn as_relays_know_it(link: &Link) -> Link {
    let round = |value: f64| f64::from(narrow(value));
    Link {
        distance_m: round(link.distance_m),
        min_separation_m: round(link.min_separation_m),
        tx_w: round(link.tx_w),
        interferer_w: round(link.interferer_w),
        x_i: round(link.x_i),
        y_i: round(link.y_i),
        relays: link
            .relays
            .iter()
            .map(|station| Station {
                altitude_m: round(station.altitude_m),
                power_w: round(station.power_w),
            })
            .collect(),
        ..*link
    }
}
