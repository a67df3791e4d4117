//! Quadrature points in the x-h plane for the error of a hypothetical interferer.

use super::mesh::{Centre, graded};
use crate::scene::Scene;

/// Largest cell width relative to the distance to the nearest source.
const WIDEST_STEP: f64 = 0.9;

const TRIES: u32 = 6;

#[derive(Debug, Clone, Copy)]
struct Node {
    x: f64,
    h_squared: f64,
    weight: f64,
    /// Sum of p / distance^2 over the true sources, W/m^2.
    truth: f64,
}

/// Quadrature over [0, D] x altitude band, or over the line if the band is a single altitude.
#[derive(Debug, Clone)]
pub struct Raster {
    nodes: Vec<Node>,
    area: f64,
    total: f64,
}

/// Best power of a hypothetical interferer at a given position, and its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weighed {
    /// Transmit power, W, > 0.
    pub power_w: f64,
    /// Integral of the absolute difference from the true sum of p / distance^2. W over an area, W/m over a line.
    pub error: f64,
}

/// A coordinate and its quadrature weight.
type Share = (f64, f64);

impl Raster {
    /// Creates a midpoint rule on `columns` x `rows` equal cells; one row if the band is a single altitude.
    pub fn even(scene: &Scene, columns: u32, rows: u32) -> Self {
        let midpoints = |low: f64, high: f64, count: u32| -> Vec<Share> {
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

    /// Creates a two-point Gauss rule per cell and direction. Cells shrink toward sources and `also` (x, y in metres).
    ///
    /// At most about `most` points, > 100, unless the number of sources alone requires more.
    pub fn graded(scene: &Scene, also: Option<(f64, f64)>, most: usize) -> Self {
        let sharp: Vec<(f64, f64)> = scene
            .sources
            .iter()
            .map(|source| (source.x_m, source.y_m.abs()))
            .chain(also)
            .collect();
        // The number of points grows with 1 / step^2 over an area, with 1 / step along a line.
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
            // Lines of equal power are circles about (x, y = 0, h = 0), so above a source the width is its offset.
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

    fn of(scene: &Scene, rows: &[Share], columns: impl Fn(f64) -> Vec<Share>) -> Self {
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

    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// Returns true if there are no points.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Returns the area of integration, m^2, or its length, m.
    pub fn area(&self) -> f64 {
        self.area
    }

    /// Returns the integral of the true sum of p / distance^2, in the unit of [`Weighed::error`].
    pub fn total(&self) -> f64 {
        self.total
    }

    /// Returns the best power of a hypothetical interferer at (`x`, `y`), m, and the remaining error.
    ///
    /// With the shape g = 1 / distance^2 and the true sum S, the integral of |p g - S| is that of g |p - S/g|: its minimum over p
    /// is the median of S/g, weighted by g. Linear in the number of points.
    pub fn weigh(&self, x: f64, y: f64) -> Weighed {
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
        Weighed {
            power_w,
            error: each.sum(),
        }
    }
}

/// Two-point Gauss rule per cell: exact for cubic functions.
fn gauss(ends: &[f64]) -> Vec<Share> {
    let cells = ends.iter().zip(ends.iter().skip(1));
    cells
        .flat_map(|(low, high)| {
            let (middle, half) = (low.midpoint(*high), 0.5 * (high - low));
            let off = half / 3_f64.sqrt();
            [(middle - off, half), (middle + off, half)]
        })
        .collect()
}

/// True sum over the shape at one point.
struct Ratio {
    value: f64,
    weight: f64,
}

/// Returns the weighted median in linear time; 0 without values. Reorders `ratios`.
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

#[cfg(test)]
mod tests {
    use super::{Ratio, weighted_median};

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
}
