//! The hypothetical interferer closest to several. The paper's "Extension to Multiple Sources of Interference".
//!
//! Minimises the integral, over [0, D] and the altitude band, of |p_H / ((x - x_H)^2 + y_H^2 + h^2) - the same summed over the
//! true sources|. The best p_H at a position is a weighted median ([`Raster::weigh`]); the position is searched on a grid, then
//! by simplexes from the grid's best local minima and from the true sources. The global minimum may be missed: a test compares
//! the result with 20 000 random positions in each of 20 scenes.
//!
//! The paper restricts x_H to [0, D]. Interferers that are all beyond Rx are not well represented there, so here x_H may reach
//! the outermost interferer. y_H is at most 30 times the size of the scene, where the interference is uniform to a thousandth.

pub mod mesh;
mod raster;
mod simplex;

use crate::Source;
use crate::scene::{Place, Scene};
use mesh::{Centre, graded};
pub use raster::{Raster, Weighed};
use simplex::{Corner, minimise};

/// Approximate number of points of the grid search.
const COARSE: usize = 400;

/// Approximate number of points at the end of the search.
const FINE: usize = 4_000;

/// Steps along the line and sideways at which both sides are compared.
const ALONG: u32 = 64;
const ASIDE: u32 = 8;

/// Approximate number of points for the reported error.
const REPORTED: usize = 60_000;

/// Largest y_H relative to the size of the scene.
const FAR: f64 = 30.0;

/// Grid step in asinh(y_H / least altitude): a factor of 1.4 once y_H is above that altitude.
const RISE: f64 = 0.35;

/// Number of the grid's local minima that are refined, and of the true sources.
const VALLEYS: usize = 6;

const FINALISTS: usize = 3;

/// A hypothetical interferer in place of several, and its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothetical {
    /// Transmit power p_H, W, > 0.
    pub power_w: f64,
    /// Position x_H along the line from Tx to Rx, m.
    pub x_m: f64,
    /// Lateral position y_H, m; positive to the right of the line.
    pub y_m: f64,
    /// Mean absolute error of the interference at a relay, W.
    pub mean_abs_error_w: f64,
    /// Integral of the absolute error over that of the true interference; 0 is perfect.
    pub relative_error: f64,
}

impl Hypothetical {
    /// Chooses the side of the line with the smaller error, for lateral room from `least_m` to `most_m`, m.
    ///
    /// Above the line both sides are equal.
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
        // Compares ratios: otherwise the surroundings of an interferer would dominate.
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

    /// Returns the interferer as a source of a scenario.
    pub fn source(&self) -> Source {
        Source {
            power_w: self.power_w,
            x_m: self.x_m,
            y_m: self.y_m,
        }
    }
}

/// Best position found on a given raster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// x_H, m.
    pub x_m: f64,
    /// y_H, m, >= 0.
    pub y_m: f64,
    /// Best power there, and the remaining error on the raster.
    pub weighed: Weighed,
}

/// Returns the hypothetical interferer of a scene; `None` without interferers.
///
/// Usually about 1 500 evaluations of 400 points, 600 of 4 000 and one of 60 000. The errors are accurate to 3e-5, relative
/// (`the_rasters_are_fine_enough` in `host-tests/tests/several`).
pub fn hypothetical(scene: &Scene) -> Option<Hypothetical> {
    let found = fit(scene, &Raster::graded(scene, None, FINE))?;
    let place = (found.x_m, found.y_m);
    let raster = Raster::graded(scene, Some(place), REPORTED);
    let Weighed { error, .. } = raster.weigh(place.0, place.1);
    Some(Hypothetical {
        power_w: found.weighed.power_w,
        x_m: found.x_m,
        y_m: found.y_m,
        mean_abs_error_w: error / (raster.area() * scene.eta),
        relative_error: error / raster.total(),
    })
}

/// Returns the position with the least error found on `raster`; `None` without interferers or points.
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
    // Restarts the simplex, because one that has collapsed to a line would stay on it.
    let close = space.descend(raster, near.at, 0.05, 1e-9, 80);
    let best = space.descend(raster, close.at, 0.01, 1e-12, 80);
    let (x_m, y_m) = space.place(best.at);
    Some(Fit {
        x_m,
        y_m,
        weighed: raster.weigh(x_m, y_m),
    })
}

/// Returns the starting points. The grid's deepest local minima and the best true sources, in the coordinates of `space`.
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

/// Search space: x in metres, and u = asinh(y / least altitude). u is linear in y below that altitude and logarithmic above.
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
        raster.weigh(x, y).error
    }

    /// Returns the grid along x: spacing D / 16 in the middle, wider further out.
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

    /// Minimises by a simplex from `start`, with a size of `share` of the local length scale.
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
        // Steps inwards, because a step across the border has no effect.
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
