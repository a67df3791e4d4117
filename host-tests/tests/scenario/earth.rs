//! Interferers given by earth coordinates.

use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};
use uav_relay_scenario::Interference;

use super::*;

const TX: [f64; 2] = [47.40, 8.54];
const RX: [f64; 2] = [47.41, 8.55];

/// Returns a scenario file whose interferer is described by `lines`. Tx and Rx are on the ground, 420 m above sea
/// level.
fn sited(lines: &str) -> String {
    let end =
        |[lat, lon]: [f64; 2]| format!("{{ lat_deg = {lat}, lon_deg = {lon}, amsl_m = 420 }}");
    format!(
        "[geometry]\naltitude_m = 20\n{POWER}[site]\ntx = {}\nrx = {}\n[[interferer]]\npower_dbm = 40\n{lines}\n",
        end(TX),
        end(RX)
    )
}

fn place(lines: &str) -> (f64, f64) {
    match parse(&sited(lines)).unwrap().interference {
        Interference::Sources(sources) => (sources[0].x_m, sources[0].y_m),
        Interference::Field(_) => panic!("{lines}"),
    }
}

/// Checks the position of an interferer given by coordinates against a library of geodesics.
///
/// The tolerance is one unit of the coordinates, 1.1 cm.
#[test]
fn an_interferer_by_coordinates_agrees_with_geodesics() {
    let earth = Geodesic::wgs84();
    let (d, azimuth, _, _): (f64, f64, f64, f64) = earth.inverse(TX[0], TX[1], RX[0], RX[1]);
    for (x, y) in [
        (0.0, 30.0),
        (0.4, 400.0),
        (0.9, -3_000.0),
        (1.0, 55.0),
        (2.0, 900.0),
        (-1.5, 20.0),
    ] {
        let x = x * d;
        let (lat, lon, along): (f64, f64, f64) = earth.direct(TX[0], TX[1], azimuth, x);
        let (lat, lon): (f64, f64) = earth.direct(lat, lon, along + 90.0, y);
        let (is_x, is_y) = place(&format!("lat_deg = {lat:.7}\nlon_deg = {lon:.7}"));
        assert!(
            (is_x - x).abs() < 0.012 && (is_y - y).abs() < 0.012,
            "{x} {y}: {is_x} {is_y}"
        );
    }
}

#[test]
fn coordinates_off_the_line_are_refused() {
    let near = "lat_deg = 47.404\nlon_deg = 8.548";
    let mut files = [
        "lat_deg = 90.1\nlon_deg = 8.5",
        "lat_deg = 47\nlon_deg = -180.5",
        "lat_deg = 46\nlon_deg = 8.5",
        "lat_deg = 47.404",
        "x_m = 4\nlon_deg = 8.5",
        &format!("{near}\namsl_m = 10001"),
        "x_m = 4\ny_m = 9\namsl_m = 420",
    ]
    .map(sited)
    .to_vec();
    files.push(small("").replace("x_m = 500\ny_m = 400", near));
    insta::assert_snapshot!(refusals(&files));
}

/// Checks that an interferer on a tower is refused if the tower changes the interference by over 1 dB.
///
/// The change is (d^2 + h^2) / (d^2 + (h - t)^2): d is the interferer's horizontal distance from the line, h the
/// relays' altitude, and t the tower's height.
#[test]
fn an_interferer_on_a_tower_is_refused_if_its_height_matters() {
    let azimuth = "lat_deg = 47.404\nlon_deg = 8.548";
    let (_, y) = place(azimuth);
    let db = |tower: f64| {
        10.0 * ((y * y + 400.0) / (y * y + (20.0 - tower).powi(2)))
            .log10()
            .abs()
    };
    // At Rx, on the ground, a tower only reduces the interference.
    let mut seen = [false; 2];
    for tower in [0.0, 10.0, 30.0, 60.0, 120.0, 400.0] {
        let text = sited(&format!("{azimuth}\namsl_m = {}", 420.0 + tower));
        let matters = db(tower) > 1.0;
        seen[usize::from(matters)] = true;
        if matters {
            let by = format!("by {:.1} dB", db(tower));
            let parts = [
                "interferer[0].amsl_m = ",
                &by,
                "interferers are computed as if on the ground",
            ];
            refused(&text, Problem::OutOfRange, &parts);
        } else {
            parse(&text).unwrap();
        }
    }
    assert_eq!(seen, [true; 2]);
}
