//! Closed form of Upsilon compared with the integral of the moment-generating function.

use uav_relay::FieldPoint;
use uav_relay_oracle::reference::stochastic::upsilon_by_mgf;

use super::off;

/// Returns E[exp(-y u)] for a Beta-distributed u, by the trapezoidal rule in the logit of u.
fn beta_mgf(alpha: f64, beta: f64, y: f64) -> f64 {
    const STEP: f64 = 0.125;
    // The peak is at most 4 wide where both shapes are large.
    let low = -((1.0 + y).ln() + 4.0 + 45.0 / alpha);
    let high = 4.0 + 45.0 / beta;
    let (mut with, mut without) = (0.0, 0.0);
    let mut z = low;
    while z < high {
        let (ln_u, ln_rest) = (-(-z).exp().ln_1p(), -z.exp().ln_1p());
        let ln_u = if z < -700.0 { z } else { ln_u };
        let weight = alpha * ln_u + beta * ln_rest;
        with += (weight - y * ln_u.exp()).exp();
        z += STEP;
    }
    // Without the factor e^(-y u), the integrand is large over another range.
    let mut z = -4.0 - 45.0 / alpha;
    while z < high {
        without += (-alpha * (-z).exp().ln_1p() - beta * z.exp().ln_1p()).exp();
        z += STEP;
    }
    with / without
}

/// Returns E[exp(-y u)] for a Beta-distributed u, by the series e^-y 1F1(beta; alpha + beta; y). The series is
/// accurate for y up to 500.
fn beta_mgf_series(alpha: f64, beta: f64, y: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 0..3_000 {
        let k = f64::from(k);
        term *= (beta + k) / (alpha + beta + k) * y / (k + 1.0);
        sum += term;
    }
    sum * (-y).exp()
}

#[test]
fn the_mgf_of_the_beta_distribution_is_right() {
    for (alpha, beta) in [(1.5, 0.5), (2.0, 2.0), (3.0, 20.0), (20.0, 0.5)] {
        for y in [0.0, 1e-3, 0.3, 4.0, 60.0, 400.0] {
            let (got, want) = (beta_mgf(alpha, beta, y), beta_mgf_series(alpha, beta, y));
            assert!(
                off(got, want) < 1e-11,
                "{alpha} {beta} {y}: {got:e} {want:e}"
            );
        }
    }
}

#[test]
fn upsilon_of_a_beta_distribution_is_the_integral_of_its_mgf() {
    let mut worst: f64 = 0.0;
    for alpha in [1.2, 1.5, 2.0, 3.0, 7.5, 20.0] {
        for beta in [0.5, 1.0, 3.3, 20.0] {
            for i_max_w in [1.0, 3.476_175_5e-7] {
                let integral = upsilon_by_mgf(|t| beta_mgf(alpha, beta, -t * i_max_w)).unwrap();
                let closed = FieldPoint::beta_upsilon(alpha, beta, i_max_w).unwrap();
                worst = worst.max(off(closed, integral));
            }
        }
    }
    println!("relative difference {worst:.1e}");
    assert!(worst < 1e-12);
}

/// Checks that the integral for Upsilon = E[1/I] gives the known values of some distributions of I.
///
/// I is the interference power.
#[test]
fn the_integral_gives_known_values_of_distributions() {
    let constant = |level: f64| upsilon_by_mgf(move |t| (t * level).exp()).unwrap();
    for level in [1e-12, 3.0, 2e5] {
        assert!(off(constant(level), 1.0 / level) < 1e-12, "{level}");
    }
    // Gamma distribution with shape k and scale s: 1 / ((k - 1) s).
    for (k, s) in [(1.5, 1.0), (2.0, 1e-9), (12.0, 40.0)] {
        let found = upsilon_by_mgf(|t| (1.0 - s * t).powf(-k)).unwrap();
        assert!(off(found, 1.0 / ((k - 1.0) * s)) < 1e-11, "{k} {s}");
    }
    // Uniform distribution on [a, b]: ln(b / a) / (b - a).
    for (a, b) in [(1.0, 2.0), (1e-3, 1.0), (1e-9, 3e-9)] {
        let mean = |y: f64| {
            let width = y * (b - a);
            (-y * a).exp()
                * if width > 0.0 {
                    -(-width).exp_m1() / width
                } else {
                    1.0
                }
        };
        let found = upsilon_by_mgf(|t| mean(-t)).unwrap();
        assert!(off(found, f64::ln(b / a) / (b - a)) < 1e-11, "{a} {b}");
    }
    // I has two possible values, six decades apart.
    let found = upsilon_by_mgf(|t| 0.25 * t.exp() + 0.75 * (1e-6 * t).exp()).unwrap();
    assert!(off(found, 0.25 + 0.75e6) < 1e-12);
    // Exponential distribution: 1 / I has no mean.
    assert_eq!(upsilon_by_mgf(|t| 1.0 / (1.0 - t)), None);
}

#[test]
fn the_closed_form_agrees_with_the_reference_program() {
    assert!(off(FieldPoint::beta_upsilon(2.0, 2.0, 1.0).unwrap(), 3.0) < 1e-12);
    let found = FieldPoint::beta_upsilon(1.5, 2.0, 3.476_175_5e-7).unwrap();
    assert!(off(found, 14_383_623.611_638_71) < 1e-12);
    // The mean is infinite.
    assert_eq!(FieldPoint::beta_upsilon(1.0, 2.0, 1.0), None);
}

#[test]
fn without_a_finite_mean_there_is_no_upsilon() {
    for (alpha, beta, i_max_w) in [
        (1.0, 2.0, 1.0),
        (0.5, 2.0, 1.0),
        (2.0, 0.0, 1.0),
        (2.0, -1.0, 1.0),
        (2.0, 2.0, 0.0),
        (2.0, 2.0, -1.0),
        (f64::NAN, 2.0, 1.0),
        (2.0, f64::NAN, 1.0),
        (2.0, 2.0, f64::NAN),
        (f64::INFINITY, 2.0, 1.0),
        (2.0, f64::INFINITY, 1.0),
        (2.0, 2.0, f64::INFINITY),
        (2.0, 2.0, f64::MIN_POSITIVE / 8.0),
    ] {
        assert_eq!(
            FieldPoint::beta_upsilon(alpha, beta, i_max_w),
            None,
            "{alpha} {beta} {i_max_w}"
        );
        assert_eq!(FieldPoint::from_beta(0.0, alpha, beta, i_max_w), None);
    }
    let next = FieldPoint::beta_upsilon(1.0_f64.next_up(), 2.0, 1.0).unwrap();
    assert!(off(next, 2.0 / f64::EPSILON) < 1e-12);
}
