//! Relay at its best position (Theorem 1), against random, interference-blind and middle positions.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::planning::single::theorems;

use super::error::FigureError;
use crate::baseline::random::mean;
use crate::baseline::{blind, equal};
use uav_relay_scenario::mission;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario, Source};

/// Powers of Tx and of the relay in the figure, W.
pub const REALISATIONS: [(f64, f64); 2] = [(100.0, 0.5), (80.0, 2.0)];

/// First and last altitude, m, in steps of 1 m.
pub const ALTITUDES_M: (u32, u32) = (10, 50);

/// Seed of the random positions; each altitude uses this seed plus the altitude in metres.
pub const SEED: u64 = 2000;

/// Results for one altitude and one pair of powers.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Row {
    /// Power of Tx, W.
    pub tx_w: f64,
    /// Power of the relay, W.
    pub relay_w: f64,
    /// Altitude, m.
    pub altitude_m: u32,
    /// Best position, m from Tx.
    pub x_m: f32,
    /// SIR of the worse hop at the best position, linear.
    pub sir_linear: f32,
    /// Mean SIR of the worse hop over random positions, linear.
    pub random_sir_linear: f64,
    /// Standard error of that mean, linear.
    pub random_error_linear: f64,
    /// Mean SIR over random positions, in dB.
    pub random_sir_db: f64,
    /// Mean of log2(1 + SIR) over random positions, bit/s/Hz.
    pub random_rate_bit_per_s_hz: f64,
    /// SIR at the interference-blind position, linear.
    pub blind_sir_linear: f64,
    /// SIR in the middle, linear.
    pub middle_sir_linear: f64,
}

/// Returns the dual-hop scenario of the paper's third sub-table.
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

/// Returns the results for each pair of powers and altitude, against `draws` random positions.
///
/// # Errors
/// [`FigureError::Unsettled`], which does not occur for powers above 0.
pub fn data(
    powers_w: &[(f64, f64)],
    altitudes_m: &[u32],
    draws: u32,
) -> Result<Vec<Row>, FigureError> {
    let choices: Vec<(f64, f64, u32)> = powers_w
        .iter()
        .flat_map(|&(tx, relay)| altitudes_m.iter().map(move |&h| (tx, relay, h)))
        .collect();
    choices
        .par_iter()
        .map(|&(tx_w, relay_w, altitude_m)| {
            row(tx_w, relay_w, altitude_m, draws).ok_or(FigureError::Unsettled("a single relay"))
        })
        .collect()
}

fn row(tx_w: f64, relay_w: f64, altitude_m: u32, draws: u32) -> Option<Row> {
    let scenario = scenario(tx_w, relay_w, altitude_m);
    let (mission, _) = mission::mission(&scenario, 1, 1e-4).ok()?;
    let scene = Scene::new(&scenario, 1)?;
    let (best, _) = theorems::best_at_altitude(&mission, mission.config().common)?;
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
