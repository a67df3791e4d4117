//! Single hypothetical interferer that replaces several. The paper's "Extension to Multiple Sources of Interference".
//!
//! The fit minimises the integral of |p_H / ((x - x_H)^2 + y_H^2 + h^2) - S| over [0, D] and all altitudes. S is the
//! sum of the same term over the true interferers. The best p_H at a position is a weighted median
//! ([`Raster::best_power`]). The position is searched on a grid, and then by simplexes from the grid's best local
//! minima and from the true interferers. The global minimum may be missed: a test compares the result with 20 000
//! random positions in each of 20 scenes.
//!
//! The paper restricts x_H to [0, D]. This does not fit if all interferers are beyond Rx, so here x_H may reach the
//! outermost interferer. y_H is at most 30 times the size of the scene: the interference is then uniform to a
//! thousandth.

use super::Source;
use super::scene::{Place, Scene};

/// Approximate number of quadrature points for the grid search and the first local searches.
const COARSE: usize = 400;

/// Approximate number of quadrature points for the last local searches.
///
/// They start at the best results of the first local searches.
const FINE: usize = 4_000;

/// Number of steps from Tx to Rx in the grid of relay positions of [`Hypothetical::sided`].
const ALONG: u32 = 64;
/// Number of lateral steps in the grid of relay positions of [`Hypothetical::sided`].
const ASIDE: u32 = 8;

/// Approximate number of quadrature points for the reported error.
const REPORTED: usize = 60_000;

/// Largest lateral distance y_H in the search, as a multiple of the scene's size.
///
/// An interferer at this distance causes nearly the same interference at all relay positions: the difference is at most
/// a thousandth. The size of the scene is its largest extent in x, y or altitude.
const FAR: f64 = 30.0;

/// Step of the search grid in the coordinate u = asinh(y_H / lowest relay altitude).
///
/// y_H is the lateral distance of the hypothetical interferer. Far from the line Tx-Rx each step multiplies y_H by
/// about 1.4.
const RISE: f64 = 0.35;

/// Largest number of local searches that start at local minima of the error on a grid.
///
/// It is also the largest number of further searches that start at the positions of true interferers.
const VALLEYS: usize = 6;

const FINALISTS: usize = 3;

/// A hypothetical interferer that replaces all interferers of a scene, and the error that this causes.
///
/// The error is the difference between its interference power and that of the true interferers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothetical {
    /// Transmit power of the hypothetical interferer (p_H), W, > 0.
    pub power_w: f64,
    /// Position of the hypothetical interferer along the line from Tx to Rx (x_H), m.
    pub x_m: f64,
    /// Lateral position of the hypothetical interferer (y_H), m; positive to the right as seen from Tx.
    pub y_m: f64,
    /// Mean absolute error of the interference power at the possible relay positions, W.
    ///
    /// The possible positions are in the vertical plane from Tx to Rx, between the lowest and the highest altitude.
    pub mean_abs_error_w: f64,
    /// Integral of the absolute error, divided by the integral of the true interference.
    ///
    /// 0 is a perfect fit. Both integrals are over the possible relay positions in the vertical plane from Tx to Rx.
    pub relative_error: f64,
}

impl Hypothetical {
    /// Returns this interferer or its mirror image across the line Tx-Rx, whichever has the smaller error.
    ///
    /// The error is the sum of |ln(I_H / I)| over relay positions with lateral offsets from `least_m` to `most_m`, m.
    /// I_H is the interference power of the hypothetical interferer, I that of the true interferers.
    #[must_use]
    pub fn sided(self, scene: &Scene, least_m: f64, most_m: f64) -> Self {
        let other = Self {
            y_m: -self.y_m,
            ..self
        };
        let part = |i: u32, steps: u32| f64::from(i) / f64::from(steps);
        let aside = (0..=ASIDE).map(|i| least_m + part(i, ASIDE) * (most_m - least_m));
        let rows = aside.flat_map(|y| [scene.band.least_m, scene.band.most_m].map(|h| (y, h)));
        let places: Vec<Place> = rows
            .flat_map(|(y, h)| (0..=ALONG).map(move |i| (part(i, ALONG), y, h)))
            .map(|(share, y, h)| Place {
                x: share * scene.distance_m,
                y,
                h,
            })
            .collect();
        // The error is a sum over ratios, because with differences the positions near an interferer would dominate.
        let error = |one: &Self| -> f64 {
            let each = places.iter().map(|at| {
                let (dx, dy) = (at.x - one.x_m, at.y - one.y_m);
                let alone = one.power_w / (scene.eta * (dx * dx + dy * dy + at.h * at.h));
                (alone / scene.interference_w(*at)).ln().abs()
            });
            each.sum()
        };
        if error(&other) < error(&self) {
            other
        } else {
            self
        }
    }

    /// Returns the hypothetical interferer as an interfering transmitter of a scenario.
    pub fn source(&self) -> Source {
        Source {
            power_w: self.power_w,
            x_m: self.x_m,
            y_m: self.y_m,
        }
    }
}

/// Position and power of the hypothetical interferer with the least error at a [`Raster`]'s points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// Position x_H of the hypothetical interferer along the line from Tx, m.
    pub x_m: f64,
    /// Distance y_H of the hypothetical interferer from the line Tx-Rx, m, >= 0.
    pub y_m: f64,
    /// Power with the least error for an interferer at (`x_m`, `y_m`), and this least error.
    pub best_power: BestPower,
}

/// Returns the interferer whose interference is closest to that of all interferers in `scene`.
///
/// `None` if `scene` has no interferers. The search usually evaluates about 1 500 positions with 400 quadrature points
/// each, about 600 positions with 4 000 points each, and one position with 60 000 points. The errors have a relative
/// accuracy of 3e-5 (test `the_rasters_are_fine_enough` in `host-tests/tests/multi_interferer`).
pub fn hypothetical(scene: &Scene) -> Option<Hypothetical> {
    let found = fit(scene, &Raster::graded(scene, None, FINE))?;
    let place = (found.x_m, found.y_m);
    let raster = Raster::graded(scene, Some(place), REPORTED);
    let BestPower { error, .. } = raster.best_power(place.0, place.1);
    Some(Hypothetical {
        power_w: found.best_power.power_w,
        x_m: found.x_m,
        y_m: found.y_m,
        mean_abs_error_w: error / (raster.area() * scene.eta),
        relative_error: error / raster.total(),
    })
}

/// Returns the best hypothetical interferer for the quadrature points of `raster`.
///
/// `None` without interferers or points.
pub fn fit(scene: &Scene, raster: &Raster) -> Option<Fit> {
    if scene.sources.is_empty() || raster.is_empty() {
        return None;
    }
    let space = Space::new(scene);
    let coarse = Raster::graded(scene, None, COARSE);
    let mut found: Vec<Corner> = starts(scene, &space, &coarse)
        .into_iter()
        .map(|start| space.descend(&coarse, start, 1.0, 1e-4, 40))
        .collect();
    found.sort_by(|a, b| a.value.total_cmp(&b.value));
    let near = found
        .iter()
        .take(FINALISTS)
        .map(|corner| space.descend(raster, corner.at, 0.2, 1e-6, 40))
        .min_by(|a, b| a.value.total_cmp(&b.value))?;
    // The search restarts with a new simplex, because a simplex that has collapsed to a line stays on this line.
    let close = space.descend(raster, near.at, 0.05, 1e-9, 80);
    let best = space.descend(raster, close.at, 0.01, 1e-12, 80);
    let (x_m, y_m) = space.place(best.at);
    Some(Fit {
        x_m,
        y_m,
        best_power: raster.best_power(x_m, y_m),
    })
}

/// Returns the points (x, u) of the search space at which the local searches start.
///
/// They are the local minima of a grid with the smallest errors, and the true interferers with the smallest errors.
fn starts(scene: &Scene, space: &Space, raster: &Raster) -> Vec<(f64, f64)> {
    let rows = space.rows();
    let columns: Vec<Vec<Corner>> = space
        .columns()
        .into_iter()
        .map(|x| {
            let row = |&u: &f64| Corner {
                at: (x, u),
                value: space.error(raster, (x, u)),
            };
            rows.iter().map(row).collect()
        })
        .collect();
    let value = |i: Option<usize>, j: Option<usize>| {
        let column = i.and_then(|i| columns.get(i));
        let corner = column.and_then(|column| j.and_then(|j| column.get(j)));
        corner.map_or(f64::INFINITY, |corner| corner.value)
    };
    let mut valleys: Vec<Corner> = Vec::new();
    for (i, column) in columns.iter().enumerate() {
        for (j, corner) in column.iter().enumerate() {
            let beside = [
                value(i.checked_sub(1), Some(j)),
                value(Some(i + 1), Some(j)),
                value(Some(i), j.checked_sub(1)),
                value(Some(i), Some(j + 1)),
            ];
            if beside.iter().all(|&value| corner.value <= value) {
                valleys.push(*corner);
            }
        }
    }
    let mut sources: Vec<Corner> = scene
        .sources
        .iter()
        .map(|source| space.inside(source))
        .map(|at| Corner {
            at,
            value: space.error(raster, at),
        })
        .collect();
    for corners in [&mut valleys, &mut sources] {
        corners.sort_by(|a, b| a.value.total_cmp(&b.value));
        corners.truncate(VALLEYS);
    }
    valleys
        .iter()
        .chain(&sources)
        .map(|corner| corner.at)
        .collect()
}

/// Search space of the interferer's position: x, m, and u = asinh(y / lowest relay altitude).
///
/// y is the lateral distance from the line Tx-Rx. u grows linearly for small y, and logarithmically for large y.
struct Space {
    distance_m: f64,
    low: f64,
    high: f64,
    unit: f64,
    most_u: f64,
}

impl Space {
    fn new(scene: &Scene) -> Self {
        let d = scene.distance_m;
        let xs = scene.sources.iter().map(|source| source.x_m);
        let (low, high) = xs.fold((0.0_f64, d), |(low, high), x| (low.min(x), high.max(x)));
        let ys = scene.sources.iter().map(|source| source.y_m.abs());
        let size = ys.fold((high - low).max(scene.band.most_m), f64::max);
        let unit = scene.band.least_m;
        Self {
            distance_m: d,
            low,
            high,
            unit,
            most_u: (FAR * size / unit).asinh(),
        }
    }

    fn inside(&self, source: &Source) -> (f64, f64) {
        (source.x_m, (source.y_m.abs() / self.unit).asinh())
    }

    fn place(&self, (x, u): (f64, f64)) -> (f64, f64) {
        let x = x.clamp(self.low, self.high);
        (x, self.unit * u.clamp(0.0, self.most_u).sinh())
    }

    fn error(&self, raster: &Raster, at: (f64, f64)) -> f64 {
        let (x, y) = self.place(at);
        raster.best_power(x, y).error
    }

    /// Returns the grid of x for the search, m.
    ///
    /// The spacing is D / 16 at the middle between Tx and Rx, and grows toward both ends. D is the distance from Tx to
    /// Rx.
    fn columns(&self) -> Vec<f64> {
        let half = 0.5 * self.distance_m;
        let middle = Centre {
            at: half,
            width: half,
        };
        graded(self.low, self.high, &[middle], 0.125, self.high - self.low)
    }

    fn rows(&self) -> Vec<f64> {
        graded(0.0, self.most_u, &[], 0.0, RISE)
    }

    /// Minimises the error by the simplex method from `start`, a point (x, u) of the search space.
    ///
    /// `share` is the size of the first simplex, relative to the distance over which the error changes noticeably. The
    /// search ends if the errors at the corners differ by less than the relative `tolerance`, or after `most` steps.
    fn descend(
        &self,
        raster: &Raster,
        start: (f64, f64),
        share: f64,
        tolerance: f64,
        most: u32,
    ) -> Corner {
        let (x, y) = self.place(start);
        let dx = share * 0.5 * y.hypot(self.unit).min(0.1 * self.distance_m);
        // The steps point into the search space, because a step across its border has no effect.
        let dx = if x + dx > self.high { -dx } else { dx };
        let du = share * RISE;
        let du = if start.1 + du > self.most_u { -du } else { du };
        minimise(
            |at| self.error(raster, at),
            start,
            (dx, du),
            tolerance,
            most,
        )
    }
}

/// Largest width of a quadrature cell, as a fraction of its distance from the nearest interferer.
const WIDEST_STEP: f64 = 0.9;

const TRIES: u32 = 6;

#[derive(Debug, Clone, Copy)]
struct Node {
    x: f64,
    h_squared: f64,
    weight: f64,
    /// Sum of p / distance^2 over the true interferers, W/m^2.
    ///
    /// p is the power of an interferer, and distance is its distance from this quadrature point.
    truth: f64,
}

/// Quadrature points in the vertical plane from Tx to Rx, between the lowest and highest altitude.
///
/// If both altitudes are equal, the points are on a line at that altitude.
#[derive(Debug, Clone)]
pub struct Raster {
    nodes: Vec<Node>,
    area: f64,
    total: f64,
}

/// Power with the least error for a hypothetical interferer at a given position, and this least error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BestPower {
    /// Transmit power with the least error for the hypothetical interferer at its position, W, > 0.
    pub power_w: f64,
    /// Least error: the integral of |p / d^2 - S| over the quadrature points.
    ///
    /// p is this interferer's power, d its distance, and S the sum of p / d^2 over the true interferers. The unit is W
    /// for an integral over distance and altitude, and W/m for an integral over distance only.
    pub error: f64,
}

/// Quadrature point in one direction: its coordinate, m, and its weight.
type WeightedCoordinate = (f64, f64);

impl Raster {
    /// Creates the quadrature points of a midpoint rule: the centres of `columns` x `rows` equal cells.
    ///
    /// There is one row if the lowest and the highest altitude are equal.
    pub fn even(scene: &Scene, columns: u32, rows: u32) -> Self {
        let midpoints = |low: f64, high: f64, count: u32| -> Vec<WeightedCoordinate> {
            let cell = (high - low) / f64::from(count);
            (0..count)
                .map(|i| (low + (f64::from(i) + 0.5) * cell, cell))
                .collect()
        };
        let band = scene.band;
        let rows = if band.most_m > band.least_m {
            midpoints(band.least_m, band.most_m, rows)
        } else {
            vec![(band.least_m, 1.0)]
        };
        Self::of(scene, &rows, |_| midpoints(0.0, scene.distance_m, columns))
    }

    /// Creates quadrature points in cells that are smaller near the interferers and near `also`.
    ///
    /// `also` is a further position (x, y), m. Each cell has two Gauss points per direction. The number of points is at
    /// most about `most`, > 100, unless the number of interferers alone requires more.
    pub fn graded(scene: &Scene, also: Option<(f64, f64)>, most: usize) -> Self {
        let sharp: Vec<(f64, f64)> = scene
            .sources
            .iter()
            .map(|source| (source.x_m, source.y_m.abs()))
            .chain(also)
            .collect();
        // The number of points is proportional to 1 / step^2 over an area, and to 1 / step along a line.
        let is_area = scene.band.most_m > scene.band.least_m;
        let mut step = WIDEST_STEP;
        let mut raster = Self::with_step(scene, &sharp, step);
        for _ in 0..TRIES {
            let excess = raster.nodes.len() as f64 / most as f64;
            if (0.8..=1.0).contains(&excess) {
                break;
            }
            let ratio = if is_area { excess.sqrt() } else { excess };
            step = (step * ratio * 1.05).min(WIDEST_STEP);
            raster = Self::with_step(scene, &sharp, step);
        }
        raster
    }

    fn with_step(scene: &Scene, sharp: &[(f64, f64)], step: f64) -> Self {
        let band = scene.band;
        let rows = if band.most_m > band.least_m {
            // Lines of equal power are circles about (x, y = 0, h = 0), so right above an interferer the width is its
            // offset.
            let centres: Vec<Centre> = sharp
                .iter()
                .map(|&(_, width)| Centre { at: 0.0, width })
                .collect();
            let widest = (band.most_m - band.least_m) * step;
            gauss(&graded(band.least_m, band.most_m, &centres, step, widest))
        } else {
            vec![(band.least_m, 1.0)]
        };
        let widest = scene.distance_m * step * 0.25;
        Self::of(scene, &rows, |h| {
            let centres: Vec<Centre> = sharp
                .iter()
                .map(|&(at, y)| Centre {
                    at,
                    width: y.hypot(h),
                })
                .collect();
            gauss(&graded(0.0, scene.distance_m, &centres, step, widest))
        })
    }

    fn of(
        scene: &Scene,
        rows: &[WeightedCoordinate],
        columns: impl Fn(f64) -> Vec<WeightedCoordinate>,
    ) -> Self {
        let mut nodes = Vec::new();
        for &(h, height) in rows {
            for (x, width) in columns(h) {
                nodes.push(Node {
                    x,
                    h_squared: h * h,
                    weight: width * height,
                    truth: scene.interference_w((x, h)) * scene.eta,
                });
            }
        }
        Self {
            area: nodes.iter().map(|node| node.weight).sum(),
            total: nodes.iter().map(|node| node.weight * node.truth).sum(),
            nodes,
        }
    }

    /// Returns the number of quadrature points.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns true if there are no quadrature points.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Returns the area that the quadrature points cover, m^2.
    ///
    /// If all points are on a line, returns the length of the line instead, m.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Returns the integral of S, the sum of p / distance^2 over the true interferers of power p.
    ///
    /// The unit is the same as in [`BestPower::error`].
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Returns the power with the least error for an interferer at (`x`, `y`), m, and this error.
    ///
    /// The error is the integral of |p g - S|. p is the interferer's power, and g = 1 / distance^2 its effect per watt.
    /// S is the sum of p g over the true interferers. The best p is the median of S / g, weighted by g. The time is
    /// linear in the number of points.
    pub fn best_power(&self, x: f64, y: f64) -> BestPower {
        let shape = |node: &Node| {
            let dx = node.x - x;
            1.0 / (dx * dx + y * y + node.h_squared)
        };
        let mut ratios: Vec<Ratio> = self
            .nodes
            .iter()
            .map(|node| {
                let shape = shape(node);
                Ratio {
                    value: node.truth / shape,
                    weight: shape * node.weight,
                }
            })
            .collect();
        let power_w = weighted_median(&mut ratios);
        let each = ratios
            .iter()
            .map(|ratio| ratio.weight * (power_w - ratio.value).abs());
        BestPower {
            power_w,
            error: each.sum(),
        }
    }
}

/// Returns two Gauss points, with weights, for each cell between neighbouring `ends`.
///
/// They integrate cubic functions exactly.
fn gauss(ends: &[f64]) -> Vec<WeightedCoordinate> {
    let cells = ends.iter().zip(ends.iter().skip(1));
    cells
        .flat_map(|(low, high)| {
            let (middle, half) = (low.midpoint(*high), 0.5 * (high - low));
            let off = half / 3_f64.sqrt();
            [(middle - off, half), (middle + off, half)]
        })
        .collect()
}

/// Term of the weighted median: the value and the weight of one quadrature point.
///
/// The value is the power, W, with which a single interferer gives the true interference at this point.
struct Ratio {
    value: f64,
    weight: f64,
}

/// Returns the weighted median of `ratios` in linear time; 0 if there are none. Changes their order.
fn weighted_median(mut ratios: &mut [Ratio]) -> f64 {
    let mut half = 0.5 * ratios.iter().map(|ratio| ratio.weight).sum::<f64>();
    let mut median = 0.0;
    while !ratios.is_empty() {
        let middle = ratios.len() / 2;
        let (below, at, above) =
            ratios.select_nth_unstable_by(middle, |a, b| a.value.total_cmp(&b.value));
        let lighter: f64 = below.iter().map(|ratio| ratio.weight).sum();
        median = at.value;
        if lighter > half {
            ratios = below;
        } else if lighter + at.weight >= half {
            break;
        } else {
            half -= lighter + at.weight;
            ratios = above;
        }
    }
    median
}

/// Coordinate at which a function of one coordinate changes fastest.
///
/// A grid for this function has its smallest cells there.
#[derive(Debug, Clone, Copy)]
pub struct Centre {
    /// Coordinate of the fastest change, m: an x or an altitude.
    pub at: f64,
    /// Length over which the function changes noticeably at `at`, m. This length determines the size of the cells.
    pub width: f64,
}

impl Centre {
    /// Returns the length over which the function changes at `x`, m: sqrt((x - at)^2 + width^2).
    fn scale(&self, x: f64) -> f64 {
        (x - self.at).hypot(self.width)
    }
}

/// Returns the ends of a grid's cells from `low` to `high`, ascending. Cells are smaller near `centres`.
///
/// A cell is at most 1.5 times as wide as the smaller of two lengths: `widest`, and `step` (below 1) times the length
/// over which the function changes there. There are about (high - low) / widest ends without `centres`, and each centre
/// adds about 2 ln(2 (high - low) / width) / step ends.
pub fn graded(low: f64, high: f64, centres: &[Centre], step: f64, widest: f64) -> Vec<f64> {
    let mut ends = vec![low];
    let mut at = low;
    while at < high {
        let width = centres
            .iter()
            .map(|centre| step * centre.scale(at))
            .fold(widest, f64::min);
        // If less than half a cell remains, it is added to the last cell.
        at = if at + 1.5 * width < high {
            at + width
        } else {
            high
        };
        ends.push(at);
    }
    ends
}

#[derive(Debug, Clone, Copy)]
struct Corner {
    at: (f64, f64),
    value: f64,
}

/// Minimises `f` by the simplex method. Returns the best point found, never worse than `start`.
///
/// `steps` is the size of the first simplex. The search ends when the values at the simplex corners differ by less than
/// the relative `tolerance`, or after `most` steps. A step takes at most four evaluations of `f`.
fn minimise(
    f: impl Fn((f64, f64)) -> f64,
    start: (f64, f64),
    steps: (f64, f64),
    tolerance: f64,
    most: u32,
) -> Corner {
    let corner = |at| Corner { at, value: f(at) };
    let sorted = |mut corners: [Corner; 3]| {
        corners.sort_by(|a, b| a.value.total_cmp(&b.value));
        corners
    };
    let beside = (start.0 + steps.0, start.1);
    let above = (start.0, start.1 + steps.1);
    let mut corners = sorted([start, beside, above].map(corner));
    for _ in 0..most {
        let [best, middle, worst] = corners;
        if worst.value - best.value <= tolerance * best.value.abs() {
            break;
        }
        let along = |share| corner(between(worst.at, between(best.at, middle.at, 0.5), share));
        let mirrored = along(2.0);
        let tried = if mirrored.value < best.value {
            let beyond = along(3.0);
            if beyond.value < mirrored.value {
                beyond
            } else {
                mirrored
            }
        } else if mirrored.value < middle.value {
            mirrored
        } else if mirrored.value < worst.value {
            along(1.5)
        } else {
            along(0.5)
        };
        corners = sorted(if tried.value < worst.value {
            [best, middle, tried]
        } else {
            // No improvement: shrinks the simplex toward its best corner.
            let drawn = |other: Corner| corner(between(best.at, other.at, 0.5));
            [best, drawn(middle), drawn(worst)]
        });
    }
    let [best, ..] = corners;
    best
}

/// Returns a point on the line through `from` and `to`: `from` for a `share` of 0, `to` for 1.
///
/// With `share` above 1 the point is beyond `to`, as seen from `from`.
fn between(from: (f64, f64), to: (f64, f64), share: f64) -> (f64, f64) {
    (
        from.0 + share * (to.0 - from.0),
        from.1 + share * (to.1 - from.1),
    )
}

#[cfg(test)]
mod tests {
    use super::{Ratio, minimise, weighted_median};

    #[test]
    fn the_median_balances_the_weights() {
        let median = |pairs: &[(f64, f64)]| {
            let mut ratios: Vec<Ratio> = pairs
                .iter()
                .map(|&(value, weight)| Ratio { value, weight })
                .collect();
            weighted_median(&mut ratios)
        };
        let close = |got: f64, want: f64| assert!((got - want).abs() < 1e-12, "{got} {want}");
        close(median(&[(3.0, 1.0), (1.0, 1.0), (2.0, 1.0)]), 2.0);
        close(median(&[(3.0, 5.0), (1.0, 1.0), (2.0, 1.0)]), 3.0);
        close(
            median(&[(3.0, 1.0), (1.0, 5.0), (2.0, 1.0), (9.0, 1.0)]),
            1.0,
        );
        close(median(&[]), 0.0);
    }

    /// Checks that the simplex method finds a minimum that is much narrower than the first simplex.
    #[test]
    fn a_simplex_that_is_too_large_shrinks() {
        let pit = |(x, y): (f64, f64)| {
            let r = x.hypot(y);
            if r < 1.0 { r } else { 10.0 - 1e-3 * r }
        };
        let found = minimise(pit, (0.5, 0.0), (90.0, 70.0), 0.0, 120);
        assert!(found.value < 1e-9, "{found:?}");
    }

    #[test]
    fn the_minimum_of_a_curved_valley_is_found() {
        let valley = |(x, y): (f64, f64)| 1.0 + (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let found = minimise(valley, (-1.2, 1.0), (0.1, 0.1), 1e-15, 500);
        assert!(
            (found.at.0 - 1.0).abs() < 1e-5 && (found.at.1 - 1.0).abs() < 1e-5,
            "{found:?}"
        );
        assert!(found.value < 1.0 + 1e-12, "{found:?}");
    }
}
