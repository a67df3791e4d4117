//! Profiles: the ground below each hop of a chain, and the clearance of the line of sight.
//!
//! A hop runs straight, seen from above. Its profile has a height at every quarter of a cell of the elevation model. Along
//! the hop the earth rises
//! by d1 d2 / 2a between its ends, with the distances d1 and d2 from the ends and the effective radius a.
//!
//! | state of a hop | condition |
//! | --- | --- |
//! | clear | the ground is below the line of sight by at least 60 % of the radius of the first Fresnel zone |
//! | grazing | the ground is inside this part of the zone, but below the line of sight |
//! | blocked | the ground is above the line of sight somewhere, or above a relay |

use serde::Serialize;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};

use crate::diffraction::{EARTH_M, Point};
use crate::grid::Terrain;

/// Fraction of the radius of the first Fresnel zone that a clear hop keeps free of the ground.
pub const FREE: f64 = 0.6;

/// Largest number of points of a profile, apart from its first point.
const MOST_POINTS: f64 = 20_000.0;

/// Largest accepted difference of a site's heights in scenario and elevation model, m.
pub const SITE_ERROR_M: f64 = 15.0;

/// Distance from Tx or Rx at which the assumed error of the heights reaches its full value, m.
const GROWTH_M: f64 = 100.0;

/// Terrain along the line from Tx to Rx.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "millions of heights")]
pub struct Ground<'a> {
    terrain: &'a Terrain,
    axis: Axis,
    step_m: f64,
    /// Assumed error of the terrain's heights away from Tx and Rx, m.
    error_m: f64,
    /// Antennas of Tx and Rx, with their heights.
    pub ends: [Node; 2],
}

/// Antenna of a chain: Tx, a relay or Rx.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Node {
    /// Distance from Tx along the line to Rx, m.
    pub x_m: f64,
    /// Lateral position of the antenna, m; positive to the right of the line.
    pub y_m: f64,
    /// Height of the antenna above the mean sea level, m.
    pub amsl_m: f64,
}

/// Ground below a hop, and the antennas at its two ends.
#[derive(Clone, PartialEq, Debug)]
pub struct Profile {
    /// Antennas of the hop, the antenna nearer to Tx first.
    pub nodes: [Node; 2],
    /// Distances from the first antenna, increasing from 0, and heights of the ground, m.
    pub points: Vec<Point>,
}

/// State of the line of sight of a hop: clear, grazing or blocked.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// The first Fresnel zone is free of the ground.
    Clear,
    /// The ground is in the first Fresnel zone, below the line of sight.
    Grazing,
    /// The ground is above the line of sight.
    Blocked,
}

/// Clearance of a hop at its worst obstacle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Clearance {
    /// State of the line of sight of this hop.
    pub state: State,
    /// Distance of the obstacle from the first antenna along the hop, m.
    pub along_m: f64,
    /// Height of the line of sight above the obstacle, m; below 0 if the hop is blocked.
    pub clearance_m: f64,
    /// Clearance that a clear hop needs at this obstacle, m.
    pub required_m: f64,
}

impl<'a> Ground<'a> {
    /// Creates the terrain along `axis`, the line between the sites Tx and Rx.
    ///
    /// The antennas of Tx and Rx are `mast_m` above the ground.
    ///
    /// # Errors
    /// A line that names the site and the heights: the terrain does not cover a site, or contradicts its height.
    pub fn new(
        terrain: &'a Terrain,
        axis: Axis,
        sites: [Geodetic; 2],
        mast_m: f64,
    ) -> Result<Self, String> {
        let x_m = [0.0, axis.distance_m()];
        let mut ends = x_m.map(|x_m| Node {
            x_m,
            y_m: 0.0,
            amsl_m: 0.0,
        });
        for ((name, site), end) in ["tx", "rx"].iter().zip(sites).zip(&mut ends) {
            let ground_m =
                height_at(terrain, site).map_err(|error| format!("site.{name}: {error}"))?;
            let amsl_m = f64::from(site.amsl_mm) / 1e3;
            if (ground_m - amsl_m).abs() > SITE_ERROR_M {
                return Err(format!(
                    "site.{name}.amsl_m = {amsl_m}: the elevation files have {ground_m:.1} m there; allowed: a difference of at most {SITE_ERROR_M} m (amsl_m is the height above mean sea level; a satellite receiver may give the height above the ellipsoid, which differs by up to 100 m)"
                ));
            }
            end.amsl_m = ground_m + mast_m;
        }
        let lat_deg = f64::from(sites[0].lat_e7) / 1e7;
        let step_m = terrain.cell_m(lat_deg) / 4.0;
        Ok(Self {
            terrain,
            axis,
            step_m,
            error_m: 0.0,
            ends,
        })
    }

    /// Returns the terrain with an assumed error of its heights: the ground counts as higher by `error_m`.
    ///
    /// The error is 0 at Tx and at Rx, because their antennas stand on the same ground. Within 100 m from Tx or Rx it grows to `error_m`.
    #[must_use]
    pub const fn with_error_m(self, error_m: f64) -> Self {
        Self { error_m, ..self }
    }

    /// Returns the assumed error of the terrain's heights at `x_m` along the line, m. The ground counts as higher by this amount. The
    /// amount is 0 at Tx and Rx, and has its full value 100 m away from them.
    pub fn raise_m(&self, x_m: f64) -> f64 {
        let from_site_m = x_m.min(self.axis.distance_m() - x_m);
        self.error_m * (from_site_m / GROWTH_M).clamp(0.0, 1.0)
    }

    /// Returns the largest distance of two points of a profile, m. It is a quarter of a cell of the elevation model.
    pub const fn step_m(&self) -> f64 {
        self.step_m
    }

    /// Returns a relay's antenna.
    ///
    /// # Errors
    /// A line that names the position, if it is too far from the line.
    pub fn relay(&self, place: Placement) -> Result<Node, String> {
        let point = self.axis.point(place).ok_or_else(|| self.too_far(place))?;
        Ok(Node {
            x_m: place.x_m.into(),
            y_m: place.y_m.into(),
            amsl_m: f64::from(point.amsl_mm) / 1e3,
        })
    }

    /// Returns the point at `x_m` along the line and `y_m` beside it, at altitude 0. Altitude 0 is the straight line from the ground at Tx
    /// to the ground at Rx.
    ///
    /// # Errors
    /// A line that names the position, if it is too far from the line.
    #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
    pub fn point(&self, x_m: f64, y_m: f64) -> Result<Geodetic, String> {
        let place = Placement {
            x_m: x_m as f32,
            y_m: y_m as f32,
            altitude_m: 0.0,
        };
        self.axis.point(place).ok_or_else(|| self.too_far(place))
    }

    fn too_far(&self, place: Placement) -> String {
        let around_m = Axis::AROUND_M;
        format!(
            "x = {:.1} m, y = {:.1} m, altitude {:.1} m is too far from the line from Tx to Rx; allowed: x from {:.0} to {:.0} m, y and altitude from {:.0} to {around_m:.0} m",
            place.x_m,
            place.y_m,
            place.altitude_m,
            -around_m,
            self.axis.distance_m() + f64::from(around_m),
            -around_m
        )
    }

    /// Returns the height of the ground above the mean sea level, m.
    ///
    /// The position is `x_m` along the line and `y_m` beside it.
    ///
    /// # Errors
    /// A line that names the position: the elevation files do not cover it, or have no height there.
    pub fn height_m(&self, x_m: f64, y_m: f64) -> Result<f64, String> {
        let there = |error| format!("x = {x_m:.1} m, y = {y_m:.1} m: {error}");
        height_at(self.terrain, self.point(x_m, y_m)?).map_err(there)
    }

    /// Returns the highest ground within `radius_m` of a position, m above the mean sea level.
    ///
    /// # Errors
    /// A line that names a position: the elevation files do not cover it, or have no height there.
    pub fn highest_m(&self, node: Node, radius_m: f64) -> Result<f64, String> {
        let rings = (radius_m / self.step_m).ceil().min(64.0);
        let mut highest = self.height_m(node.x_m, node.y_m)?;
        let raise_m = self.raise_m(node.x_m);
        let mut ring = 1.0;
        while ring <= rings {
            let radius = radius_m * ring / rings;
            let points = (std::f64::consts::TAU * radius / self.step_m)
                .ceil()
                .clamp(16.0, 400.0);
            let mut point = 0.0;
            while point < points {
                let (sin, cos) = (std::f64::consts::TAU * point / points).sin_cos();
                highest =
                    highest.max(self.height_m(node.x_m + radius * cos, node.y_m + radius * sin)?);
                point += 1.0;
            }
            ring += 1.0;
        }
        Ok(highest + raise_m)
    }

    /// Returns the profile of the hop between two antennas.
    ///
    /// # Errors
    /// A line that names a position: the elevation files do not cover it, or have no height there.
    pub fn profile(&self, nodes: [Node; 2]) -> Result<Profile, String> {
        let [from, to] = nodes;
        let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
        let length = dx.hypot(dy);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "16 to 20 000"
        )]
        let steps = (length / self.step_m).ceil().clamp(16.0, MOST_POINTS) as u32;
        let points = (0..=steps).map(|step| {
            let share = f64::from(step) / f64::from(steps);
            let x_m = from.x_m + share * dx;
            let height = self.height_m(x_m, from.y_m + share * dy)?;
            Ok([share * length, height + self.raise_m(x_m)])
        });
        Ok(Profile {
            nodes,
            points: points.collect::<Result<_, String>>()?,
        })
    }
}

fn height_at(terrain: &Terrain, point: Geodetic) -> Result<f64, String> {
    terrain.height_m(f64::from(point.lat_e7) / 1e7, f64::from(point.lon_e7) / 1e7)
}

/// Returns the height by which the earth rises above the straight line between the ends of a hop, m.
pub fn bulge_m(along_m: f64, length_m: f64) -> f64 {
    along_m * (length_m - along_m) / (2.0 * EARTH_M)
}

impl Profile {
    /// Returns the length of the hop along the ground, m.
    pub fn length_m(&self) -> f64 {
        self.points.last().map_or(0.0, |[length, _]| *length)
    }

    /// Returns the radius of the first Fresnel zone at a distance from the first antenna, m.
    pub fn fresnel_m(&self, along_m: f64, wavelength_m: f64) -> f64 {
        let length = self.length_m();
        if !(length > 0.0) {
            return 0.0;
        }
        (wavelength_m * along_m * (length - along_m) / length)
            .max(0.0)
            .sqrt()
    }

    /// Returns the clearance of the hop at its worst obstacle.
    pub fn clearance(&self, wavelength_m: f64) -> Clearance {
        let length = self.length_m();
        let [from, to] = self.nodes.map(|node| node.amsl_m);
        let at = |&[along_m, height]: &Point| {
            let share = if length > 0.0 { along_m / length } else { 0.0 };
            let sight = from + share * (to - from);
            let clearance_m = sight - height - bulge_m(along_m, length);
            let required_m = FREE * self.fresnel_m(along_m, wavelength_m);
            let state = if clearance_m < 0.0 {
                State::Blocked
            } else if clearance_m < required_m {
                State::Grazing
            } else {
                State::Clear
            };
            Clearance {
                state,
                along_m,
                clearance_m,
                required_m,
            }
        };
        let all = || self.points.iter().map(at);
        // At an antenna the zone has no radius, so its margin is the height of the mast: it counts only if the antenna is below the ground.
        let blocked = all().filter(|point| point.state == State::Blocked);
        let blocked = blocked.min_by(|a, b| a.clearance_m.total_cmp(&b.clearance_m));
        let margin = |point: &Clearance| point.clearance_m - point.required_m;
        let inner = || all().filter(|point| point.along_m > 0.0 && point.along_m < length);
        let nearest = inner().min_by(|a, b| margin(a).total_cmp(&margin(b)));
        blocked.or(nearest).unwrap_or(Clearance {
            state: State::Clear,
            along_m: 0.0,
            clearance_m: 0.0,
            required_m: 0.0,
        })
    }
}
