//! Receiver noise computed from bandwidth and noise figure.

use std::fmt;

use serde::Serialize;
use uav_relay_scenario::Noise;

/// Noise at the input of every receiver, k T0 B F, and its parameters.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct NoiseReport {
    /// Noise power, W.
    pub power_w: f64,
    /// Noise power, dBm.
    pub power_dbm: f64,
    /// B, Hz.
    pub bandwidth_hz: f64,
    /// F, dB.
    pub figure_db: f64,
    /// T0, K.
    pub temperature_k: f64,
    /// Effective noise power with receiver antenna gain, W: the noise power over the lower gain.
    pub effective_w: f64,
}

impl NoiseReport {
    /// Returns the noise of a scenario. `None` if there is none, or if the scenario states the power itself.
    pub fn of(noise: &Noise) -> Option<Self> {
        let power_w = noise.receiver_w();
        let is_made = noise.power_dbm.is_none() && power_w > 0.0;
        is_made.then(|| Self {
            power_w,
            power_dbm: 10.0 * (1e3 * power_w).log10(),
            bandwidth_hz: noise.bandwidth_hz,
            figure_db: noise.figure_db,
            temperature_k: Noise::STANDARD_K,
            effective_w: noise.power_w(),
        })
    }
}

impl fmt::Display for NoiseReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            power_w,
            power_dbm,
            bandwidth_hz,
            figure_db,
            temperature_k,
            effective_w,
        } = *self;
        write!(
            f,
            "noise: {power_dbm:.3} dBm, {power_w:.6e} W, at every receiver: k T0 B F with T0 = {temperature_k} K, B = {bandwidth_hz} Hz, F = {figure_db} dB"
        )?;
        if effective_w.total_cmp(&power_w).is_ne() {
            write!(f, "; by their antennas it counts as {effective_w:.6e} W")?;
        }
        Ok(())
    }
}
