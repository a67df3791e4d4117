//! Random interference powers: samples of a Beta distribution.

use rand::{Rng, RngExt};

/// A number from the normal distribution with mean 0 and variance 1, by Marsaglia's polar method.
fn normal(rng: &mut impl Rng) -> f64 {
    loop {
        let [a, b]: [f64; 2] = [rng.random_range(-1.0..1.0), rng.random_range(-1.0..1.0)];
        let square = a * a + b * b;
        if square > 0.0 && square < 1.0 {
            return a * (-2.0 * square.ln() / square).sqrt();
        }
    }
}

/// A number from the Gamma distribution with this shape and scale 1, by Marsaglia and Tsang's method.
fn gamma(rng: &mut impl Rng, shape: f64) -> f64 {
    if shape < 1.0 {
        let power = rng.random_range(f64::MIN_POSITIVE..1.0).powf(1.0 / shape);
        return gamma(rng, shape + 1.0) * power;
    }
    let d = shape - 1.0 / 3.0;
    let c = 1.0 / (9.0 * d).sqrt();
    loop {
        let x = normal(rng);
        let v = (1.0 + c * x).powi(3);
        if v > 0.0 {
            let u: f64 = rng.random_range(f64::MIN_POSITIVE..1.0);
            if u < 1.0 - 0.0331 * x.powi(4) || u.ln() < 0.5 * x * x + d * (1.0 - v + v.ln()) {
                return d * v;
            }
        }
    }
}

/// An interference power, W, as a receiver reports it: a part of `i_max_w` from the Beta distribution, as an f32.
#[expect(clippy::cast_possible_truncation, reason = "samples on board are f32")]
pub fn beta_w(rng: &mut impl Rng, alpha: f64, beta: f64, i_max_w: f32) -> f32 {
    let (a, b) = (gamma(rng, alpha), gamma(rng, beta));
    (a / (a + b) * f64::from(i_max_w)) as f32
}
