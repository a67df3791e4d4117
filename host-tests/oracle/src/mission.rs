//! Converts a reference link to the relays' mission and to the planner's scene.

use uav_relay::channel::AirGround;
use uav_relay::{Band, Channel, Field, FieldPoint, Interferer, Mission, MissionConfig, Profile};
use uav_relay_scenario::Source;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::{self, Corridor, Scene};

use crate::reference::stochastic::StochasticLink;
use crate::reference::{Link, Relay};

/// Converts a reference link to a mission, and to the profiles that differ from the first relay's.
///
/// A profile is an altitude and a power. The first relay's profile is the mission's common profile. Each returned
/// profile comes with the index of its relay, from 1. `tolerance` is the relative tolerance of the mission's SIR.
/// `None` if a relay would reject a parameter.
pub fn of_link(link: &Link, tolerance: f64) -> Option<(Mission, Vec<(u16, Profile)>)> {
    let weight = (link.mu_nlos - link.eta) / (link.mu_nlos - link.mu_los).max(f64::MIN_POSITIVE);
    let channel = Channel::new(
        UNIT_CARRIER_HZ,
        link.mu_los,
        link.mu_nlos,
        AirGround::Weighted(weight.clamp(0.0, 1.0)),
    )
    .ok()?;
    let profile = |station: &Relay| Profile {
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
        band: Band::at(common.altitude_m),
        lateral: Band::NONE,
        channel,
        interference: uav_relay::Interference::Source(Interferer {
            power_w: narrow(link.interferer_w),
            x_m: narrow(link.x_i),
            y_m: narrow(link.y_i),
        }),
        noise_w: narrow(link.noise_w),
        reverse: 0.0,
        rx_power_w: narrow(link.tx_w),
        fitted_gap: 0.0,
        tolerance: narrow(tolerance),
    };
    let own = (1..)
        .zip(link.relays.iter().map(profile))
        .filter(|(_, profile)| *profile != common);
    Some((Mission::try_new(config).ok()?, own.collect()))
}

/// Converts a reference link to the planner's scene; `None` if the link has no relays.
///
/// The lowest and the highest altitude of the scene are both the altitude of the first relay.
pub fn scene_of(link: &Link) -> Option<Scene> {
    let altitude_m = link.relays.first()?.altitude_m;
    let relay = |station: &Relay| scene::Relay {
        altitude_m: station.altitude_m,
        power_w: station.power_w,
        holds: false,
    };
    Some(Scene {
        distance_m: link.distance_m,
        min_separation_m: link.min_separation_m,
        tx_w: link.tx_w,
        rx_w: link.tx_w,
        reverse: 0.0,
        sources: vec![Source {
            power_w: link.interferer_w,
            x_m: link.x_i,
            y_m: link.y_i,
        }],
        areas: std::collections::BTreeMap::new(),
        heights_m: std::collections::BTreeMap::new(),
        mu_los: link.mu_los,
        mu_nlos: link.mu_nlos,
        eta: link.eta,
        noise_w: link.noise_w,
        band: Corridor::plane(altitude_m, altitude_m),
        relays: link.relays.iter().map(relay).collect(),
    })
}

/// Converts a link of equal relays in random interference to a mission.
///
/// The link has the interference only for points on the line Tx-Rx. `min_separation_m` is the minimum distance between
/// two relays, m. `None` if a relay would reject a parameter.
pub fn of_stochastic_link(link: &StochasticLink, min_separation_m: f32) -> Option<Mission> {
    let relay = link.relays.first()?;
    let points: Vec<FieldPoint> = link
        .upsilon
        .iter()
        .map(|&(x, upsilon)| FieldPoint {
            x_m: narrow(x),
            upsilon_per_w: narrow(upsilon),
        })
        .collect();
    // The ground link is not used here. With a factor above both others, eta can be a mixture.
    let mu_nlos = 2.0 * link.eta.max(link.mu_los);
    let weight = (mu_nlos - link.eta) / (mu_nlos - link.mu_los);
    let common = Profile {
        altitude_m: narrow(relay.altitude_m),
        power_w: narrow(relay.power_w),
    };
    let config = MissionConfig {
        relays: u16::try_from(link.relays.len()).ok()?,
        distance_m: narrow(link.distance_m),
        min_separation_m,
        tx_power_w: narrow(link.tx_w),
        common,
        band: Band::at(common.altitude_m),
        lateral: Band::NONE,
        channel: Channel::new(
            UNIT_CARRIER_HZ,
            link.mu_los,
            mu_nlos,
            AirGround::Weighted(weight.clamp(0.0, 1.0)),
        )
        .ok()?,
        interference: uav_relay::Interference::Field(Field::try_new(points.leak()).ok()?),
        noise_w: 0.0,
        reverse: 0.0,
        rx_power_w: narrow(link.tx_w),
        fitted_gap: 0.0,
        tolerance: 1e-4,
    };
    Mission::try_new(config).ok()
}

/// Carrier frequency, Hz, at which the free-space factor (4 pi f / c)^2 is 1.
///
/// At this frequency a link's path-loss factor is equal to its excess loss.
const UNIT_CARRIER_HZ: f64 = 299_792_458.0 / (4.0 * std::f64::consts::PI);

/// Rounds every number of `link` to f32, the precision of a relay's mission.
///
/// A comparison of the reference with a relay then tests the relay's arithmetic, not the rounding of its parameters.
pub fn as_relays_know_it(link: &Link) -> Link {
    let round = |value: f64| f64::from(narrow(value));
    Link {
        distance_m: round(link.distance_m),
        min_separation_m: round(link.min_separation_m),
        tx_w: round(link.tx_w),
        interferer_w: round(link.interferer_w),
        x_i: round(link.x_i),
        y_i: round(link.y_i),
        noise_w: round(link.noise_w),
        relays: link
            .relays
            .iter()
            .map(|station| Relay {
                altitude_m: round(station.altitude_m),
                power_w: round(station.power_w),
            })
            .collect(),
        ..*link
    }
}
