//! The one hypothetical interferer that comes closest to several: the paper's "Extension to Multiple Sources of Interference".
//!
//! Minimised is the integral, over [0, D] and the altitude band, of |p_H / ((x - x_H)^2 + y_H^2 + h^2) - the same summed over the
//! true sources|. The best p_H for a place is a weighted median ([`Raster::weigh`]); the place is searched for on a grid, and
//! from the best valleys of the grid and the true sources themselves by simplexes. No proof that the best valley is among
//! them: a test holds the result against 20 000 places drawn at random in each of 20 scenes.
//!
//! The paper asks for x_H in [0, D]. Interferers that all lie beyond Rx are no better met by one at Rx, so here x_H may go out to
//! the outermost interferer. y_H is 30 times the size of the scene at most: there the shape is even to a thousandth.

pub mod mesh;
mod raster;
mod simplex;

use crate::Source;
use crate::scene::{Place, Scene};
use mesh::{Centre, graded};
pub use raster::{Raster, Weighed};
use simplex::{Corner, minimise};

/// About how many places the grid search looks at.
const COARSE: usize = 400;

/// About how many the search ends with.
const FINE: usize = 4_000;

/// Steps along the line and aside in which both sides are compared.
const ALONG: u32 = 64;
const ASIDE: u32 = 8;

/// About how many the error that is reported was measured on.
const REPORTED: usize = 60_000;

/// The largest y_H over the size of the scene.
const FAR: f64 = 30.0;

/// Step of the grid in asinh(y_H / least altitude): a factor of 1.4 once y_H is above that altitude.
const RISE: f64 = 0.35;

/// Valleys of the grid that are followed, and as many true sources.
const VALLEYS: usize = 6;

/// Of those, how many are followed to the end.
const FINALISTS: usize = 3;

/// One interferer in place of several, and how well it stands for them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothetical {
    /// Transmit power p_H, watts, > 0.
    pub power_w: f64,
    /// Coordinate x_H along the line from Tx to Rx, metres.
    pub x_m: f64,
    /// Offset y_H from that line, metres: to its right above 0.
    pub y_m: f64,
    /// Mean absolute error of the interference that a relay receives, watts.
    pub mean_abs_error_w: f64,
    /// The integral of the absolute error over that of the true interference; 0 is perfect.
    pub relative_error: f64,
}

impl Hypothetical {
    /// The same on that side of the line on which it errs less, for relays with room from `least_m` to `most_m` (metres)
    /// beside the line. Above the line both sides are the same.
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
        // By factors: what is next to an interferer would else outweigh all the rest.
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

    /// As an interferer of a scenario.
    pub fn source(&self) -> Source {
        Source {
            power_w: self.power_w,
            x_m: self.x_m,
            y_m: self.y_m,
        }
    }
}

/// The best place found on a given raster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// x_H, metres.
    pub x_m: f64,
    /// y_H, metres, >= 0.
    pub y_m: f64,
    /// The best power there, and the error that it leaves on the raster.
    pub weighed: Weighed,
}

/// The hypothetical interferer of a scene; `None` without interferers.
///
/// In usual scenes about 1 500 weighings of 400 places, 600 of 4 000 and one of 60 000. The errors are good to 3e-5, relative:
/// `the_rasters_are_fine_enough` in `host-tests/tests/several`.
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

/// The place whose error on `raster` is the least that was found; `None` without interferers or without places.
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
    // A simplex that has shrunk to a line stays on it: begun anew it goes on.
    let close = space.descend(raster, near.at, 0.05, 1e-9, 80);
    let best = space.descend(raster, close.at, 0.01, 1e-12, 80);
    let (x_m, y_m) = space.place(best.at);
    Some(Fit {
        x_m,
        y_m,
        weighed: raster.weigh(x_m, y_m),
    })
}

/// Where to begin: the deepest valleys of the grid and the true sources that err least, as places of `space`.
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

/// The places that are searched: x in metres, and u = asinh(y / least altitude), which is even in y below that altitude and
/// in log y above.
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

    /// The place of this very source.
    fn inside(&self, source: &Source) -> (f64, f64) {
        (source.x_m, (source.y_m.abs() / self.unit).asinh())
    }

    /// The nearest place that is allowed, (x, y) in metres.
    fn place(&self, (x, u): (f64, f64)) -> (f64, f64) {
        let x = x.clamp(self.low, self.high);
        (x, self.unit * u.clamp(0.0, self.most_u).sinh())
    }

    fn error(&self, raster: &Raster, at: (f64, f64)) -> f64 {
        let (x, y) = self.place(at);
        raster.weigh(x, y).error
    }

    /// Places along x: a sixteenth of D apart midway, farther apart the farther out.
    fn columns(&self) -> Vec<f64> {
        let half = 0.5 * self.distance_m;
        let middle = Centre {
            at: half,
            width: half,
        };
        graded(self.low, self.high, &[middle], 0.125, self.high - self.low)
    }

    /// Places along u.
    fn rows(&self) -> Vec<f64> {
        graded(0.0, self.most_u, &[], 0.0, RISE)
    }

    /// A simplex from `start`, its size `share` of the length over which things change there.
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
        // Toward the inside: at a border, a step outward is none.
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
