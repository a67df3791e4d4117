//! Profiles, clearances and heights of relays over hills that are given by formulas.

use std::path::Path;

use geographiclib_rs::{DirectGeodesic as _, Geodesic, InverseGeodesic as _};
use rand::RngExt as _;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};
use uav_relay_terrain::grid::Terrain;
use uav_relay_terrain::profile::{Ground, Node, State};
use uav_relay_terrain::report::{FreeSpace, TerrainReport};

use crate::files::Raster;
use crate::{rng, seeds};

/// Returns the height of the hills at a longitude and latitude, m. The hills are up to 100 m high, with slopes of up to
/// 45 %.
fn hills(lon: f64, lat: f64) -> f64 {
    let (x, y) = ((lon - 8.0) * 75_500.0, (lat - 47.0) * 111_200.0);
    600.0 + 60.0 * (x / 300.0).sin() * (y / 350.0).cos() + 40.0 * (x / 190.0 + y / 250.0).sin()
}

fn terrain(folder: &Path, height: impl Fn(f64, f64) -> f64) -> Terrain {
    let file = folder.join("hills.tif");
    Raster::geographic(8.0, 47.1, 1.0 / 3600.0, [361, 361]).write(&file, height);
    Terrain::load(&[file]).unwrap()
}

fn site(lat: f64, lon: f64, amsl: f64) -> Geodetic {
    Geodetic::from_degrees(lat, lon, amsl).unwrap()
}

fn close(found: f64, expected: f64, error: f64) {
    assert!((found - expected).abs() <= error, "{found} {expected}");
}

#[test]
fn profiles_are_within_a_metre_of_the_hills_along_geodesics() {
    let folder = tempfile::tempdir().unwrap();
    let terrain = terrain(folder.path(), hills);
    let earth = Geodesic::wgs84();
    let mut worst = 0.0_f64;
    for seed in seeds(200) {
        let rng = &mut rng(seed);
        let mut place = || (rng.random_range(47.02..47.08), rng.random_range(8.02..8.08));
        let [(lat, lon), (lat2, lon2)] = [place(), place()];
        let sites = [
            site(lat, lon, hills(lon, lat)),
            site(lat2, lon2, hills(lon2, lat2)),
        ];
        let Ok(axis) = Axis::try_new(sites[0], sites[1]) else {
            continue;
        };
        let ground = Ground::new(&terrain, axis, sites, 2.0).unwrap();
        let d = axis.distance_m();
        let (a, b) = (rng.random_range(0.0..d), rng.random_range(0.0..d));
        let node = |x_m: f64| Node {
            x_m,
            y_m: 0.0,
            amsl_m: 900.0,
        };
        let [from, to] = [a.min(b), a.max(b)];
        let profile = ground.profile([node(from), node(to)]).unwrap();
        close(profile.length_m(), to - from, 1e-6);
        let (_, azimuth, _, _): (f64, f64, f64, f64) = earth.inverse(lat, lon, lat2, lon2);
        for [along, height] in &profile.points {
            let (lat, lon, _): (f64, f64, f64) = earth.direct(lat, lon, azimuth, from + along);
            worst = worst.max((height - hills(lon, lat)).abs());
        }
        assert!(worst < 1.0, "seed {seed}: {worst}");
    }
    println!("largest error of a profile: {worst:.3} m");
}

/// Returns the height of a plain of 500 m with a wall of 100 m.
///
/// The line Tx-Rx points east; the wall is 2 km from Tx.
fn wall(lon: f64, _: f64) -> f64 {
    500.0 + (100.0 - 0.3 * (lon - 8.035_f64).abs() * 76_000.0).max(0.0)
}

#[test]
fn hops_are_clear_grazing_or_blocked_by_the_wall() {
    let folder = tempfile::tempdir().unwrap();
    let terrain = terrain(folder.path(), wall);
    let sites = [site(47.05, 8.01, 500.0), site(47.05, 8.09, 502.0)];
    let axis = Axis::try_new(sites[0], sites[1]).unwrap();
    let ground = Ground::new(&terrain, axis, sites, 10.0).unwrap();
    let far = Placement::on_line(1e6, 60.0);
    let line = ground.relay(far).unwrap_err();
    assert!(
        line.starts_with("x = 1000000.0 m, y = 0.0 m, altitude 60.0 m is too far")
            && line.contains("allowed: x from -5000 to ")
            && line.ends_with("y and altitude from -5000 to 5000 m"),
        "{line}"
    );
    close(ground.ends[0].amsl_m, 510.0, 0.01);
    // The site's height in the scenario is 2 m too high. The antenna's height counts from the elevation model's ground.
    close(ground.ends[1].amsl_m, 510.0, 0.01);
    let top_x = 0.025 / 0.08 * axis.distance_m();
    let free = FreeSpace {
        sirs: &[100.0, 50.0],
        sirs_back: &[40.0, 4.0],
        reverse: 0.1,
    };
    let report = |x_m: f64, altitude_m: f64| {
        let place = Placement {
            x_m: x_m as f32,
            y_m: 0.0,
            altitude_m: altitude_m as f32,
        };
        TerrainReport::new(&ground, &[place], free, 2e9, 30.0).unwrap()
    };
    // The relay is 20 m above the top of the wall.
    let above = report(top_x, 119.4);
    assert!(
        above
            .hops
            .iter()
            .all(|hop| hop.clear && hop.diffraction_db == 0.0),
        "{above:?}"
    );
    close(above.heights[0].above_ground_m, 20.0, 1.0);
    close(above.heights[0].above_obstacle_m, 20.0, 1.0);
    close(above.terrain_sir, 40.0, 1e-9);
    // The relay is at the slope of the wall, 100 m above the plain. A part of the wall is within the position error.
    let foot = report(top_x + 80.0, 99.4);
    close(foot.heights[0].above_ground_m, 24.0, 1.5);
    close(foot.heights[0].above_obstacle_m, 15.0, 1.5);
    // The relay is behind the wall.
    let behind = report(2.0 * top_x, 60.0);
    let hop = &behind.hops[0];
    assert!(
        hop.state == State::Blocked && hop.diffraction_db > 20.0 && behind.hops[1].clear,
        "{behind:?}"
    );
    let length = 2.0 * top_x;
    let relay_amsl = 500.0 + 2.0 * length / axis.distance_m() + 60.0;
    let sight = 0.5 * (510.0 + relay_amsl) - top_x * top_x / (2.0 * 8.5e6);
    close(hop.clearance_m, sight - 600.0, 1.5);
    close(hop.obstacle_x_m, top_x, 15.0);
    close(hop.obstacle_lon_deg, 8.035, 2e-4);
    let line = behind.blocked().unwrap();
    assert!(
        line.starts_with("hop 1 (Tx to relay 1) is blocked: the ground at x = ")
            && line.contains("m above the line of sight"),
        "{line}"
    );
    let gain = 10_f64.powf(-hop.diffraction_db / 10.0);
    close(
        behind.terrain_sir,
        (100.0 * gain).min(40.0 * gain / 0.1),
        1e-9,
    );
    // The line of sight is just above the top, which is inside 60 % of the first Fresnel zone. The zone's radius is
    // sqrt(wavelength x / 2).
    let missing = 600.0 - sight;
    let zone = 0.6 * (0.149_896 * top_x / 2.0).sqrt();
    for (over, state) in [
        (-2.0, State::Blocked),
        (0.5 * zone, State::Grazing),
        (zone + 2.0, State::Clear),
    ] {
        let hop = &report(2.0 * top_x, 60.0 + 2.0 * (missing + over)).hops[0];
        assert_eq!(hop.state, state, "{over}: {hop:?}");
        if state == State::Grazing {
            close(hop.required_m, zone, 0.05);
            assert!(hop.diffraction_db > 0.0 && hop.diffraction_db < 20.0);
        }
    }
    // The relay is inside the wall.
    let inside = report(top_x, 50.0);
    assert!(
        inside.blocked().unwrap().contains("hop 2 (relay 1 to Rx)"),
        "{inside:?}"
    );
    assert!(
        inside.too_low(10.0).unwrap().starts_with("relay 1 is -"),
        "{inside:?}"
    );
    assert!(above.blocked().is_none() && above.too_low(10.0).is_none());
}

#[test]
fn sites_that_contradict_the_terrain_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let terrain = terrain(folder.path(), wall);
    let line = |sites: [Geodetic; 2]| {
        let axis = Axis::try_new(sites[0], sites[1]).unwrap();
        Ground::new(&terrain, axis, sites, 2.0).err().unwrap()
    };
    let wrong = line([site(47.05, 8.01, 500.0), site(47.05, 8.09, 420.0)]);
    assert_eq!(
        wrong,
        "site.rx.amsl_m = 420: the elevation files have 500.0 m there; allowed: a difference of at most 15 m (amsl_m is the height above mean sea level; a satellite receiver may give the height above the ellipsoid, which differs by up to 100 m)"
    );
    let outside = line([site(47.05, 8.01, 500.0), site(47.05, 8.12, 500.0)]);
    assert!(
        outside.starts_with("site.rx: latitude 47.050000, longitude 8.120000 is not covered"),
        "{outside}"
    );
    let swapped = line([site(8.01, 47.05, 500.0), site(8.02, 47.05, 500.0)]);
    assert!(
        swapped.contains("site.tx: ") && swapped.ends_with("look swapped"),
        "{swapped}"
    );
}
