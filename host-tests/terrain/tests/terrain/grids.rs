//! Heights from elevation files, and the errors of files that cannot be used.

use std::path::PathBuf;

use rand::RngExt as _;
use uav_relay_terrain::grid::Terrain;

use crate::files::{Raster, hgt};
use crate::{rng, seeds};

/// Returns the height of a tilted plane. Bilinear interpolation reproduces it exactly.
fn plane(east: f64, north: f64) -> f64 {
    500.0 + 300.0 * (east - 8.0) - 200.0 * (north - 47.0)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn heights_are_interpolated_within_and_between_files() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    let cell = 1.0 / 3600.0;
    // The two tiles are side by side, at a distance of one cell. In the second, tie points are corners of cells.
    Raster::geographic(8.0, 47.1, cell, [360, 361]).write(&file("west.tif"), plane);
    let east = Raster {
        is_point: false,
        ..Raster::geographic(8.1, 47.1, cell, [360, 361])
    };
    east.write(&file("east.tif"), plane);
    hgt(&file("N47E008.hgt"), [8.0, 47.0], |lon, lat| {
        plane(lon, lat).round()
    });
    let tiles = Terrain::load(&[file("west.tif"), file("east.tif")]).unwrap();
    let srtm = Terrain::load(&[file("N47E008.hgt")]).unwrap();
    assert!((srtm.cell_m(47.0) - 63.3).abs() < 0.5 && (tiles.cell_m(47.0) - 21.1).abs() < 0.2);
    for seed in seeds(500) {
        let rng = &mut rng(seed);
        let (lon, lat) = (rng.random_range(8.0..8.199), rng.random_range(47.0..47.1));
        let height = tiles.height_m(lat, lon).unwrap();
        assert!(
            (height - plane(lon, lat)).abs() < 0.01,
            "{lat} {lon}: {height}"
        );
        let height = srtm.height_m(lat, lon).unwrap();
        assert!(
            (height - plane(lon, lat)).abs() < 0.51,
            "{lat} {lon}: {height}"
        );
    }
    // Tested are corners of the grid, and points between the two tiles.
    for (lat, lon) in [
        (47.0, 8.0),
        (47.1, 8.0),
        (47.05, 8.1),
        (47.05, 8.1 - 0.5 * cell),
    ] {
        assert!((tiles.height_m(lat, lon).unwrap() - plane(lon, lat)).abs() < 0.01);
    }
    assert!((srtm.height_m(48.0, 9.0).unwrap() - plane(9.0, 48.0)).abs() < 0.01);
}

/// Converts to UTM coordinates by Krüger's series to third order.
///
/// The conversion is independent of the tested crate.
pub(crate) fn utm(lat: f64, lon: f64, zone: f64) -> [f64; 2] {
    let n: f64 = 1.0 / (2.0 * 298.257_223_563 - 1.0);
    let alpha = [
        n / 2.0 - 2.0 / 3.0 * n.powi(2) + 5.0 / 16.0 * n.powi(3),
        13.0 / 48.0 * n.powi(2) - 3.0 / 5.0 * n.powi(3),
        61.0 / 240.0 * n.powi(3),
    ];
    let radius = 6_378_137.0 / (1.0 + n) * (1.0 + n.powi(2) / 4.0 + n.powi(4) / 64.0);
    let (phi, lambda) = (lat.to_radians(), (lon - (6.0 * zone - 183.0)).to_radians());
    let e = 2.0 * n.sqrt() / (1.0 + n);
    let t = (phi.sin().atanh() - e * (e * phi.sin()).atanh()).sinh();
    let (xi, eta) = (
        t.atan2(lambda.cos()),
        (lambda.sin() / (1.0 + t * t).sqrt()).atanh(),
    );
    let sum = |of: &dyn Fn(f64) -> f64| {
        (1..)
            .zip(alpha)
            .map(|(j, a)| a * of(2.0 * f64::from(j)))
            .sum::<f64>()
    };
    let east = eta + sum(&|j| (j * xi).cos() * (j * eta).sinh());
    let north = xi + sum(&|j| (j * xi).sin() * (j * eta).cosh());
    [500_000.0 + 0.9996 * radius * east, 0.9996 * radius * north]
}

#[test]
fn utm_grids_have_the_heights_of_an_independent_projection() {
    let folder = folder();
    for (zone, south, lat, lon) in [
        (32_u16, false, 47.4, 8.5),
        (32, false, 47.4, 11.9),
        (19, true, -33.4, -70.6),
        (33, false, 69.6, 18.9),
    ] {
        let [east, north] = utm(lat, lon, zone.into());
        let north = if south { north + 1e7 } else { north };
        let height = |e: f64, n: f64| 100.0 + 0.1 * (e - east) - 0.2 * (n - north);
        let epsg = if south { 32700 } else { 32600 } + zone;
        let raster = Raster {
            corner: [
                (east / 10.0).round() * 10.0 - 3000.0,
                (north / 10.0).round() * 10.0 + 3000.0,
            ],
            cell: [10.0; 2],
            size: [600, 600],
            epsg,
            nodata: None,
            is_point: false,
            metadata: None,
            vertical: None,
        };
        let file = folder.path().join("utm.tif");
        raster.write(&file, height);
        let terrain = Terrain::load(&[file]).unwrap();
        for seed in seeds(100) {
            let rng = &mut rng(seed);
            let (lat, lon) = (
                lat + rng.random_range(-0.01..0.01),
                lon + rng.random_range(-0.01..0.01),
            );
            let [e, n] = utm(lat, lon, zone.into());
            let expected = height(e, if south { n + 1e7 } else { n });
            let found = terrain.height_m(lat, lon).unwrap();
            // On this plane a millimetre of height corresponds to a centimetre of distance.
            assert!(
                (found - expected).abs() < 2e-3,
                "{epsg} {lat} {lon}: {found} {expected}"
            );
        }
    }
}

#[test]
fn unusable_files_and_places_are_named() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    let cell = 1.0 / 3600.0;
    let geographic = || Raster::geographic(8.0, 47.1, cell, [360, 361]);
    geographic().write(&file("a.tif"), plane);
    Raster::geographic(8.1, 47.1, 2.0 * cell, [180, 180]).write(&file("coarse.tif"), plane);
    Raster::geographic(8.1 + 0.3 * cell, 47.1, cell, [90, 90]).write(&file("shifted.tif"), plane);
    for (name, epsg, corner) in [
        ("utm.tif", 32632, [4.6e5, 5.25e6]),
        ("swiss.tif", 2056, [2.6e6, 1.2e6]),
    ] {
        Raster {
            epsg,
            corner,
            cell: [30.0; 2],
            ..geographic()
        }
        .write(&file(name), |_, _| 1.0);
    }
    for row in [
        r#"decimetres.tif <Item name="SCALE" sample="0" role="scale">0.1</Item>"#,
        r#"feet.tif <Item name="UNITTYPE" sample="0" role="unittype">ft</Item>"#,
        "quotes.tif <Item name='UNITTYPE' sample='0' role='unittype'>US survey foot</Item>",
        r#"meter.tif <Item name="UNITTYPE" sample="0" role="unittype">Meter</Item>"#,
    ] {
        let (name, metadata) = row.split_once(' ').unwrap();
        Raster {
            metadata: Some(metadata),
            ..geographic()
        }
        .write(&file(name), plane);
    }
    for (name, code) in [("survey.tif", 6360), ("ellipsoid.tif", 5030)] {
        Raster {
            vertical: Some(code),
            ..geographic()
        }
        .write(&file(name), plane);
    }
    // The code is for heights above Normaal Amsterdams Peil, in metres.
    Raster {
        vertical: Some(5709),
        ..geographic()
    }
    .write(&file("metres.tif"), plane);
    assert!(Terrain::load(&[file("metres.tif")]).is_ok());
    assert!(Terrain::load(&[file("meter.tif")]).is_ok());
    std::fs::write(file("N47E008.hgt"), [0; 1000]).unwrap();
    std::fs::write(file("zurich.hgt"), [0; 1000]).unwrap();
    std::fs::write(file("text.tif"), "no picture").unwrap();
    let load = |names: &str| {
        let files: Vec<_> = names.split(' ').map(file).collect();
        let refused = Terrain::load(&files).err();
        refused.unwrap_or_else(|| panic!("{names}"))
    };
    // The files, and parts of the error line.
    for row in [
        "missing.tif | missing.tif: No such file",
        "text.tif | text.tif: ",
        "N47E008.hgt | N47E008.hgt: has 1000 bytes; allowed: 2 bytes for each of 1201 x 1201",
        "zurich.hgt | zurich.hgt: its name must begin with",
        "decimetres.tif | decimetres.tif: has heights with the scale 0.1 (tag 42112); allowed: heights in metres, without scale or offset",
        "feet.tif | feet.tif: has heights with the unittype ft (tag 42112); allowed: heights in metres, without scale or offset",
        "quotes.tif | quotes.tif: has heights with the unittype US survey foot (tag 42112)",
        "swiss.tif | swiss.tif: has the EPSG code 2056; allowed: 4326",
        "a.tif utm.tif | utm.tif: its coordinate system, UTM zone 32N, differs from that of  | a.tif (latitude and longitude, cells of 0.000277",
        "survey.tif | survey.tif: has heights in feet: its vertical coordinate system is EPSG 6360 (key 4096); allowed: heights in metres",
        "ellipsoid.tif | ellipsoid.tif: has heights above the ellipsoid | code 5030 (key 4096)",
        "a.tif coarse.tif | coarse.tif: its cell size, 0.000555",
        "a.tif shifted.tif | shifted.tif: its origin, 8.100083 | is not at a grid point of the other file",
    ] {
        let (names, parts) = row.split_once(" | ").unwrap();
        let line = load(names);
        for part in parts.split(" | ") {
            assert!(line.contains(part), "{row}: {line}: {part}");
        }
    }
}

/// Checks that overlapping files whose heights differ too much are refused, in either order.
#[test]
fn files_that_contradict_each_other_are_named_with_the_place_and_both_heights() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    let cell = 1.0 / 3600.0;
    Raster::geographic(8.0, 47.1, cell, [200, 361]).write(&file("west.tif"), plane);
    let east = || Raster::geographic(8.0 + 150.0 * cell, 47.1, cell, [200, 361]);
    let bump = |most: f64| {
        move |lon: f64, lat: f64| {
            let at =
                (lon - 8.0 - 160.0 * cell).abs() < 0.1 * cell && (lat - 47.05).abs() < 0.1 * cell;
            plane(lon, lat) + if at { most } else { 0.3 }
        }
    };
    east().write(&file("near.tif"), bump(0.9));
    east().write(&file("other.tif"), bump(-30.0));
    for names in [["west.tif", "near.tif"], ["near.tif", "west.tif"]] {
        assert!(Terrain::load(&names.map(file)).is_ok());
    }
    for names in [["west.tif", "other.tif"], ["other.tif", "west.tif"]] {
        let line = Terrain::load(&names.map(file)).err().unwrap();
        let of = |name: &str| {
            if name == "west.tif" {
                "503.3 m"
            } else {
                "473.3 m"
            }
        };
        for part in [
            "west.tif".to_owned(),
            "other.tif".to_owned(),
            "contradict each other: at latitude 47.050000, longitude 8.044444".to_owned(),
            format!(
                "their heights are {} and {}; allowed: a difference of at most 1 m",
                of(names[0]),
                of(names[1])
            ),
        ] {
            assert!(line.contains(&part), "{line}: {part}");
        }
    }
    // A hole (unknown height) is not compared with the second file.
    Raster {
        nodata: Some(-9999.0),
        ..east()
    }
    .write(&file("hole.tif"), |lon, lat| {
        if lon < 8.0 + 200.0 * cell {
            -9999.0
        } else {
            plane(lon, lat)
        }
    });
    assert!(Terrain::load(&["hole.tif", "west.tif"].map(file)).is_ok());
}

#[test]
fn holes_and_uncovered_places_are_named() {
    let folder = folder();
    let file = |name: &str| folder.path().join(name);
    let cell = 1.0 / 3600.0;
    let geographic = || Raster::geographic(8.0, 47.1, cell, [360, 361]);
    geographic().write(&file("a.tif"), plane);
    Raster {
        nodata: Some(-9999.0),
        ..geographic()
    }
    .write(&file("hole.tif"), |lon, lat| {
        if lon > 8.05 { -9999.0 } else { plane(lon, lat) }
    });
    Raster {
        epsg: 32632,
        corner: [4.6e5, 5.25e6],
        cell: [30.0; 2],
        ..geographic()
    }
    .write(&file("utm.tif"), |_, _| 1.0);
    let holed = Terrain::load(&[file("hole.tif")]).unwrap();
    let line = holed.height_m(47.05, 8.0600001).unwrap_err();
    assert!(line.contains("hole.tif: has no height at latitude 47.050000, longitude 8.060000: its value there is -9999"), "{line}");
    assert!(holed.height_m(47.05, 8.04).is_ok());
    // A second file has a height at the hole of the first.
    let filled = Terrain::load(&[file("hole.tif"), file("a.tif")]).unwrap();
    assert!((filled.height_m(47.05, 8.06).unwrap() - plane(8.06, 47.05)).abs() < 0.01);
    let line = filled.height_m(47.2, 8.05).unwrap_err();
    assert!(
        line.contains("latitude 47.200000, longitude 8.050000 is not covered")
            && line
                .contains("a.tif has latitudes 47.0000 to 47.1000 and longitudes 8.0000 to 8.0997"),
        "{line}"
    );
    assert!(!line.contains("swapped"), "{line}");
    let line = filled.height_m(8.05, 47.05).unwrap_err();
    assert!(
        line.ends_with("; latitude and longitude look swapped"),
        "{line}"
    );
    let utm = Terrain::load(&[file("utm.tif")]).unwrap();
    let line = utm.height_m(48.4, 8.5).unwrap_err();
    assert!(
        line.contains("(easting 462") && line.contains("in UTM zone 32N)"),
        "{line}"
    );
}

/// Returns the elevation model of Zurich (25 m) that the package `geotiff` contains.
///
/// `None` if Cargo has not unpacked the package.
fn zurich() -> Option<Vec<u8>> {
    let cargo = std::env::var("CARGO_HOME").map(PathBuf::from);
    let cargo =
        cargo.or_else(|_| std::env::var("HOME").map(|home| PathBuf::from(home).join(".cargo")));
    let registries = std::fs::read_dir(cargo.ok()?.join("registry/src")).ok()?;
    let file = "geotiff-0.1.0/resources/zh_dem_25.tif";
    registries
        .flatten()
        .find_map(|registry| std::fs::read(registry.path().join(file)).ok())
}

/// Returns latitude and longitude of a point in UTM zone 32, near the equator, degrees.
fn geographic(east: f64, north: f64) -> [f64; 2] {
    let [mut lat, mut lon] = [2.0, 9.0];
    for _ in 0..30 {
        let (y, x, _) = utm::to_utm_wgs84(lat, lon, 32);
        lat += (north - y) / 111_000.0;
        lon += (east - x) / 111_000.0;
    }
    [lat, lon]
}

/// Checks that a real elevation model is read; skipped if Cargo has not unpacked its package.
///
/// The model's file has no coordinate system, so the test adds one.
#[test]
fn a_real_elevation_model_is_read() {
    let Some(original) = zurich() else {
        println!("not tested: Cargo has not unpacked the package geotiff 0.1.0");
        return;
    };
    let folder = folder();
    let file = folder.path().join("zurich.tif");
    std::fs::write(&file, &original).unwrap();
    let line = Terrain::load(&[&file]).err().unwrap();
    assert!(line.contains("zurich.tif: "), "{line}");
    println!("without a coordinate system: {line}");
    // The test appends a new directory to the file: UTM zone 32, tie points at corners of cells.
    let keys: [u16; 12] = [1, 1, 0, 2, 1025, 0, 1, 1, 3072, 0, 1, 32632];
    let mut bytes = original.clone();
    let u32_at = |at: usize| u32::from_le_bytes(original[at..at + 4].try_into().unwrap());
    let first = u32_at(4) as usize;
    let count = usize::from(u16::from_le_bytes([original[first], original[first + 1]]));
    let mut entries: Vec<[u8; 12]> = (0..count)
        .map(|entry| first + 2 + 12 * entry)
        .map(|at| original[at..at + 12].try_into().unwrap())
        .collect();
    let keys_at = bytes.len() as u32;
    bytes.extend(keys.iter().flat_map(|key| key.to_le_bytes()));
    let mut entry = [0; 12];
    entry[..2].copy_from_slice(&34_735_u16.to_le_bytes());
    entry[2..4].copy_from_slice(&3_u16.to_le_bytes());
    entry[4..8].copy_from_slice(&12_u32.to_le_bytes());
    entry[8..].copy_from_slice(&keys_at.to_le_bytes());
    entries.insert(count - 1, entry);
    let directory = bytes.len() as u32;
    bytes.extend((entries.len() as u16).to_le_bytes());
    bytes.extend(entries.concat());
    bytes.extend([0; 4]);
    bytes[4..8].copy_from_slice(&directory.to_le_bytes());
    std::fs::write(&file, bytes).unwrap();
    let terrain = Terrain::load(&[&file]).unwrap();
    let (mut lowest, mut highest) = (f64::INFINITY, 0.0_f64);
    for seed in seeds(500) {
        let rng = &mut rng(seed);
        let (column, row) = (
            rng.random_range(1..398_usize),
            rng.random_range(1..365_usize),
        );
        // The 37 strips of the file are contiguous.
        let at = 556 + 2 * (399 * row + column);
        let height = f64::from(u16::from_le_bytes([original[at], original[at + 1]]));
        let east = 677_562.5 + 25.0 * (column as f64 + 0.5);
        let north = 253_012.5 - 25.0 * (row as f64 + 0.5);
        let [lat, lon] = geographic(east, north);
        let own = terrain.height_m(lat, lon).unwrap();
        assert!(
            (own - height).abs() < 0.05,
            "{column} {row}: {own} {height}"
        );
        (lowest, highest) = (lowest.min(height), highest.max(height));
    }
    println!("heights from {lowest} to {highest} m");
    assert!(lowest > 380.0 && highest < 900.0 && highest > 600.0);
}
