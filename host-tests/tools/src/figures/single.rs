//! A single relay at its best place (Theorem 1), against a random place and one that knows nothing of the interferer.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::planning::single::given_altitude;

use super::trouble::Trouble;
use crate::baseline::random::mean;
use crate::baseline::{blind, equal};
use uav_relay_scenario::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario, Source};

/// The realisations that are drawn: powers of Tx and of the relay, W.
pub const REALISATIONS: [(f64, f64); 2] = [(100.0, 0.5), (80.0, 2.0)];

/// Altitudes, m: from the first to the last, metre by metre.
pub const ALTITUDES_M: (u32, u32) = (10, 50);

/// Seed of the random places; each altitude has its own, this one plus the altitude in metres.
pub const SEED: u64 = 2000;

/// One altitude with one choice of powers.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Row {
    /// Power of Tx, W.
    pub tx_w: f64,
    /// Power of the relay, W.
    pub relay_w: f64,
    /// Altitude, m.
    pub altitude_m: u32,
    /// Its best place, m from Tx.
    pub x_m: f32,
    /// SIR of the worse hop there, linear.
    pub sir_linear: f32,
    /// Mean of it over random places, linear.
    pub random_sir_linear: f64,
    /// Standard error of that mean, linear.
    pub random_error_linear: f64,
    /// Mean over random places in dB.
    pub random_sir_db: f64,
    /// Mean of log2(1 + SIR) over random places, bit/s/Hz.
    pub random_rate_bit_per_s_hz: f64,
    /// SIR where the signal alone says, linear.
    pub blind_sir_linear: f64,
    /// SIR in the middle, linear.
    pub middle_sir_linear: f64,
}

/// The dual-hop scenario of the paper's third sub-table.
pub fn scenario(tx_w: f64, relay_w: f64, altitude_m: u32) -> Scenario {
    let altitude_m = f64::from(altitude_m);
    Scenario {
        distance_m: 35.0,
        min_separation_m: 0.0,
        tx_w,
        uav_w: relay_w,
        altitude_m,
        altitude_min_m: altitude_m,
        altitude_max_m: altitude_m,
        interference: Interference::Sources(vec![Source {
            power_w: 20.0,
            x_m: 30.0,
            y_m: 30.0,
        }]),
        ..Scenario::default()
    }
}

/// Each of the choices of powers at each of the altitudes, against `draws` random places.
///
/// # Errors
/// [`Trouble::Unsettled`], which no choice of powers above 0 leads to.
pub fn data(powers_w: &[(f64, f64)], altitudes_m: &[u32], draws: u32) -> Result<Vec<Row>, Trouble> {
    let choices: Vec<(f64, f64, u32)> = powers_w
        .iter()
        .flat_map(|&(tx, relay)| altitudes_m.iter().map(move |&h| (tx, relay, h)))
        .collect();
    choices
        .par_iter()
        .map(|&(tx_w, relay_w, altitude_m)| {
            row(tx_w, relay_w, altitude_m, draws).ok_or(Trouble::Unsettled("a single relay"))
        })
        .collect()
}

fn row(tx_w: f64, relay_w: f64, altitude_m: u32, draws: u32) -> Option<Row> {
    let scenario = scenario(tx_w, relay_w, altitude_m);
    let (mission, _) = mission::mission(&scenario, 1, 1e-4).ok()?;
    let scene = Scene::new(&scenario, 1)?;
    let (best, _) = given_altitude::best_place(&mission, mission.config().common)?;
    let random = mean(&scene, draws, SEED + u64::from(altitude_m));
    Some(Row {
        tx_w,
        relay_w,
        altitude_m,
        x_m: best.place.x_m,
        sir_linear: best.sir,
        random_sir_linear: random.sir,
        random_error_linear: random.error,
        random_sir_db: random.db,
        random_rate_bit_per_s_hz: random.rate,
        blind_sir_linear: scene.sir_along(&blind::places(&scene)),
        middle_sir_linear: scene.sir_along(&equal::places(&scene)),
    })
}
