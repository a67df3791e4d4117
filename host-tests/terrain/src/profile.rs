//! Profiles: the ground below each hop of a chain, and the clearance of the line of sight.
//!
//! A hop is a straight line, seen from above. Its profile has a point at every quarter of a cell of the elevation
//! model, and at each crossing with a column or row of the model. Between two points the interpolated ground is a
//! parabola. Its highest point is in the profile, too, and the point closest to the line of sight. The highest ground
//! of a profile is therefore exact.
//!
//! At the distances d1 and d2 from the ends of a hop, the earth rises by d1 d2 / 2a; a is the effective earth radius.
//!
//! | state of a hop | condition |
//! | --- | --- |
//! | clear | the ground is below the line of sight by at least 60 % of the radius of the first Fresnel zone |
//! | grazing | the ground is inside this part of the zone, but below the line of sight |
//! | blocked | the ground is above the line of sight at some point, or above an antenna |

use serde::Serialize;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Placement};

use crate::diffraction::{EARTH_M, Point};
use crate::grid::Terrain;

/// Fraction of the first Fresnel zone's radius that must be free of ground on a clear hop.
pub const FREE: f64 = 0.6;

/// Maximum number of the equal steps that divide a profile's length.
const MOST_STEPS: f64 = 20_000.0;

/// Minimum number of the equal steps that divide a profile's length.
const LEAST_STEPS: f64 = 16.0;

/// Smallest distance between two points of a profile, m.
const APART_M: f64 = 1e-3;

/// Least height difference between the vertex of a parabola and its ends, m.
///
/// The ground between two grid lines is a parabola along a straight line. A vertex with a smaller difference is no
/// profile point.
const VERTEX_M: f64 = 1e-3;

/// Side length of a square in which the elevation grid counts as linear in x and y, m.
///
/// Within the square, the column and row of a point are linear functions of x and y.
const SQUARE_M: f64 = 200.0;

/// Largest accepted difference of Tx's or Rx's height between scenario and elevation model, m.
pub const SITE_ERROR_M: f64 = 15.0;

/// Distance from Tx or Rx, m, at which the assumed error of the heights reaches its full value.
const GROWTH_M: f64 = 100.0;

/// Terrain around the line from Tx to Rx.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "millions of heights")]
pub struct Ground<'a> {
    terrain: &'a Terrain,
    axis: Axis,
    step_m: f64,
    /// Assumed error of the terrain's heights at points far from Tx and Rx, m.
    error_m: f64,
    /// Antennas of Tx and Rx, with their heights.
    pub ends: [Node; 2],
}

/// Antenna of a chain: Tx, a relay or Rx.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Node {
    /// Distance from Tx toward Rx, m.
    pub x_m: f64,
    /// Lateral position of the antenna, m; positive to the right as seen from Tx toward Rx.
    pub y_m: f64,
    /// Height of the antenna above the mean sea level, m.
    pub amsl_m: f64,
}

/// Ground below a hop, and the antennas at its two ends.
#[derive(Clone, PartialEq, Debug)]
pub struct Profile {
    /// Antennas of the hop, the antenna nearer to Tx first.
    pub nodes: [Node; 2],
    /// Points of the ground: distance from the first antenna, increasing from 0, and height, m.
    pub points: Vec<Point>,
}

/// State of the line of sight of a hop: clear, grazing or blocked.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// The line of sight is above the ground by at least 60 % of the first Fresnel zone's radius.
    Clear,
    /// The line of sight is above the ground, but its clearance is less than a clear hop needs.
    Grazing,
    /// The ground interrupts the line of sight.
    Blocked,
}

/// Clearance of a hop at its worst obstacle.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Clearance {
    /// State of the line of sight of this hop.
    pub state: State,
    /// Distance of the obstacle from the first antenna along the hop, m.
    pub along_m: f64,
    /// Height of the line of sight above the obstacle, m; negative if the hop is blocked.
    pub clearance_m: f64,
    /// Clearance that a clear hop needs at this obstacle, m.
    pub required_m: f64,
}

impl<'a> Ground<'a> {
    /// Creates the terrain along `axis`, the line from the site Tx to the site Rx.
    ///
    /// The antennas of Tx and Rx are `mast_m` above the ground.
    ///
    /// # Errors
    /// A text that names the site and the heights: the terrain does not cover the site, or contradicts its height.
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

    /// Returns the terrain with `error_m` as the assumed error of its heights. The ground counts as higher by this
    /// error.
    ///
    /// The error is 0 at Tx and Rx, because their antennas stand on the same ground. It grows to `error_m` within 100 m
    /// from them.
    #[must_use]
    pub const fn with_error_m(self, error_m: f64) -> Self {
        Self { error_m, ..self }
    }

    /// Returns the assumed error of the heights at `x_m`, m. The ground counts as higher by this error.
    ///
    /// It is 0 at Tx and Rx, and has its full value 100 m away from them.
    pub fn raise_m(&self, x_m: f64) -> f64 {
        let from_site_m = x_m.min(self.axis.distance_m() - x_m);
        self.error_m * (from_site_m / GROWTH_M).clamp(0.0, 1.0)
    }

    /// Returns the largest distance between two points of a profile, m: a quarter of a cell.
    pub const fn step_m(&self) -> f64 {
        self.step_m
    }

    /// Returns the antenna of a relay at `place`.
    ///
    /// # Errors
    /// A text that names the position, if it is too far from the line Tx-Rx.
    pub fn relay(&self, place: Placement) -> Result<Node, String> {
        let point = self.axis.point(place).ok_or_else(|| self.too_far(place))?;
        Ok(Node {
            x_m: place.x_m.into(),
            y_m: place.y_m.into(),
            amsl_m: f64::from(point.amsl_mm) / 1e3,
        })
    }

    /// Returns the geodetic position of the point at `x_m`, `y_m` and altitude 0.
    ///
    /// Points of altitude 0 are on the straight line from the ground at Tx to the ground at Rx.
    ///
    /// # Errors
    /// A text that names the position, if it is too far from the line Tx-Rx.
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

    /// Returns the height of the ground at `x_m`, `y_m`, m above the mean sea level.
    ///
    /// # Errors
    /// A text that names the position: the elevation files do not cover it, or have no height there.
    pub fn height_m(&self, x_m: f64, y_m: f64) -> Result<f64, String> {
        let there = |error| format!("x = {x_m:.1} m, y = {y_m:.1} m: {error}");
        height_at(self.terrain, self.point(x_m, y_m)?).map_err(there)
    }

    /// Returns the highest ground within `radius_m` of `node`, m above the mean sea level.
    ///
    /// The result includes the assumed error of the heights.
    ///
    /// # Errors
    /// A text that names a position: the elevation files do not cover it, or have no height there.
    pub fn highest_m(&self, node: Node, radius_m: f64) -> Result<f64, String> {
        let raise_m = self.raise_m(node.x_m);
        let mut highest = self.height_m(node.x_m, node.y_m)?;
        if radius_m > 0.0 {
            // The polygon is outside of the circle by at most a centimetre. Inside a cell the ground has no highest
            // point. So the highest ground in the polygon is on its edge, or at a node of the elevation model.
            let corners = (std::f64::consts::PI * (50.0 * radius_m).sqrt())
                .ceil()
                .max(16.0);
            let outer = radius_m / (std::f64::consts::PI / corners).cos();
            let corner = |at: f64| {
                let (sin, cos) = (std::f64::consts::TAU * at / corners).sin_cos();
                [node.x_m + outer * cos, node.y_m + outer * sin]
            };
            let mut at = 0.0;
            while at < corners {
                for [_, height] in self.line([corner(at), corner(at + 1.0)])? {
                    highest = highest.max(height);
                }
                at += 1.0;
            }
            let [low, high] = [-outer, outer].map(|off| [node.x_m + off, node.y_m + off]);
            let is_in = |[x, y]: [f64; 2]| (x - node.x_m).hypot(y - node.y_m) <= outer;
            for [_, _, height] in self.nodes([low, high], is_in)? {
                highest = highest.max(height);
            }
        }
        Ok(highest + raise_m)
    }

    /// Returns points of the ground along the straight line between two positions [x, y].
    ///
    /// Each point has the distance from the first position and the height, m. The highest and the lowest point of the
    /// ground along the line are among them. The assumed error of the heights is not added.
    ///
    /// # Errors
    /// Those of [`height_m`](Self::height_m).
    pub fn line(&self, ends: [[f64; 2]; 2]) -> Result<Vec<Point>, String> {
        let ends = ends.map(|[x_m, y_m]| Node {
            x_m,
            y_m,
            amsl_m: 0.0,
        });
        let flat = Ground {
            error_m: 0.0,
            ..*self
        };
        flat.along(ends, 1.0)
    }

    /// Returns the nodes of the elevation model in a rectangle, as [x, y, height], m.
    ///
    /// `low` has the least x and y of the rectangle, and `high` the greatest. Nodes for which `is_in` returns false are
    /// left out. The assumed error of the heights is not added.
    ///
    /// # Errors
    /// A text that names a node without a height.
    pub fn nodes(
        &self,
        [low, high]: [[f64; 2]; 2],
        is_in: impl Fn([f64; 2]) -> bool,
    ) -> Result<Vec<[f64; 3]>, String> {
        let mut nodes = Vec::new();
        let sides = [0, 1].map(|axis: usize| {
            let [from, to] = [low, high].map(|end| end.get(axis).copied().unwrap_or_default());
            let (side_m, count) = steps_of(to - from, SQUARE_M);
            (0..count.max(1))
                .map(move |at| from + side_m * f64::from(at))
                .zip(std::iter::repeat(side_m))
        });
        let [columns, rows] = sides;
        for (y, height_m) in rows {
            for (x, width_m) in columns.clone() {
                self.nodes_of([x, y], [width_m, height_m], &is_in, &mut nodes)?;
            }
        }
        Ok(nodes)
    }

    /// Adds the elevation model's nodes in a rectangle to `nodes`.
    ///
    /// The rectangle begins at [x, y], and is `wide` m long in x and `high` m in y. It must be so small that column and
    /// row are linear in x and y. Nodes for which `is_in` returns false are left out.
    fn nodes_of(
        &self,
        [x, y]: [f64; 2],
        [wide, high]: [f64; 2],
        is_in: &impl Fn([f64; 2]) -> bool,
        nodes: &mut Vec<[f64; 3]>,
    ) -> Result<(), String> {
        let turn = self.turn([x + 0.5 * wide, y + 0.5 * high])?;
        let origin = self.cells([x, y], turn)?;
        let [[a, b], [c, d]] = turn;
        let surface = a * d - b * c;
        let corners = [[0.0, 0.0], [wide, 0.0], [0.0, high], [wide, high]]
            .map(|[u, v]| [origin[0] + a * u + b * v, origin[1] + c * u + d * v]);
        let range = |axis: usize| {
            let each = corners.iter().filter_map(|corner| corner.get(axis));
            let (low, high) = each.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), at| {
                (low.min(*at), high.max(*at))
            });
            (low.ceil(), high.floor())
        };
        let ((mut row, last_row), (first, last)) = (range(1), range(0));
        while row <= last_row {
            let mut column = first;
            while column <= last {
                let [right, down] = [column - origin[0], row - origin[1]];
                let u = (right * d - down * b) / surface;
                let v = (down * a - right * c) / surface;
                // The limits are wider than the rectangle by 1 cm, so that nodes at its edge are inside.
                let is_within = |at: f64, side: f64| at >= -0.01 && at <= side + 0.01;
                let place = [x + u, y + v];
                if is_within(u, wide) && is_within(v, high) && is_in(place) {
                    let height = self.height_of([column, row], place)?;
                    nodes.push([place[0], place[1], height]);
                }
                column += 1.0;
            }
            row += 1.0;
        }
        Ok(())
    }

    /// Returns the ground height at the position [x, y]. `cells` must be the column and row of this position.
    fn height_of(&self, cells: [f64; 2], [x_m, y_m]: [f64; 2]) -> Result<f64, String> {
        let known = self.terrain.height_at(cells);
        known.map_or_else(|| self.height_m(x_m, y_m), Ok)
    }

    /// Returns the column and row of the position [x, y].
    ///
    /// Positions are rounded to 1e-7 degrees, about 1 cm. The result of [`turn`](Self::turn), given as the second
    /// argument, serves to correct this rounding.
    fn cells(&self, [x, y]: [f64; 2], [[a, b], [c, d]]: [[f64; 2]; 2]) -> Result<[f64; 2], String> {
        let point = self.point(x, y)?;
        let (lat, lon) = (f64::from(point.lat_e7) / 1e7, f64::from(point.lon_e7) / 1e7);
        let [column, row] = self.terrain.cells(lat, lon);
        let rounded = self.axis.place(point);
        let [u, v] = rounded.map_or([0.0; 2], |at| {
            [x - f64::from(at.x_m), y - f64::from(at.y_m)]
        });
        Ok([column + a * u + b * v, row + c * u + d * v])
    }

    /// Returns the derivatives of column and row with respect to x and y near a position, per metre.
    fn turn(&self, [x, y]: [f64; 2]) -> Result<[[f64; 2]; 2], String> {
        let far_m = 0.5 * SQUARE_M;
        let around_m = f64::from(Axis::AROUND_M);
        let (least, most) = (
            [-around_m; 2],
            [self.axis.distance_m() + around_m, around_m],
        );
        let between = |off: [f64; 2]| {
            // Positions exist only near the line Tx-Rx.
            let ends = [-far_m, far_m].map(|far_m| {
                [
                    (x + far_m * off[0]).clamp(least[0], most[0]),
                    (y + far_m * off[1]).clamp(least[1], most[1]),
                ]
            });
            let apart_m = (ends[1][0] - ends[0][0]) + (ends[1][1] - ends[0][1]);
            let [from, to] = ends.map(|end| self.cells(end, [[0.0; 2]; 2]));
            let (from, to) = (from?, to?);
            Ok::<_, String>([(to[0] - from[0]) / apart_m, (to[1] - from[1]) / apart_m])
        };
        let [a, c] = between([1.0, 0.0])?;
        let [b, d] = between([0.0, 1.0])?;
        Ok([[a, b], [c, d]])
    }

    /// Returns the profile of the hop between two antennas.
    ///
    /// # Errors
    /// A text that names a position: the elevation files do not cover it, or have no height there.
    pub fn profile(&self, nodes: [Node; 2]) -> Result<Profile, String> {
        Ok(Profile {
            nodes,
            points: self.along(nodes, LEAST_STEPS)?,
        })
    }

    /// Returns the points of the profile between two antennas. Their heights include the assumed error.
    ///
    /// Points are the ends of at least `least_steps` equal steps, crossings with grid lines, and vertices between
    /// these.
    fn along(&self, [from, to]: [Node; 2], least_steps: f64) -> Result<Vec<Point>, String> {
        let (dx, dy) = (to.x_m - from.x_m, to.y_m - from.y_m);
        let length = dx.hypot(dy);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 20 000"
        )]
        let steps = (length / self.step_m).ceil().clamp(least_steps, MOST_STEPS) as u32;
        let place = |share: f64| [from.x_m + share * dx, from.y_m + share * dy];
        let turn = self.turn(place(0.5))?;
        let share = |step: u32| f64::from(step) / f64::from(steps);
        let each = (0..=steps).map(|step| Ok((share(step), self.cells(place(share(step)), turn)?)));
        let each = each.collect::<Result<Vec<_>, String>>()?;
        // Fractions of the length, and cells, of all steps and of the crossings with columns and rows.
        let mut at = Vec::with_capacity(2 * each.len());
        let mut inner = Vec::new();
        for ((start, a), (end, b)) in each.iter().zip(each.iter().skip(1)) {
            at.push((*start, *a));
            inner.clear();
            for (a, b) in a.iter().zip(b) {
                let mut line = a.min(*b).floor() + 1.0;
                while line < a.max(*b) {
                    inner.push((line - a) / (b - a));
                    line += 1.0;
                }
            }
            inner.sort_by(f64::total_cmp);
            at.extend(inner.iter().map(|part| {
                let cells = [mixed(a[0], b[0], *part), mixed(a[1], b[1], *part)];
                (mixed(*start, *end, *part), cells)
            }));
        }
        at.extend(each.last());
        let height = |(share, cells): (f64, [f64; 2])| {
            let place = place(share);
            Ok::<_, String>(self.height_of(cells, place)? + self.raise_m(place[0]))
        };
        let rise = |share: f64| {
            let along = share * length;
            bulge_m(along, length) - mixed(from.amsl_m, to.amsl_m, share)
        };
        let mut points: Vec<Point> = Vec::with_capacity(at.len());
        let mut push = |share: f64, height: f64| {
            let along = share * length;
            let is_apart = |[last, _]: &Point| along - last >= APART_M;
            let is_inner = length - along >= APART_M;
            if points.is_empty() || points.last().is_some_and(is_apart) && is_inner {
                points.push([along, height]);
            }
        };
        for (start, end) in at.iter().zip(at.iter().skip(1)) {
            let (share, cells) = (
                start.0.midpoint(end.0),
                [start.1[0].midpoint(end.1[0]), start.1[1].midpoint(end.1[1])],
            );
            let heights = [height(*start)?, height((share, cells))?, height(*end)?];
            let above = [start.0, share, end.0].map(rise);
            push(start.0, heights[0]);
            let least = [0, 1, 2].map(|at: usize| {
                heights
                    .get(at)
                    .zip(above.get(at))
                    .map_or(0.0, |(height, rise)| height + rise)
            });
            let mut peaks = [vertex(heights), vertex(least)].map(Option::unwrap_or_default);
            peaks.sort_by(f64::total_cmp);
            for part in peaks.into_iter().filter(|part| *part > 0.0) {
                push(mixed(start.0, end.0, part), parabola(heights, part));
            }
        }
        if let Some(end) = at.last() {
            points.push([length, height(*end)?]);
        }
        Ok(points)
    }
}

/// Divides a length into equal steps of at most `step_m`. Returns the step and the number of steps.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "0 to 1e6"
)]
pub(crate) fn steps_of(length_m: f64, step_m: f64) -> (f64, u32) {
    let steps = (length_m / step_m).ceil().clamp(0.0, 1e6);
    (length_m / steps.max(1.0), steps as u32)
}

const fn mixed(from: f64, to: f64, share: f64) -> f64 {
    from + share * (to - from)
}

/// Returns the value at `share`, 0 to 1, of the parabola through `start`, `middle` and `end`.
///
/// These are its values at 0, 1/2 and 1.
fn parabola([start, middle, end]: [f64; 3], share: f64) -> f64 {
    let slope = 4.0 * middle - 3.0 * start - end;
    let bend = 2.0 * (start + end) - 4.0 * middle;
    start + share * (slope + share * bend)
}

/// Returns the extremum, a number from 0 to 1, of the parabola through three values at 0, 1/2 and 1.
///
/// `None` if the extremum is not between 0 and 1, or if its value is within a millimetre of the value at 0 or 1.
fn vertex([start, middle, end]: [f64; 3]) -> Option<f64> {
    let slope = 4.0 * middle - 3.0 * start - end;
    let bend = 2.0 * (start + end) - 4.0 * middle;
    let share = -slope / (2.0 * bend);
    let beside = share.min(1.0 - share);
    (beside > 0.0 && bend.abs() * beside * beside > VERTEX_M).then_some(share)
}

fn height_at(terrain: &Terrain, point: Geodetic) -> Result<f64, String> {
    terrain.height_m(f64::from(point.lat_e7) / 1e7, f64::from(point.lon_e7) / 1e7)
}

/// Returns the height of the curved earth above the straight line between a hop's ends, m.
///
/// `along_m` is the distance from one end, and `length_m` is the length of the hop.
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
        // At an antenna the Fresnel zone has no radius, so the ends of a hop count only if an antenna is below the
        // ground.
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
