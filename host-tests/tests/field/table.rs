//! Table of Upsilon: validation, interpolation and extrapolation.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::field::{Field, FieldError, FieldPoint};
use uav_relay_oracle::random::{log_uniform, seed};

use super::off;

const fn at(x_m: f32, upsilon_per_w: f32) -> FieldPoint {
    FieldPoint { x_m, upsilon_per_w }
}

/// Table of an interference field as in a firmware: positions x, each with Upsilon.
///
/// Upsilon = E[1/I], where I is the interference power. One point is computed by the closed form for a Beta
/// distribution.
const POINTS: [FieldPoint; 3] = [
    at(0.0, 4.0),
    match FieldPoint::from_beta(100.0, 2.0, 2.0, 1.5) {
        Some(point) => point,
        None => panic!("no such distribution"),
    },
    at(300.0, 10.0),
];

const FIELD: Field = Field::new(&POINTS);

const CONSTANT: bool = FIELD.is_constant();

#[test]
fn a_field_is_a_constant_of_the_firmware() {
    const { assert!(!CONSTANT && FIELD.points().len() == 3) };
    assert_eq!((FIELD.smallest(), FIELD.largest()), (2.0, 10.0));
    for (x_m, upsilon) in [
        (-1e7, 4.0),
        (0.0, 4.0),
        (50.0, 3.0),
        (100.0, 2.0),
        (200.0, 6.0),
        (300.0, 10.0),
        (300.1, 10.0),
        (f32::INFINITY, 10.0),
        (f32::NEG_INFINITY, 4.0),
        (f32::NAN, 4.0),
    ] {
        assert_eq!(FIELD.upsilon(x_m), upsilon, "{x_m}");
    }
}

#[test]
fn a_field_of_equal_values_is_constant() {
    const ONE: Field = Field::new(&[at(5.0, 7.0)]);
    const TWO: Field = Field::new(&[at(5.0, 7.0), at(6.0, 7.0)]);
    for field in [ONE, TWO] {
        assert!(field.is_constant());
        for x_m in [-3.0, 5.0, 5.3, 6.0, 7.0, f32::NAN] {
            assert_eq!(field.upsilon(x_m), 7.0);
        }
    }
    assert_ne!(ONE, TWO);
}

/// Creates a field of interference.
///
/// The table is leaked, because a field needs a table that exists until the program ends.
fn field(points: Vec<FieldPoint>) -> Result<Field, FieldError> {
    Field::try_new(Vec::leak(points))
}

#[test]
fn every_number_is_checked_at_its_limits_and_for_nan() {
    let with = |x_m, upsilon| field(vec![at(x_m, upsilon)]).map(|_| ());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(with(bad, 1.0), Err(FieldError::Place));
        assert_eq!(with(0.0, bad), Err(FieldError::Upsilon));
    }
    for end in [-1e7, 1e7_f32] {
        assert_eq!(with(end, 1.0), Ok(()));
        let beyond = if end > 0.0 {
            end.next_up()
        } else {
            end.next_down()
        };
        assert_eq!(with(beyond, 1.0), Err(FieldError::Place));
    }
    for end in [1e-9, 1e32_f32] {
        assert_eq!(with(0.0, end), Ok(()));
    }
    for beyond in [1e-9_f32.next_down(), 1e32_f32.next_up(), 0.0, -1.0] {
        assert_eq!(with(0.0, beyond), Err(FieldError::Upsilon), "{beyond}");
    }

    let rising = |n: u16| (0..n).map(|k| at(f32::from(k), 1.0)).collect();
    assert_eq!(field(rising(0)).unwrap_err(), FieldError::Points);
    let most = u16::try_from(Field::MAX_POINTS).unwrap();
    assert!(field(rising(most)).is_ok());
    assert_eq!(field(rising(most + 1)).unwrap_err(), FieldError::Points);

    for second in [1.0, 0.999] {
        let points = vec![at(0.0, 1.0), at(1.0, 1.0), at(second, 1.0)];
        assert_eq!(field(points).unwrap_err(), FieldError::Order);
    }
    // A NaN further on must not hide the wrong order.
    let points = vec![at(0.0, 1.0), at(f32::NAN, 1.0), at(-1.0, 1.0)];
    assert_eq!(field(points).unwrap_err(), FieldError::Place);
}

#[test]
fn interpolation_agrees_with_f64() {
    let mut rng = ChaCha8Rng::seed_from_u64(seed(1));
    let mut worst: f64 = 0.0;
    for _ in 0..300 {
        let n = rng.random_range(2..200);
        let mut x: Vec<f32> = (0..n)
            .map(|_| rng.random_range(-1e3..1e3_f32) * log_uniform(&mut rng, 1e-3, 1e4) as f32)
            .collect();
        x.sort_by(f32::total_cmp);
        x.dedup();
        let points: Vec<FieldPoint> = x
            .iter()
            .map(|&x| at(x, log_uniform(&mut rng, 1.1e-9, 0.9e32) as f32))
            .collect();
        let field = field(points.clone()).unwrap();
        for _ in 0..300 {
            let x_m = rng.random_range(x[0]..=x[x.len() - 1]);
            let right = points.iter().position(|point| point.x_m >= x_m).unwrap();
            let (a, b) = (points[right.max(1) - 1], points[right.max(1)]);
            let share = (f64::from(x_m) - f64::from(a.x_m)) / (f64::from(b.x_m) - f64::from(a.x_m));
            let [low, high] = [a, b].map(|point| f64::from(point.upsilon_per_w));
            let got = field.upsilon(x_m);
            worst = worst.max(off(got.into(), low * (1.0 - share) + high * share));
            assert!(got >= a.upsilon_per_w.min(b.upsilon_per_w));
            assert!(got <= a.upsilon_per_w.max(b.upsilon_per_w));
            assert!(got >= field.smallest() && got <= field.largest());
        }
        for point in &points {
            assert_eq!(field.upsilon(point.x_m), point.upsilon_per_w);
        }
    }
    println!("relative error {worst:.1e}");
    assert!(worst < 4e-7);
}
