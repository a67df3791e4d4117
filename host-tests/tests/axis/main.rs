//! Coordinates along a line on earth, compared with geodesics.

mod line;

use chacha20::ChaCha8Rng;
use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};
use host_tests::make;
use rand::{RngExt, SeedableRng};
use serde::Deserialize;
use uav_relay::Geodetic;
use uav_relay::flight::axis::Axis;

/// Accuracy limits: length of a line, m, and largest permitted error of x and y on this line, m.
const ALLOWED: [(f64, f64); 3] = [(1e3, 1e-3), (1e4, 1e-3), (1e5, 5e-3)];

const LINES: usize = 10_000;

/// Line between two points on earth, a third point near it, and that point's exact x and y on the line.
#[derive(Deserialize)]
struct Beside {
    tx_lat: i32,
    tx_lon: i32,
    rx_lat: i32,
    rx_lon: i32,
    lat: i32,
    lon: i32,
    distance_m: f64,
    x_m: f64,
    y_m: f64,
}

const fn ground(lat_e7: i32, lon_e7: i32) -> Geodetic {
    make::geodetic(lat_e7, lon_e7, 0)
}

impl Beside {
    fn axis(&self) -> Axis {
        let (tx, rx) = (
            ground(self.tx_lat, self.tx_lon),
            ground(self.rx_lat, self.rx_lon),
        );
        Axis::try_new(tx, rx).unwrap()
    }

    /// Returns the geodesic line from Tx to Rx, and its length in m.
    fn line(&self) -> (Line, f64) {
        let earth = Geodesic::wgs84();
        let [tx_lat, tx_lon, rx_lat, rx_lon] =
            [self.tx_lat, self.tx_lon, self.rx_lat, self.rx_lon].map(degrees);
        let (length, azimuth, _, _): (f64, f64, f64, f64) =
            earth.inverse(tx_lat, tx_lon, rx_lat, rx_lon);
        let line = Line {
            earth,
            tx: [tx_lat, tx_lon],
            azimuth,
        };
        (line, length)
    }

    /// Returns the crate's errors for this line and point, m: length of the line, x and y of the point.
    ///
    /// The error by the rounding of x and y to f32 is subtracted.
    fn off(&self) -> [f64; 3] {
        let axis = self.axis();
        let place = axis.place(ground(self.lat, self.lon)).unwrap();
        let rounded = |value: f32| f64::from(value).abs() * f64::from(f32::EPSILON) / 2.0;
        let off = |value: f32, is: f64| (f64::from(value) - is).abs() - rounded(value);
        [
            (axis.distance_m() - self.distance_m).abs(),
            off(place.x_m, self.x_m),
            off(place.y_m, self.y_m),
        ]
    }
}

/// Line computed by a geodesic library: a port of GeographicLib that is fast enough for many lines.
struct Line {
    earth: Geodesic,
    tx: [f64; 2],
    azimuth: f64,
}

impl Line {
    /// Returns a point of the line and the azimuth there: latitude, longitude and azimuth in degrees.
    ///
    /// The point is at distance `x` m along the line.
    fn at(&self, x: f64) -> [f64; 3] {
        let (lat, lon, azimuth): (f64, f64, f64) =
            self.earth.direct(self.tx[0], self.tx[1], self.azimuth, x);
        [lat, lon, azimuth]
    }

    /// Returns x and y of a point, m: its distances along the line and to the side of the line.
    ///
    /// The search for x begins at the argument `x`.
    fn foot(&self, lat: f64, lon: f64, mut x: f64) -> [f64; 2] {
        let mut y = 0.0;
        for _ in 0..20 {
            let [at_lat, at_lon, azimuth] = self.at(x);
            let (s, azi, _, _): (f64, f64, f64, f64) = self.earth.inverse(at_lat, at_lon, lat, lon);
            let (sin, cos) = (azi - azimuth).to_radians().sin_cos();
            y = s * sin;
            x += s * cos;
            if (s * cos).abs() < 1e-9 {
                break;
            }
        }
        [x, y]
    }
}

fn unit(degrees: f64) -> i32 {
    (degrees * 1e7).round() as i32
}

fn degrees(unit: i32) -> f64 {
    f64::from(unit) / 1e7
}

fn around(degrees: f64) -> f64 {
    (degrees + 180.0).rem_euclid(360.0) - 180.0
}

/// Draws a line of `length` metres anywhere on earth, and a point up to 500 m beside it.
fn beside(rng: &mut ChaCha8Rng, length: f64) -> Beside {
    let tx = [
        unit(rng.random_range(-89.9..89.9)),
        unit(rng.random_range(-180.0..180.0)),
    ];
    let heading = rng.random_range(0.0..360.0);
    let (lat, lon): (f64, f64) =
        Geodesic::wgs84().direct(degrees(tx[0]), degrees(tx[1]), heading, length);
    let mut point = Beside {
        tx_lat: tx[0],
        tx_lon: tx[1],
        rx_lat: unit(lat),
        rx_lon: unit(around(lon)),
        lat: 0,
        lon: 0,
        distance_m: 0.0,
        x_m: 0.0,
        y_m: 0.0,
    };
    let (line, distance_m) = point.line();
    let (x, y) = (
        rng.random_range(0.0..length),
        rng.random_range(-500.0..500.0),
    );
    let [lat, lon, along] = line.at(x);
    let (lat, lon): (f64, f64) = line.earth.direct(lat, lon, along + 90.0, y);
    (point.lat, point.lon) = (unit(lat), unit(around(lon)));
    point.distance_m = distance_m;
    [point.x_m, point.y_m] = line.foot(degrees(point.lat), degrees(point.lon), x);
    point
}

/// Checks that the crate, and the port of GeographicLib, agree with points of GeographicLib itself.
#[test]
fn points_agree_with_geographiclib() {
    let mut reader = csv::Reader::from_reader(&include_bytes!("points.csv")[..]);
    let points: Vec<Beside> = reader.deserialize().map(Result::unwrap).collect();
    assert_eq!(points.len(), 300);
    for point in points {
        let (line, distance_m) = point.line();
        let [x, y] = line.foot(degrees(point.lat), degrees(point.lon), point.x_m);
        for (is, said) in [
            (distance_m, point.distance_m),
            (x, point.x_m),
            (y, point.y_m),
        ] {
            assert!((is - said).abs() < 2e-6, "{is} m, said are {said}");
        }
        let allowed = if distance_m < 5e4 { 1e-3 } else { 5e-3 };
        let off = point.off();
        assert!(off.iter().all(|off| *off <= allowed), "{off:?}");
    }
}

#[test]
fn positions_agree_with_geodesics() {
    for (length, allowed) in ALLOWED {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut worst = [0.0_f64; 3];
        for _ in 0..LINES {
            for (worst, off) in worst.iter_mut().zip(beside(&mut rng, length).off()) {
                *worst = worst.max(off);
            }
        }
        let [d, x, y] = worst.map(|off| off * 1e3);
        println!(
            "{:>3} km: D within {d:.3} mm, x {x:.3} mm, y {y:.3} mm",
            length / 1e3
        );
        assert!(
            worst.iter().all(|off| *off <= allowed),
            "{length} m: {worst:?}"
        );
    }
}

#[test]
fn the_round_trip_of_a_position_is_exact_to_one_unit() {
    for (length, _) in ALLOWED {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for _ in 0..LINES {
            let point = beside(&mut rng, length);
            let from = Geodetic {
                amsl_mm: rng.random_range(-100_000..3_000_000),
                ..ground(point.lat, point.lon)
            };
            let axis = point.axis();
            let place = axis.place(from).unwrap();
            let back = axis.point(place).unwrap();
            // Rounding of x to f32, in units of 1e-7 degrees.
            let rounded = f64::from(place.x_m.abs()) * f64::from(f32::EPSILON) / 2.0 / 0.0111;
            let shrunk = f64::from(from.lat_e7).mul_add(1e-7, 0.0).to_radians().cos();
            let lon = (i64::from(back.lon_e7) - i64::from(from.lon_e7)).rem_euclid(3_600_000_000);
            let lon = lon.min(3_600_000_000 - lon) as f64 * shrunk;
            let lat = f64::from(back.lat_e7.abs_diff(from.lat_e7));
            assert!(
                lat <= 1.0 + rounded && lon <= 1.0 + rounded,
                "{from:?} became {back:?}, over {length} m"
            );
            assert!(
                back.amsl_mm.abs_diff(from.amsl_mm) <= 1,
                "{from:?} became {back:?}"
            );
        }
    }
}

/// Returns the geodesic distance from a point to the nearest point of the line, m.
fn away_by_geodesics(line: &Line, length: f64, lat: f64, lon: f64) -> f64 {
    let apart = |x: f64| -> f64 {
        let [at_lat, at_lon, _] = line.at(x);
        line.earth.inverse(at_lat, at_lon, lat, lon)
    };
    // Along the line the distance has one minimum, or one maximum, in which case the nearest point is an end.
    let (mut low, mut high) = (0.0, length);
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if apart(low + third) < apart(high - third) {
            high -= third;
        } else {
            low += third;
        }
    }
    [0.0, length, low]
        .map(apart)
        .into_iter()
        .fold(f64::MAX, f64::min)
}

/// Pairs (d, e): e is the largest permitted relative error of a point's distance from a line.
///
/// The error e is for points up to d metres from the middle of the line.
const ALLOWED_AWAY: [(f64, f64); 3] = [(1e5, 1e-6), (1e6, 2e-5), (2.0004e7, 2e-3)];

#[test]
fn distances_agree_with_geodesics() {
    for (length, _) in ALLOWED {
        for (most, allowed) in ALLOWED_AWAY {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let mut worst = 0.0_f64;
            for _ in 0..LINES / 10 {
                let beside = beside(&mut rng, length);
                let (line, length) = beside.line();
                let [lat, lon, _] = line.at(length / 2.0);
                // The distance is log-uniform from 10 m.
                let away = 10.0 * (rng.random_range(0.0..1.0) * (most / 10.0).ln()).exp();
                let heading = rng.random_range(0.0..360.0);
                let (lat, lon): (f64, f64) = line.earth.direct(lat, lon, heading, away);
                let point = ground(unit(lat), unit(around(lon)));
                let expected =
                    away_by_geodesics(&line, length, degrees(point.lat_e7), degrees(point.lon_e7));
                let is = beside.axis().away_m(point).unwrap();
                // The tolerance is two units of the point's coordinates.
                let off = ((is - expected).abs() - 0.03).max(0.0) / expected.max(1.0);
                worst = worst.max(off);
            }
            println!(
                "{:>3} km, up to {:>5.0} km away: within {:.5} %",
                length / 1e3,
                most / 1e3,
                worst * 1e2
            );
            assert!(worst <= allowed, "{length} m, {most} m: {worst}");
        }
    }
}

/// Checks that a drone too far away for x and y on the line still gets a distance from the line.
///
/// Examples are swapped latitude and longitude, and the other side of the earth.
#[test]
fn a_point_too_far_for_a_position_has_a_distance() {
    let site = |lat, lon| Geodetic::from_degrees(lat, lon, 420.0).unwrap();
    let (tx, rx) = (site(8.54, 47.40), site(8.55, 47.41));
    let axis = Axis::try_new(tx, rx).unwrap();
    let earth = Geodesic::wgs84();
    for (lat, lon) in [(47.405, 8.545), (-8.545, -132.595), (90.0, 0.0), (0.0, 0.0)] {
        let drone = site(lat, lon);
        assert_eq!(axis.place(drone), None);
        let ends = [(8.54, 47.40), (8.55, 47.41)]
            .map(|(end_lat, end_lon)| -> f64 { earth.inverse(lat, lon, end_lat, end_lon) });
        let expected = ends[0].min(ends[1]);
        let is = axis.away_m(drone).unwrap();
        assert!(
            (is / expected - 1.0).abs() < 3e-3,
            "{is} m, said are {expected}"
        );
    }
    let nowhere = Geodetic {
        lat_e7: 900_000_001,
        ..tx
    };
    assert_eq!(axis.away_m(nowhere), None);
}
