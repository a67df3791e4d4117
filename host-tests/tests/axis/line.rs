//! Lines on earth: frame, ends, limits, and geodetic positions.

use host_tests::make;
use uav_relay::flight::axis::{Axis, AxisError};
use uav_relay::{Geodetic, Placement};

fn site(lat_deg: f64, lon_deg: f64, amsl_m: f64) -> Geodetic {
    Geodetic::from_degrees(lat_deg, lon_deg, amsl_m).expect("on earth")
}

fn assert_near(a: f32, b: f64, within: f64) {
    assert!((f64::from(a) - b).abs() <= within, "{a} is not {b}");
}

#[test]
fn the_sites_are_the_ends_of_the_line() {
    let (tx, rx) = (site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0));
    let axis = Axis::try_new(tx, rx).expect("a line");
    let d = axis.distance_m();
    for (site, x) in [(tx, 0.0), (rx, d)] {
        let place = axis.place(site).expect("near");
        assert_near(place.x_m, x, 1e-4);
        assert_near(place.y_m, 0.0, 1e-4);
        assert_near(place.altitude_m, 0.0, 1e-3);
    }
}

#[test]
fn y_is_to_the_right() {
    // Eastward line: the right side is south.
    let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.4, 8.55, 0.0)).expect("a line");
    let south = axis.place(site(47.399, 8.545, 0.0)).expect("near");
    assert_near(south.y_m, 111.2, 0.1);
    let point = axis.point(Placement {
        y_m: 100.0,
        ..Placement::on_line(300.0, 20.0)
    });
    assert!(point.expect("near").lat_e7 < 474_000_000);
}

#[test]
fn height_is_above_the_line_from_ground_to_ground() {
    let axis = Axis::try_new(site(0.0, 179.99, 100.0), site(0.0, -179.99, 300.0)).expect("a line");
    let middle = Placement::on_line(1_113.195, 20.0);
    let point = axis.point(middle).expect("near");
    assert_eq!(point.lat_e7, 0);
    assert_eq!(
        point.lon_e7.unsigned_abs(),
        1_800_000_000,
        "the antimeridian"
    );
    assert_eq!(point.amsl_mm, 220_000);
}

#[test]
fn a_line_over_the_pole_is_a_line() {
    let (tx, rx) = (site(89.99, 0.0, 0.0), site(89.99, 180.0, 0.0));
    let axis = Axis::try_new(tx, rx).expect("a line");
    let pole = axis.place(site(90.0, 12.0, 5.0)).expect("near");
    assert_near(pole.x_m, axis.distance_m() / 2.0, 1e-3);
    assert_near(pole.y_m, 0.0, 1e-3);
    let back = axis.point(pole).expect("near");
    assert!(back.lat_e7 >= 899_999_999, "{back:?}");
}

#[test]
fn invalid_pairs_of_sites_are_named() {
    let here = site(47.4, 8.54, 0.0);
    let off = Geodetic {
        lat_e7: 900_000_001,
        ..here
    };
    assert_eq!(Axis::try_new(off, here), Err(AxisError::Tx(off)));
    assert_eq!(Axis::try_new(here, off), Err(AxisError::Rx(off)));
    assert_eq!(
        Axis::try_new(here, here),
        Err(AxisError::TooShort { distance_m: 0.0 })
    );
    let far = Axis::try_new(here, site(47.4, 9.9, 0.0));
    assert!(
        matches!(far, Err(AxisError::TooLong { distance_m }) if distance_m > 100_000.0),
        "{far:?}"
    );
}

#[test]
fn nothing_far_from_the_line_or_not_finite_has_a_point() {
    let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.41, 8.55, 0.0)).expect("a line");
    for (x_m, y_m, altitude_m) in [
        (f32::NAN, 0.0, 20.0),
        (0.0, f32::NAN, 20.0),
        (0.0, 0.0, f32::INFINITY),
        (-5_001.0, 0.0, 20.0),
        (0.0, 5_001.0, 20.0),
    ] {
        let place = make::placement(x_m, y_m, altitude_m);
        assert_eq!(axis.point(place), None, "{place:?}");
    }
    assert_eq!(
        axis.place(site(0.0, 0.0, 0.0)),
        None,
        "what has no fix says 0, 0"
    );
    assert_eq!(
        axis.place(site(-47.405, -171.455, 0.0)),
        None,
        "behind the earth"
    );
}

#[test]
fn the_azimuth_turns_along_the_line() {
    let axis = Axis::try_new(site(60.0, 10.0, 0.0), site(60.0, 11.0, 0.0)).expect("a line");
    let d = axis.distance_m() as f32;
    // Eastward in the middle; the meridians converge by 0.866 degrees from one end to the other.
    for (x, degrees) in [(0.0, 89.567), (d / 2.0, 90.0), (d, 90.433)] {
        let azimuth = axis.azimuth_rad(x).to_degrees();
        assert_near(azimuth, degrees, 2e-3);
    }
}

#[test]
fn velocities_turn_with_the_line() {
    // Line toward the south-east that climbs 100 m.
    let axis = Axis::try_new(site(0.01, 10.0, 0.0), site(0.0, 10.01, 100.0)).expect("a line");
    let [north, east, down] = axis.to_ned(800.0, [10.0, 0.0, 1.0]);
    assert_near(north, -7.05, 0.05);
    assert_near(east, 7.09, 0.05);
    assert_near(down, -1.0 - 10.0 * 100.0 / axis.distance_m(), 1e-3);
    let [north, east, down] = axis.to_ned(800.0, [0.0, 10.0, 0.0]);
    assert_near(north, -7.09, 0.05);
    assert_near(east, -7.05, 0.05);
    assert_near(down, 0.0, 1e-6);
}

#[test]
fn a_mission_over_another_distance_is_another() {
    let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.41, 8.55, 0.0)).expect("a line");
    let d = axis.distance_m() as f32;
    assert!(axis.is_of(d) && axis.is_of(d + 0.04));
    assert!(!axis.is_of(d + 0.1) && !axis.is_of(f32::NAN));
}

#[test]
fn degrees_become_the_nearest_units() {
    let point = Geodetic::from_degrees(47.400_000_04, -8.540_000_06, 420.000_4);
    let nearest = make::geodetic(474_000_000, -85_400_001, 420_000);
    assert_eq!(point, Some(nearest));
}

#[test]
fn invalid_coordinates_give_none() {
    for (lat, lon, amsl) in [
        (90.1, 0.0, 0.0),
        (0.0, -180.1, 0.0),
        (f64::NAN, 0.0, 0.0),
        (0.0, f64::INFINITY, 0.0),
        (0.0, 0.0, f64::NAN),
    ] {
        assert_eq!(Geodetic::from_degrees(lat, lon, amsl), None);
    }
}
