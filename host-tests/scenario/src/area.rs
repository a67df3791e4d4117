//! Areas on the ground: where an interferer may be, and where relays may not fly.

use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Area on the ground. The boundary does not cross itself.
///
/// Points are [x, y], m. x is the distance from Tx toward Rx, and y the offset to the right as seen from Tx.
#[derive(Debug, Clone, PartialEq)]
pub enum Area {
    /// Circle around a point.
    Circle {
        /// Centre of the circle, [x, y], m.
        centre: [f64; 2],
        /// Radius, m, > 0.
        radius_m: f64,
    },
    /// Polygon, convex or not, as the list of its corners in order. The list does not repeat its first corner at the
    /// end.
    Polygon(Vec<[f64; 2]>),
}

/// Area of an interferer whose exact position and power are unknown.
///
/// The same interferer is also an entry of [`Interference`](crate::Interference). That entry has the interferer's
/// greatest power, and the middle of the area as position.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceArea {
    /// Possible positions of the interferer. Neither Tx nor Rx is inside.
    pub area: Area,
    /// Least EIRP of the interferer, W.
    pub least_w: f64,
}

/// No-fly area: relays must not fly in it between its lowest and its highest altitude.
#[derive(Debug, Clone, PartialEq)]
pub struct NoFly {
    /// Name of the area in error messages, such as `no_fly[0]`.
    pub key: String,
    /// Corners of the boundary, [x, y], m. A circle in the file is replaced by a polygon around it.
    pub corners: Vec<[f64; 2]>,
    /// Lowest and highest altitude of the no-fly area, m, measured like the key `geometry.altitude_m`.
    pub altitudes_m: RangeInclusive<f64>,
}

/// Smallest accepted area of a polygon, m2.
const LEAST_M2: f64 = 1.0;

/// Number of corners of the polygon that replaces a circle.
const CORNERS: u32 = 64;

impl Area {
    /// Returns the point of the area nearest to `at`; `at` itself if `at` is inside.
    pub fn nearest(&self, at: [f64; 2]) -> [f64; 2] {
        match self {
            Self::Circle { centre, radius_m } => {
                let [dx, dy] = [at[0] - centre[0], at[1] - centre[1]];
                let share = radius_m / dx.hypot(dy);
                if share < 1.0 {
                    [centre[0] + share * dx, centre[1] + share * dy]
                } else {
                    at
                }
            }
            Self::Polygon(corners) if is_inside(corners, at) => at,
            Self::Polygon(corners) => edges(corners)
                .map(|[from, to]| {
                    let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
                    let along = (at[0] - from[0]) * dx + (at[1] - from[1]) * dy;
                    let share = (along / (dx * dx + dy * dy)).clamp(0.0, 1.0);
                    [from[0] + share * dx, from[1] + share * dy]
                })
                .min_by(|a, b| distance_m(*a, at).total_cmp(&distance_m(*b, at)))
                .unwrap_or(at),
        }
    }

    /// Returns true if `at` is in the area or on its boundary.
    pub fn contains(&self, at: [f64; 2]) -> bool {
        !(self.distance_m(at) > 0.0)
    }

    /// Returns the distance of `at` from the area, m; 0 inside.
    pub fn distance_m(&self, at: [f64; 2]) -> f64 {
        distance_m(self.nearest(at), at)
    }

    /// Returns the centre of gravity of the area, or the point of the area nearest to it.
    ///
    /// The centre of gravity can be outside of an area that is not convex.
    pub fn centre(&self) -> [f64; 2] {
        let corners = match self {
            Self::Circle { centre, .. } => return *centre,
            Self::Polygon(corners) => corners,
        };
        // Coordinates are taken relative to a corner, because large coordinates would lose digits.
        let [x, y] = corners.first().copied().unwrap_or_default();
        let (mut area, mut sum) = (0.0, [0.0; 2]);
        for [a, b] in edges(corners) {
            let [a, b] = [a, b].map(|[of_x, of_y]| [of_x - x, of_y - y]);
            let cross = a[0] * b[1] - b[0] * a[1];
            area += cross;
            sum = [
                sum[0] + cross * (a[0] + b[0]),
                sum[1] + cross * (a[1] + b[1]),
            ];
        }
        self.nearest([x + sum[0] / (3.0 * area), y + sum[1] / (3.0 * area)])
    }

    /// Returns two points, m: smallest x and y of the area, then largest x and y.
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        match self {
            Self::Circle {
                centre: [x, y],
                radius_m: r,
            } => [[x - r, y - r], [x + r, y + r]],
            Self::Polygon(corners) => {
                let none = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
                corners.iter().fold(none, |[low, high], [x, y]| {
                    [
                        [low[0].min(*x), low[1].min(*y)],
                        [high[0].max(*x), high[1].max(*y)],
                    ]
                })
            }
        }
    }

    /// Returns the corners of a polygon that contains the area. A circle becomes a polygon of 64 corners.
    pub fn corners(&self) -> Vec<[f64; 2]> {
        match self {
            Self::Circle { centre, radius_m } => {
                let outer = radius_m / (PI / f64::from(CORNERS)).cos();
                let corner = |corner: u32| {
                    let (sin, cos) = (2.0 * PI * f64::from(corner) / f64::from(CORNERS)).sin_cos();
                    [centre[0] + outer * cos, centre[1] + outer * sin]
                };
                (0..CORNERS).map(corner).collect()
            }
            Self::Polygon(corners) => corners.clone(),
        }
    }

    /// Creates a polygon from its corners in order. The last corner may repeat the first corner.
    ///
    /// # Errors
    /// A text with the fault: fewer than 3 different corners, an area below 1 m2, or edges that cross or touch.
    pub fn polygon(mut corners: Vec<[f64; 2]>) -> Result<Self, String> {
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        corners.dedup();
        if corners.len() < 3 {
            return Err(format!("has {} different corners", corners.len()));
        }
        let edges: Vec<_> = edges(&corners).collect();
        let origin = corners.first().copied().unwrap_or_default();
        let surface: f64 = edges.iter().map(|[a, b]| turn([origin, *a], *b)).sum();
        if !(surface.abs() > 2.0 * LEAST_M2) {
            return Err(format!("covers less than {LEAST_M2} m2"));
        }
        for (first, one) in edges.iter().enumerate() {
            for (second, other) in edges.iter().enumerate().skip(first + 1) {
                let is_next = second == first + 1;
                let is_wrong = match (is_next, first == 0 && second + 1 == edges.len()) {
                    (true, _) => is_spike(*one, *other),
                    (_, true) => is_spike(*other, *one),
                    _ => cross(*one, *other),
                };
                if is_wrong {
                    return Err(format!(
                        "crosses or touches itself: edges {} and {}",
                        first + 1,
                        second + 1
                    ));
                }
            }
        }
        Ok(Self::Polygon(corners))
    }
}

impl NoFly {
    /// Returns how deep a relay is inside the no-fly area, m; `None` if the relay is outside.
    ///
    /// The depth is the smallest of three distances: to the boundary, to the lowest altitude and to the highest
    /// altitude.
    pub fn depth_m(&self, at: [f64; 2], altitude_m: f64) -> Option<f64> {
        if !(self.altitudes_m.contains(&altitude_m) && is_inside(&self.corners, at)) {
            return None;
        }
        let heights = [
            altitude_m - self.altitudes_m.start(),
            self.altitudes_m.end() - altitude_m,
        ];
        let beside = edges(&self.corners)
            .map(|[from, to]| distance_m(Area::Polygon(vec![from, to]).nearest(at), at));
        Some(beside.chain(heights).fold(f64::INFINITY, f64::min))
    }

    /// Returns the intervals of x, m, in which a relay is inside the no-fly area or close to it.
    ///
    /// The relay flies at `y_m` and `altitude_m`. It is close if its distance from the area is at most `around_m` in
    /// each of x, y and altitude, m.
    pub fn intervals_m(&self, y_m: f64, altitude_m: f64, around_m: f64) -> Vec<[f64; 2]> {
        let around_m = around_m.max(1e-6);
        let [lowest, highest] = [self.altitudes_m.start(), self.altitudes_m.end()];
        if altitude_m + around_m < *lowest || altitude_m - around_m > *highest {
            return Vec::new();
        }
        let altitude_m = altitude_m.clamp(*lowest, *highest);
        let sides = [y_m - around_m, y_m + around_m];
        // Values of x at which the strip `around_m` left and right of the position enters or leaves the area.
        let mut turns = Vec::new();
        for [a, b] in edges(&self.corners) {
            turns.push(a[0]);
            for side in sides {
                let share = (side - a[1]) / (b[1] - a[1]);
                if (0.0..=1.0).contains(&share) {
                    turns.push(a[0] + share * (b[0] - a[0]));
                }
            }
        }
        turns.sort_by(f64::total_cmp);
        let parts = turns.iter().zip(turns.iter().skip(1));
        let inside = parts.filter(|(from, to)| {
            let x_m = from.midpoint(**to);
            self.crossing_m(sides.map(|y_m| [x_m, y_m, altitude_m])) > 0.0
        });
        inside
            .map(|(from, to)| [from - around_m, to + around_m])
            .collect()
    }

    /// Returns the horizontal length of the part of a straight path that is inside the no-fly area, m.
    ///
    /// The path has two ends, each [x, y, altitude].
    pub fn crossing_m(&self, [from, to]: [[f64; 3]; 2]) -> f64 {
        let climb = to[2] - from[2];
        let mut turns = vec![0.0, 1.0];
        if climb.abs() > 0.0 {
            let limits = [self.altitudes_m.start(), self.altitudes_m.end()];
            turns.extend(limits.map(|limit| (limit - from[2]) / climb));
        }
        let [dx, dy] = [to[0] - from[0], to[1] - from[1]];
        for [a, b] in edges(&self.corners) {
            let [ex, ey] = [b[0] - a[0], b[1] - a[1]];
            let turn = dx * ey - dy * ex;
            turns.push(((a[0] - from[0]) * ey - (a[1] - from[1]) * ex) / turn);
        }
        turns.retain(|share| (0.0..=1.0).contains(share));
        turns.sort_by(f64::total_cmp);
        let parts = turns.iter().zip(turns.iter().skip(1));
        let inside = parts.filter(|(start, end)| {
            let share = start.midpoint(**end);
            let altitude_m = from[2] + share * climb;
            self.altitudes_m.contains(&altitude_m)
                && is_inside(&self.corners, [from[0] + share * dx, from[1] + share * dy])
        });
        inside.map(|(start, end)| end - start).sum::<f64>() * dx.hypot(dy)
    }
}

fn distance_m(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

fn edges(corners: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).map(|(from, to)| [*from, *to])
}

/// Returns true if `at` is inside the polygon.
///
/// It is inside if a ray from it crosses an odd number of the polygon's edges.
fn is_inside(corners: &[[f64; 2]], at: [f64; 2]) -> bool {
    let crossed = edges(corners).filter(|[a, b]| {
        (a[1] > at[1]) != (b[1] > at[1])
            && at[0] < a[0] + (at[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
    });
    crossed.count() % 2 == 1
}

/// Returns twice the signed area of the triangle a, b, c.
///
/// Two points c on opposite sides of the line a-b give opposite signs.
fn turn([a, b]: [[f64; 2]; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Returns true if two edges have a point in common.
fn cross(one: [[f64; 2]; 2], other: [[f64; 2]; 2]) -> bool {
    let sides = |edge, [a, b]: [[f64; 2]; 2]| turn(edge, a) * turn(edge, b) <= 0.0;
    let overlap = |axis: usize| {
        let range = |edge: [[f64; 2]; 2]| {
            let [a, b] = edge.map(|at| at.get(axis).copied().unwrap_or_default());
            (a.min(b), a.max(b))
        };
        let ((low, high), (least, most)) = (range(one), range(other));
        low <= most && least <= high
    };
    sides(one, other) && sides(other, one) && overlap(0) && overlap(1)
}

/// Returns true if the second edge runs back along the first edge.
///
/// The second edge must begin where the first edge ends.
fn is_spike(first: [[f64; 2]; 2], second: [[f64; 2]; 2]) -> bool {
    let [[a, b], [_, c]] = [first, second];
    let back = (a[0] - b[0]) * (c[0] - b[0]) + (a[1] - b[1]) * (c[1] - b[1]);
    !(turn(first, c).abs() > 1e-12 * distance_m(a, b) * distance_m(b, c)) && back > 0.0
}
