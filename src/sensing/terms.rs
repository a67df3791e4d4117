//! Terms of which 1 / I is a linear combination, and the coefficients of a source.

use crate::mission::{Interferer, Mission};
use crate::place::Placement;

/// Terms 1, u, u^2 - 1/3 + t^2 + z^2 and t, with u = 2 x / D - 1, t = 2 y / D and z = 2 h / D.
pub(crate) type Terms = [f32; 4];

/// Returns the terms at a position, for a line of `distance_m`.
pub(crate) fn terms(distance_m: f32, at: Placement) -> Terms {
    let half = 0.5 * distance_m;
    let (u, t, z) = (at.x_m / half - 1.0, at.y_m / half, at.altitude_m / half);
    [1.0, u, u * u - 1.0 / 3.0 + t * t + z * z, t]
}

/// Interference of v = 1, W: the middle of the measurable range, so that no square of a v leaves an f32.
pub(crate) const UNIT_W: f32 = 1e-12;

/// Range of v for the measurable range, [`MEASURED_W`](super::level::MEASURED_W).
const V: (f32, f32) = (1e-18, 1e18);

/// Converts an expected v to f32; `None` outside of the measurable range.
pub(crate) fn expected_v(v: f64) -> Option<f32> {
    let (least, most) = (f64::from(V.0), f64::from(V.1));
    #[expect(
        clippy::cast_possible_truncation,
        reason = "within the range of an f32"
    )]
    (least..=most).contains(&v).then_some(v as f32)
}

/// Returns k = eta D^2 [`UNIT_W`] / (4 P) of a source of `power_w`; its own inverse: the power for k.
pub(crate) fn strength(mission: &Mission, power_w: f64) -> f64 {
    let config = mission.config();
    let d = f64::from(config.distance_m);
    0.25 * config.channel.eta() * d * d * f64::from(UNIT_W) / power_w
}

/// Returns the coefficients of `source`: k (X'^2 + Y'^2 + 1/3), -2 k X', k and -2 k Y'.
pub(crate) fn coefficients(mission: &Mission, source: &Interferer) -> [f64; 4] {
    let config = mission.config();
    let half = 0.5 * f64::from(config.distance_m);
    let k = strength(mission, f64::from(source.power_w));
    let (x, y) = (
        f64::from(source.x_m) / half - 1.0,
        f64::from(source.y_m) / half,
    );
    [
        k * (x * x + y * y + 1.0 / 3.0),
        -2.0 * k * x,
        k,
        -2.0 * k * y,
    ]
}

pub(crate) fn value(coefficients: &[f64; 4], terms: &Terms) -> f64 {
    let [a, b, c, d] = coefficients;
    let [one, u, q, t] = terms.map(f64::from);
    a * one + b * u + c * q + d * t
}
