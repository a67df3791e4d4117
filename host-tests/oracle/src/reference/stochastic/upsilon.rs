//! Upsilon = E[1/I] of any distribution.

/// Returns Upsilon = E[1/I], 1/W, of a random interference power I.
///
/// `m`(t) = E[exp(t I)] is the moment-generating function of I. It is integrated over all t < 0 by the trapezoidal rule
/// in the logarithm of -t. This is accurate to about 1e-13, since the integrand is analytic and falls off exponentially
/// on both sides.
///
/// `None` if the integral diverges in f64: E[1/I] is infinite or nearly so (a Beta distribution with alpha below about
/// 1.1). At most some 4000 evaluations of `m`.
pub fn upsilon_by_mgf(m: impl Fn(f64) -> f64) -> Option<f64> {
    const STEP: f64 = 0.25;
    // Close to 1 / I, where `m` has fallen to a half.
    let centre = (-1000..=1000)
        .map(|k| f64::from(k) * 0.69)
        .find(|z| m(-z.exp()) < 0.5)?;
    let (mut sum, mut last, mut quiet) = (0.0, 0.0, 0);
    for k in 0.. {
        let y = (centre - 40.0 + STEP * f64::from(k)).exp();
        if !y.is_finite() {
            return None;
        }
        let term = y * m(-y);
        sum += term;
        // Remainder of the sum, if the terms continue to fall by the same ratio.
        let ratio = term / last;
        let left = if ratio < 1.0 {
            term * ratio / (1.0 - ratio)
        } else {
            f64::INFINITY
        };
        quiet = if term <= 0.0 || left < 1e-14 * sum {
            quiet + 1
        } else {
            0
        };
        if quiet > 40 {
            return Some(sum * STEP);
        }
        last = term;
    }
    None
}
