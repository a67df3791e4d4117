//! Accepted samples, and finite estimates from any stream of samples.

use chacha20::ChaCha8Rng;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use rand::SeedableRng;
use uav_relay::field::estimate::{Estimate, Estimator};
use uav_relay::field::{Field, FieldPoint};
use uav_relay_oracle::random::seed;

use super::off;
use uav_relay_sim::simulator::true_interference::beta_w;

fn filled(alpha: f64, beta: f64, i_max_w: f32, samples: u32) -> Estimator {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut estimator = Estimator::new(i_max_w);
    for _ in 0..samples {
        estimator.push(beta_w(&mut rng, alpha, beta, i_max_w));
    }
    estimator
}

#[test]
fn bad_samples_are_counted_and_left_out() {
    let mut estimator = filled(4.0, 3.0, 1e-6, 500);
    let (before, rejected) = (estimator.estimate().unwrap(), estimator.rejected());
    let bad = [
        f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        0.0,
        -0.0,
        -1e-7,
        1e-6_f32.next_up(),
        f32::MAX,
    ];
    for power_w in bad {
        estimator.push(power_w);
    }
    assert_eq!(estimator.accepted(), 500);
    assert_eq!(estimator.rejected() - rejected, 8);
    assert_eq!(estimator.estimate(), Some(before));
    // Smallest and largest accepted samples.
    estimator.push(1e-6);
    estimator.push(f32::from_bits(1));
    assert_eq!(estimator.accepted(), 502);
    assert_eq!(estimator.rejected() - rejected, 8);
    assert_ne!(estimator.estimate(), Some(before));
}

#[test]
fn a_cleared_estimator_is_as_new() {
    let mut estimator = filled(4.0, 3.0, 1e-6, 500);
    estimator.push(f32::NAN);
    assert!(estimator.estimate().is_some());
    estimator.clear();
    assert_eq!(estimator, Estimator::new(1e-6));
    assert_eq!((estimator.accepted(), estimator.rejected()), (0, 0));
    assert_eq!(estimator.estimate(), None);
}

#[test]
fn no_estimate_without_enough_samples_or_spread() {
    let few = filled(4.0, 3.0, 1e-6, Estimator::MIN_SAMPLES - 1);
    assert_eq!(few.estimate(), None);
    assert!(
        filled(4.0, 3.0, 1e-6, Estimator::MIN_SAMPLES)
            .estimate()
            .is_some()
    );
    for level in [1e-6, 3e-7] {
        let mut still = Estimator::new(1e-6);
        for _ in 0..1_000 {
            still.push(level);
        }
        assert_eq!(still.estimate(), None, "{level}");
    }
    // Powers 61 dB and more below `I_max` are too small for the fixed-point resolution.
    assert!(scaled(2e-12).is_some());
    assert_eq!(scaled(0.8e-12), None);
}

/// Returns the estimate of Upsilon = E[1/I] from a thousand interference powers I around `mean_w`, W.
///
/// The largest permitted power, `I_max`, is 1e-6 W. Returns `None` if the samples do not permit an estimate.
fn scaled(mean_w: f32) -> Option<Estimate> {
    let mut estimator = Estimator::new(1e-6);
    for k in 0..1_000_u16 {
        let share = k % 11;
        estimator.push(mean_w * (0.9 + 0.02 * f32::from(share)));
    }
    estimator.estimate()
}

#[test]
fn an_invalid_bound_accepts_no_sample() {
    for (i_max_w, taken) in [
        (1e-30, true),
        (1e6, true),
        (1e-30_f32.next_down(), false),
        (1e6_f32.next_up(), false),
        (0.0, false),
        (-1.0, false),
        (f32::NAN, false),
        (f32::INFINITY, false),
    ] {
        let mut estimator = Estimator::new(i_max_w);
        for power_w in [1e-31, 1e-6, 1.0, f32::NAN, f32::INFINITY] {
            estimator.push(power_w);
        }
        assert_eq!(estimator.accepted() > 0, taken, "{i_max_w}");
        assert_eq!(estimator.accepted() + estimator.rejected(), 5);
    }
}

/// Checks that an estimate from two million similar samples is accurate.
///
/// Sums in f32 would lose this accuracy.
#[test]
fn many_similar_samples_lose_no_precision() {
    let mut estimator = Estimator::new(1.0);
    for _ in 0..1_000_000 {
        estimator.push(0.7);
        estimator.push(0.700_01);
    }
    let estimate = estimator.estimate().unwrap();
    assert_eq!(estimate.samples, 2_000_000);
    let (low, high) = (f64::from(0.7_f32), f64::from(0.700_01_f32));
    // The standard error is that of the mean, through 1 / I, plus 0.2 % for the uncertainty of alpha.
    let mean = low.midpoint(high);
    let error = (high - low) / 2.0 / mean / mean / 2e6_f64.sqrt();
    assert!(off(estimate.upsilon_per_w.into(), 1.0 / mean) < 3e-7);
    assert!(off(estimate.standard_error_per_w.into(), 1.002 * error) < 1e-4);
}

fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed(1)),
        ..Config::default()
    }
}

/// Draws sample powers: any f32 bits, values from 0 to 1, powers of two, and values just below 1.
fn powers() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        (0.0..=1.0_f32),
        (0..40_i16).prop_map(|k| 2.0_f32.powi(-i32::from(k))),
        (0..4_u32).prop_map(|k| f32::from_bits(1.0_f32.to_bits() - k)),
    ]
}

proptest! {
    #![proptest_config(config(3000))]

    #[test]
    fn every_estimate_is_finite_and_in_range(
        // A few values with many repetitions drive the fit into its corners.
        values in vec((powers(), 1..2_000_u16), 1..6),
        scale in prop_oneof![Just(1.0_f32), Just(1e-30), Just(1e6), Just(3e-9)],
    ) {
        let mut estimator = Estimator::new(scale);
        for &(value, times) in &values {
            for _ in 0..times {
                estimator.push(value * scale);
            }
        }
        if let Some(estimate) = estimator.estimate() {
            let Estimate { alpha, beta, upsilon_per_w, standard_error_per_w, samples } = estimate;
            prop_assert!(alpha.is_finite() && alpha > 1.0);
            prop_assert!(beta.is_finite() && beta > 0.0);
            prop_assert!(standard_error_per_w.is_finite() && standard_error_per_w > 0.0);
            prop_assert_eq!(samples, estimator.accepted());
            let point = FieldPoint { x_m: 0.0, upsilon_per_w };
            prop_assert!(Field::try_new(Box::leak(Box::new([point]))).is_ok());
            // Jensen's inequality: the mean of 1 / I is at least 1 / mean, and that at least 1 / I_max.
            prop_assert!(upsilon_per_w >= 0.999_999 / scale);
        }
    }
}
