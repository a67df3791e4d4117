//! Narrow peaks of a single grid point: no profile, circle or room may miss such a peak.

use std::collections::HashMap;
use std::path::PathBuf;

use geographiclib_rs::{DirectGeodesic as _, Geodesic, InverseGeodesic as _};
use rand::RngExt as _;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};
use uav_relay_terrain::diffraction::EARTH_M;
use uav_relay_terrain::grid::Terrain;
use uav_relay_terrain::profile::{Ground, Node, State};
use uav_relay_terrain::report::{FreeSpace, TerrainReport};
use uav_relay_terrain::room::{Limits, rooms};

use crate::files::Raster;
use crate::grids::utm;
use crate::{rng, seeds};

/// Height of the plain around the peaks, m.
const PLAIN_M: f64 = 500.0;

const WAVE_M: f64 = 0.125;

/// Plain with narrow peaks, each of a single grid point.
///
/// `Peaks` computes the surface of the plain itself, independently of the planner.
struct Peaks {
    corner: [f64; 2],
    cell: [f64; 2],
    is_utm: bool,
    /// Heights of the peaks above the plain, m, by column and row.
    heights: HashMap<[i64; 2], f64>,
}

impl Peaks {
    /// Draws random peaks near a line. The elevation data are in two files, side by side.
    fn new(rng: &mut impl rand::Rng, ends: [[f64; 2]; 2], is_utm: bool) -> Self {
        let at = ends.map(|[lat, lon]| {
            if is_utm {
                utm(lat, lon, 32.0)
            } else {
                [lon, lat]
            }
        });
        let (cell, margin) = if is_utm {
            (10.0, 200.0)
        } else {
            (1.0 / 3600.0, 0.003)
        };
        let west = at[0][0].min(at[1][0]) - margin;
        let north = at[0][1].max(at[1][1]) + margin;
        let corner = [(west / cell).floor() * cell, (north / cell).ceil() * cell];
        let mut peaks = Self {
            corner,
            cell: [cell; 2],
            is_utm,
            heights: HashMap::new(),
        };
        for _ in 0..6 {
            let share = rng.random_range(0.05..0.95);
            let near = [0, 1].map(|axis: usize| {
                let cells = peaks.cells_of(ends[0])[axis] * (1.0 - share)
                    + peaks.cells_of(ends[1])[axis] * share;
                cells.round() as i64 + rng.random_range(-1..=1_i64)
            });
            let height = rng.random_range(3.0..25.0);
            peaks.heights.insert(near, height);
        }
        peaks
    }

    fn cells_of(&self, [lat, lon]: [f64; 2]) -> [f64; 2] {
        let [east, north] = if self.is_utm {
            utm(lat, lon, 32.0)
        } else {
            [lon, lat]
        };
        [
            (east - self.corner[0]) / self.cell[0],
            (self.corner[1] - north) / self.cell[1],
        ]
    }

    /// Returns the height of the bilinear surface at a latitude and longitude, m.
    fn height_m(&self, place: [f64; 2]) -> f64 {
        let [column, row] = self.cells_of(place);
        let (first, top) = (column.floor(), row.floor());
        let node = |right: f64, down: f64| {
            let at = [(first + right) as i64, (top + down) as i64];
            self.heights.get(&at).copied().unwrap_or(0.0)
        };
        let (u, v) = (column - first, row - top);
        PLAIN_M
            + node(0.0, 0.0) * (1.0 - u) * (1.0 - v)
            + node(1.0, 0.0) * u * (1.0 - v)
            + node(0.0, 1.0) * (1.0 - u) * v
            + node(1.0, 1.0) * u * v
    }

    fn terrain(
        &self,
        folder: &std::path::Path,
        rng: &mut impl rand::Rng,
        ends: [[f64; 2]; 2],
    ) -> Terrain {
        let far = ends.map(|end| self.cells_of(end));
        let columns = far[0][0].max(far[1][0]).ceil() as u32 + 25;
        let rows = far[0][1].max(far[1][1]).ceil() as u32 + 25;
        let split = rng.random_range(10..columns - 10);
        let mut files: Vec<PathBuf> = Vec::new();
        for (name, from, to) in [("west.tif", 0, split), ("east.tif", split, columns)] {
            let file = folder.join(name);
            let corner = [
                self.corner[0] + f64::from(from) * self.cell[0],
                self.corner[1],
            ];
            let raster = Raster {
                epsg: if self.is_utm { 32632 } else { 4326 },
                cell: self.cell,
                ..Raster::geographic(corner[0], corner[1], 1.0, [to - from, rows])
            };
            raster.write(&file, |east, north| {
                let at = [
                    ((east - self.corner[0]) / self.cell[0]).round() as i64,
                    ((self.corner[1] - north) / self.cell[1]).round() as i64,
                ];
                PLAIN_M + self.heights.get(&at).copied().unwrap_or(0.0)
            });
            files.push(file);
        }
        Terrain::load(&files).unwrap()
    }
}

struct Scene {
    peaks: Peaks,
    terrain: Terrain,
    sites: [Geodetic; 2],
    axis: Axis,
    ends: [[f64; 2]; 2],
}

fn scene(folder: &std::path::Path, seed: u64) -> Scene {
    let rng = &mut rng(seed);
    let (lat, lon) = (rng.random_range(46.5..47.5), rng.random_range(8.2..9.8));
    // One line in six is almost parallel to a row, and one in six to a column.
    let reach = |rng: &mut chacha20::ChaCha8Rng, narrow: bool| {
        let far = if narrow { 0.0002 } else { 0.02 };
        rng.random_range(-far..far)
    };
    let (dlat, dlon) = (reach(rng, seed % 6 == 1), reach(rng, seed % 6 == 2));
    let away = if f64::hypot(dlat, dlon) < 0.005 {
        0.01
    } else {
        0.0
    };
    let (dlat, dlon) = if seed % 6 == 1 {
        (dlat, dlon + away)
    } else {
        (dlat + away, dlon)
    };
    let ends = [[lat, lon], [lat + dlat, lon + dlon]];
    let sites = ends.map(|[lat, lon]| Geodetic::from_degrees(lat, lon, PLAIN_M).unwrap());
    let ends = sites.map(|site| [f64::from(site.lat_e7) / 1e7, f64::from(site.lon_e7) / 1e7]);
    let peaks = Peaks::new(rng, ends, seed.is_multiple_of(2));
    let terrain = peaks.terrain(folder, rng, ends);
    let axis = Axis::try_new(sites[0], sites[1]).unwrap();
    Scene {
        peaks,
        terrain,
        sites,
        axis,
        ends,
    }
}

#[test]
fn profiles_have_the_highest_ground_and_blocked_hops_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let earth = Geodesic::wgs84();
    let (mut worst, mut blocked, mut above) = (0.0_f64, 0, 0);
    for seed in seeds(120) {
        let Scene {
            peaks,
            terrain,
            sites,
            axis,
            ends,
        } = scene(folder.path(), seed);
        let ground = Ground::new(&terrain, axis, sites, 40.0).unwrap();
        let rng = &mut rng(seed + 1_000_000);
        let d = axis.distance_m();
        let (from, to) = (rng.random_range(0.0..0.3 * d), rng.random_range(0.7 * d..d));
        let node = |x_m: f64, amsl_m: f64| Node {
            x_m,
            y_m: 0.0,
            amsl_m,
        };
        let (h0, h1) = (
            rng.random_range(503.0..520.0),
            rng.random_range(503.0..520.0),
        );
        let profile = ground.profile([node(from, h0), node(to, h1)]).unwrap();
        // As an independent check, the surface is sampled at every 400th of a cell along the geodesic.
        let (_, azimuth, _, _): (f64, f64, f64, f64) =
            earth.inverse(ends[0][0], ends[0][1], ends[1][0], ends[1][1]);
        let cell_m = if peaks.is_utm { 10.0 } else { 21.0 };
        let steps = (400.0 * (to - from) / cell_m).ceil() as u32;
        // Between these points of the geodesic, latitude and longitude are linear to a micrometre.
        let known: Vec<[f64; 2]> = (0..=steps / 100 + 2)
            .map(|part| {
                let along = (to - from) * 100.0 * f64::from(part) / f64::from(steps);
                let (lat, lon, _): (f64, f64, f64) =
                    earth.direct(ends[0][0], ends[0][1], azimuth, from + along);
                [lat, lon]
            })
            .collect();
        let at = |step: f64| {
            let part = (step / 100.0).floor();
            let share = step / 100.0 - part;
            let part = part as usize;
            let place = [0, 1]
                .map(|k: usize| known[part][k] + share * (known[part + 1][k] - known[part][k]));
            let height = peaks.height_m(place);
            let along = (to - from) * step / f64::from(steps);
            let sight = h0 + (h1 - h0) * along / (to - from);
            let bulge = along * (to - from - along) / (2.0 * EARTH_M);
            [height, -(sight - height - bulge)]
        };
        // The largest value of each kind is searched again around its point, in steps a hundred times as fine.
        let [highest, above_m] = [0, 1].map(|of: usize| {
            let largest = |from: f64, apart: f64, count: u32| {
                let all = (0..=count).map(|step| from + apart * f64::from(step));
                all.map(|step| {
                    (
                        step.clamp(0.0, steps.into()),
                        at(step.clamp(0.0, steps.into()))[of],
                    )
                })
                .max_by(|a, b| a.1.total_cmp(&b.1))
                .unwrap()
            };
            let (step, _) = largest(0.0, 1.0, steps);
            largest(step - 1.0, 0.01, 200).1
        });
        let least = -above_m;
        let found = profile
            .points
            .iter()
            .map(|point| point[1])
            .fold(0.0, f64::max);
        worst = worst.max((found - highest).abs());
        assert!(
            (found - highest).abs() < 0.01,
            "seed {seed}: {found} {highest}"
        );
        let clearance = profile.clearance(WAVE_M);
        if least.abs() > 0.01 {
            assert_eq!(
                clearance.state == State::Blocked,
                least < 0.0,
                "seed {seed}: {least} {clearance:?}"
            );
        }
        if least < 0.0 {
            blocked += 1;
            assert!(
                (clearance.clearance_m - least).abs() < 0.01,
                "seed {seed}: {least} {clearance:?}"
            );
        } else {
            above += 1;
        }
    }
    println!(
        "largest error of the highest ground: {worst:.4} m; {blocked} hops blocked, {above} not"
    );
    assert!(blocked > 20 && above > 20 || std::env::var("COUNT").is_ok());
}

#[test]
fn the_highest_ground_near_a_relay_is_that_of_the_surface() {
    let folder = tempfile::tempdir().unwrap();
    let mut peaks_near = 0;
    for seed in seeds(60) {
        let Scene {
            peaks,
            terrain,
            sites,
            axis,
            ..
        } = scene(folder.path(), seed);
        let ground = Ground::new(&terrain, axis, sites, 40.0).unwrap();
        let rng = &mut rng(seed + 2_000_000);
        let radius = [0.5, 1.0, 8.0, 45.0][(seed % 4) as usize];
        let surface = |x: f64, y: f64| {
            let point = ground.point(x, y).unwrap();
            peaks.height_m([f64::from(point.lat_e7) / 1e7, f64::from(point.lon_e7) / 1e7])
        };
        // This is a position beside a peak.
        let node = (0..500).map(|_| Node {
            x_m: rng.random_range(0.05..0.95) * axis.distance_m(),
            y_m: rng.random_range(-20.0..20.0),
            amsl_m: 600.0,
        });
        let is_beside = |node: &Node| surface(node.x_m + radius, node.y_m) > PLAIN_M + 1.0;
        let Some(node) = node.into_iter().find(is_beside) else {
            continue;
        };
        let found = ground.highest_m(node, radius).unwrap();
        let mut highest = 0.0_f64;
        for ring in 0..=30_u32 {
            for angle in 0..720_u32 {
                let (sin, cos) = (0.5 * f64::from(angle)).to_radians().sin_cos();
                let r = radius * f64::from(ring) / 30.0;
                highest = highest.max(surface(node.x_m + r * cos, node.y_m + r * sin));
            }
        }
        peaks_near += u32::from(highest > PLAIN_M + 1.0);
        // The distance between samples of the check is up to 1.5 m.
        let steep = if peaks.is_utm { 2.5 } else { 1.2 };
        let apart = 0.5 * radius / 30.0 + radius * 0.00873;
        assert!(found > highest - 0.02, "seed {seed}: {found} {highest}");
        assert!(
            found < highest + 0.05 + 1.5 * steep * apart,
            "seed {seed}: {found} {highest}"
        );
    }
    assert!(
        peaks_near > 40 || std::env::var("COUNT").is_ok(),
        "{peaks_near}"
    );
}

#[test]
#[expect(clippy::too_many_lines, reason = "scenes, and three checks of each")]
fn no_hop_between_two_rooms_is_blocked_by_a_peak() {
    let folder = tempfile::tempdir().unwrap();
    let (mut with_room, mut in_room, mut wide_m) = (0, 0, 0.0_f64);
    for seed in seeds(40).map(|seed| seed + 60) {
        let Scene {
            peaks,
            terrain,
            sites,
            axis,
            ..
        } = scene(folder.path(), seed);
        let ground = Ground::new(&terrain, axis, sites, 20.0).unwrap();
        let rng = &mut rng(seed + 3_000_000);
        let d = axis.distance_m();
        let error = [0.5, 5.0][(seed % 2) as usize];
        // These are x, y and height of the peaks in the elevation files.
        let at = |(at, height): (&[i64; 2], &f64)| {
            let [lon, lat] = [
                peaks.corner[0] + at[0] as f64 * peaks.cell[0],
                peaks.corner[1] - at[1] as f64 * peaks.cell[1],
            ];
            let place = axis.place(Geodetic::from_degrees(lat, lon, PLAIN_M)?)?;
            Some([f64::from(place.x_m), f64::from(place.y_m), *height])
        };
        let known: Vec<[f64; 3]> = if peaks.is_utm {
            Vec::new()
        } else {
            peaks.heights.iter().filter_map(at).collect()
        };
        let beside = known.iter().filter(|peak| peak[1].abs() < error);
        let mut tops: Vec<f64> = beside
            .map(|peak| peak[2])
            .filter(|top| *top > 8.0)
            .collect();
        tops.sort_by(f64::total_cmp);
        tops.push(18.0);
        let places = [0.33, 0.66].map(|share| Placement {
            x_m: (share * d) as f32,
            y_m: 0.0,
            // The relays fly about as high as the peaks, so that the peaks limit the rooms.
            altitude_m: (rng.random_range(-1.0..1.0) + tops[rng.random_range(0..tops.len())])
                as f32,
        });
        let free = FreeSpace {
            sirs: &[1.0; 3],
            sirs_back: &[],
            reverse: 0.0,
        };
        let report = TerrainReport::new(&ground, &places, free, 2.4e9, error).unwrap();
        if report.blocked().is_some() {
            continue;
        }
        let limits = Limits {
            position_error_m: error,
            above_ground_m: [1.0, f64::INFINITY],
            apart_m: 5.0,
            wavelength_m: WAVE_M,
        };
        let found = rooms(&ground, &places, &report, limits).unwrap();
        let [Some(first), Some(second)] = found[..] else {
            continue;
        };
        with_room += 1;
        wide_m = wide_m.max(first[1] - first[0]);
        let height = |x: f64, y: f64| {
            let point = ground.point(x, y).unwrap();
            peaks.height_m([f64::from(point.lat_e7) / 1e7, f64::from(point.lon_e7) / 1e7])
        };
        let datum = |x: f64| f64::from(ground.point(x, 0.0).unwrap().amsl_mm) / 1e3;
        for (room, place) in [first, second].iter().zip(&places) {
            for [x, y, top] in &known {
                let along = room[0] - error..=room[1] + error;
                if along.contains(x) && y.abs() <= error {
                    in_room += 1;
                    let least = PLAIN_M + top + 1.0 - 0.05;
                    assert!(
                        datum(*x) + f64::from(place.altitude_m) >= least,
                        "seed {seed}: peak of {top} m at {x} in {room:?} of {place:?}"
                    );
                }
            }
        }
        // Tested are all combinations of the ends of the rooms, with the position error, and random positions.
        for draw in 0..8_u32 {
            let mut nodes = vec![[0.0, 0.0, ground.ends[0].amsl_m]];
            for (relay, (room, place)) in [first, second].iter().zip(&places).enumerate() {
                let end = (draw >> relay) as usize % 2;
                let outer = [room[0] - error, room[1] + error];
                let (x, y) = if draw < 4 {
                    (outer[end], 0.0)
                } else {
                    let y = rng.random_range(-error..error);
                    (rng.random_range(outer[0]..outer[1]), y)
                };
                let amsl = datum(x) + f64::from(place.altitude_m) - error;
                nodes.push([x, y, amsl]);
                assert!(
                    amsl + error - height(x, y) >= 1.0 - 0.05,
                    "seed {seed}: relay at {x} {y}"
                );
            }
            nodes.push([d, 0.0, ground.ends[1].amsl_m]);
            for hop in nodes.windows(2) {
                let [a, b] = [hop[0], hop[1]];
                let length = (b[0] - a[0]).hypot(b[1] - a[1]);
                let steps = length.ceil() as u32;
                for step in 0..=steps {
                    let share = f64::from(step) / f64::from(steps);
                    let at = [0, 1, 2].map(|k: usize| a[k] + share * (b[k] - a[k]));
                    let bulge = share * (1.0 - share) * length * length / (2.0 * EARTH_M);
                    let clear = at[2] - bulge - height(at[0], at[1]);
                    assert!(
                        clear > -0.05,
                        "seed {seed}: {clear} m at x = {} of {hop:?}",
                        at[0]
                    );
                }
            }
        }
    }
    println!("{with_room} scenes with rooms, {in_room} peaks in them, widest {wide_m:.0} m");
    assert!(
        with_room > 8 || std::env::var("COUNT").is_ok(),
        "{with_room}"
    );
}

#[test]
fn a_relay_that_may_be_beyond_a_site_has_no_room() {
    let folder = tempfile::tempdir().unwrap();
    let Scene {
        terrain,
        sites,
        axis,
        ..
    } = scene(folder.path(), 1);
    let ground = Ground::new(&terrain, axis, sites, 60.0).unwrap();
    let d = axis.distance_m();
    let free = FreeSpace {
        sirs: &[1.0; 3],
        sirs_back: &[],
        reverse: 0.0,
    };
    let limits = Limits {
        position_error_m: 1.0,
        above_ground_m: [1.0, f64::INFINITY],
        apart_m: 5.0,
        wavelength_m: WAVE_M,
    };
    let rooms_at = |x: [f64; 2]| {
        let places = x.map(|x_m| Placement {
            x_m: x_m as f32,
            y_m: 0.0,
            altitude_m: 60.0,
        });
        let report = TerrainReport::new(&ground, &places, free, 2.4e9, 1.0).unwrap();
        rooms(&ground, &places, &report, limits).unwrap()
    };
    // Heights are known up to the limit of the coordinates.
    let far = Node {
        x_m: 100.0,
        y_m: -4999.5,
        amsl_m: 600.0,
    };
    let line = ground.highest_m(far, 0.4).unwrap_err();
    assert!(
        line.contains("is not covered by the elevation files"),
        "{line}"
    );
    // An earlier version returned reversed intervals here.
    let near = rooms_at([0.4, d - 0.4]);
    assert_eq!(near, [None, None]);
    for room in rooms_at([30.0, d - 30.0]) {
        let [low, high] = room.unwrap();
        assert!(low < high);
    }
}
