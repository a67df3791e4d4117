//! Random interference powers: samples of a Beta distribution.

use rand::Rng;
use rand_distr::{Beta, Distribution as _};

/// Draws an interference power, W: `i_max_w` times a Beta variable. NaN if a shape parameter is not above 0.
#[expect(clippy::cast_possible_truncation, reason = "samples on board are f32")]
pub fn beta_w(rng: &mut impl Rng, alpha: f64, beta: f64, i_max_w: f32) -> f32 {
    let part = Beta::new(alpha, beta).map_or(f64::NAN, |shape| shape.sample(rng));
    (part * f64::from(i_max_w)) as f32
}
