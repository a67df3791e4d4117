//! A mission that knows nothing of its interference.

use super::parts::Interferer;

/// What takes the place of an interferer that nobody knows: one so far away that it is the same everywhere, (X - x)^2 + Y^2 to 1e-7.
pub(super) const FAR: Interferer = Interferer {
    power_w: 1.0,
    x_m: 0.0,
    y_m: 1e7,
};

/// One over the square of its distance.
const FAR_AWAY: f64 = 1e-14;

/// The gains of a mission that knows nothing, of relays of `power_w`: on every hop SIR = (D / d)^2, so that the best places are even ones.
pub(super) const fn even_gains(distance_m: f32, power_w: f32) -> (f64, f64, f64) {
    let squared = distance_m as f64 * distance_m as f64;
    let power_w = power_w as f64;
    (
        squared * FAR_AWAY,
        squared * FAR_AWAY / power_w,
        squared / power_w,
    )
}
