//! Bearings: errors of their angles and distances, frame, and limits.

use std::f64::consts::PI;

use host_tests::fixtures;
use uav_relay::Placement;
use uav_relay::pointing::Bearing;

/// Maximum computation error of a [`Bearing`]'s azimuth and elevation, rad: 0.17 degrees.
const MAX_ERROR_RAD: f32 = 0.002_967;

/// Returns the errors of [`Bearing::new`] relative to a computation in f64.
///
/// They are the errors of azimuth, elevation and direction, rad, and the relative error of the distance.
fn errors(ahead_m: f32, aside_m: f32, climb_m: f32) -> [f64; 4] {
    let bearing = Bearing::new(ahead_m, aside_m, climb_m).unwrap();
    let [x, y, h] = [ahead_m, aside_m, climb_m].map(f64::from);
    let ground = libm::hypot(x, y);
    let distance = libm::hypot(ground, h);
    // A position straight above has no azimuth; the sign of a zero must not produce one.
    let azimuth = if ground > 0.0 { libm::atan2(y, x) } else { 0.0 };
    let elevation = libm::atan2(h, ground);
    let got_azimuth = f64::from(bearing.azimuth_rad);
    let got_elevation = f64::from(bearing.elevation_rad);
    assert!(got_azimuth.abs() <= PI + 1e-6 && got_elevation.abs() <= PI / 2.0 + 1e-6);
    let turn = (got_azimuth - azimuth).abs();
    let turn = turn.min(2.0 * PI - turn);
    let lift = (got_elevation - elevation).abs();
    // Chord between the two unit vectors, equal to the arc for angles this small.
    let unit = |a: f64, e: f64| {
        let (sin_a, cos_a) = libm::sincos(a);
        let (sin_e, cos_e) = libm::sincos(e);
        [cos_e * cos_a, cos_e * sin_a, sin_e]
    };
    let off = unit(azimuth, elevation)
        .into_iter()
        .zip(unit(got_azimuth, got_elevation))
        .map(|(a, b)| (a - b) * (a - b))
        .sum::<f64>();
    [
        turn,
        lift,
        libm::sqrt(off),
        (f64::from(bearing.distance_m) / distance - 1.0).abs(),
    ]
}

#[test]
fn bearings_are_within_the_stated_error_all_around() {
    let mut worst = [0.0_f64; 4];
    for turn in 0..7_200_u32 {
        let (sin_a, cos_a) = libm::sincos(f64::from(turn) * PI / 3_600.0);
        for lift in 0..=180_u32 {
            let (sin_e, cos_e) = libm::sincos(f64::from(lift) * PI / 180.0 - PI / 2.0);
            for scale in [1e-30, 700.0, 1e7] {
                let [x, y, h] = [cos_e * cos_a, cos_e * sin_a, sin_e];
                let found = errors((x * scale) as f32, (y * scale) as f32, (h * scale) as f32);
                for (worst, found) in worst.iter_mut().zip(found) {
                    *worst = worst.max(found);
                }
            }
        }
    }
    let [azimuth, elevation, direction, distance] = worst;
    let degrees = 180.0 / PI;
    println!(
        "azimuth {:.4}, elevation {:.4}, direction {:.4} degrees; distance {distance:.1e}",
        azimuth * degrees,
        elevation * degrees,
        direction * degrees
    );
    assert!(azimuth.max(elevation) < f64::from(MAX_ERROR_RAD));
    assert!(azimuth.max(elevation) * degrees < 0.17);
    assert!(direction * degrees < 0.23, "both angles together");
    assert!(distance < 3e-7);
    // Pointing error promised to the caller: half a degree.
    assert!(direction * degrees < 0.5);
}

#[test]
fn the_axes_point_where_the_frame_says() {
    let quarter = std::f32::consts::FRAC_PI_2;
    let half = std::f32::consts::PI;
    for (to, azimuth, elevation) in [
        ((1.0, 0.0, 0.0), 0.0, 0.0),
        ((0.0, 1.0, 0.0), quarter, 0.0),
        ((-1.0, 0.0, 0.0), half, 0.0),
        ((0.0, -1.0, 0.0), -quarter, 0.0),
        ((0.0, 0.0, 1.0), 0.0, quarter),
        ((0.0, 0.0, -1.0), 0.0, -quarter),
        ((2.0, 2.0, 0.0), quarter / 2.0, 0.0),
        ((0.0, 3.0, 3.0), quarter, quarter / 2.0),
    ] {
        let bearing = Bearing::new(to.0, to.1, to.2).unwrap();
        assert!(
            (bearing.azimuth_rad - azimuth).abs() < 1e-6,
            "{to:?}: {bearing:?}"
        );
        assert!(
            (bearing.elevation_rad - elevation).abs() < 1e-6,
            "{to:?}: {bearing:?}"
        );
    }
}

#[test]
fn an_invalid_position_has_no_bearing() {
    let nowhere = [
        (0.0, 0.0, 0.0),
        (-0.0, 0.0, -0.0),
        (f32::NAN, 1.0, 1.0),
        (1.0, f32::INFINITY, 1.0),
        (1.0, 1.0, f32::NEG_INFINITY),
        (f32::MAX, f32::MAX, 0.0),
    ];
    for (x, y, h) in nowhere {
        assert_eq!(Bearing::new(x, y, h), None, "{x} {y} {h}");
    }
    let tiny = f32::from_bits(1);
    assert!(Bearing::new(tiny, tiny, tiny).is_some_and(|b| b.azimuth_rad.is_finite()));
}

#[test]
fn bearings_of_neighbours_and_of_the_interferer() {
    let mission = fixtures::mission(1);
    let relay = Placement::on_line(350.0, 20.0);
    let receiver = Placement::on_line(1000.0, 0.0);
    let ahead = Bearing::between(relay, receiver).unwrap();
    assert!(ahead.azimuth_rad.abs() < 1e-6 && ahead.elevation_rad < 0.0);
    assert!((ahead.distance_m - 650.307_6).abs() < 1e-3);
    let behind = Bearing::between(receiver, relay).unwrap();
    assert!((behind.azimuth_rad.abs() - std::f32::consts::PI).abs() < 1e-6);
    assert!(behind.elevation_rad > 0.0);
    assert_eq!(Bearing::between(relay, relay), None);

    // The interferer stands at (500, 400): 150 m ahead and 400 m to the side of y, 20 m below.
    let aside = Bearing::to_interferer(relay, &mission).unwrap();
    assert!((aside.azimuth_rad - 1.212_025_7).abs() < MAX_ERROR_RAD);
    assert!((aside.elevation_rad + 0.046_783_2).abs() < MAX_ERROR_RAD);
    assert!((aside.distance_m - 427.668_1).abs() < 1e-3);
}
