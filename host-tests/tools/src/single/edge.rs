//! Edges and faces of the box of a single relay's allowed positions.
//!
//! This module finds the best position on an edge, and with noise inside a face.
//!
//! # Edge
//!
//! One of x, y and altitude is free. The other two are fixed.
//!
//! With t the free coordinate, SIR_1 = A ((t - P)^2 + a) / (t^2 + b) and SIR_2 = K / ((t - E)^2 + d). SIR_2 has one
//! extremum, at E. SIR_1 has extrema where P t^2 - (P^2 + a - b) t - P b = 0, at two points whose product is -b.
//! Between these three points both are monotone. The worse SIR is therefore largest at an end of such an interval, or
//! at the one point where they cross. With noise SIR_1 may have three extrema.
//!
//! | free | P | a | b | E |
//! | --- | --- | --- | --- | --- |
//! | x | X | (Y - y)^2 + h^2 | y^2 + h^2 | D |
//! | y | Y | (X - x)^2 + h^2 | x^2 + h^2 | 0 |
//! | h | 0 | (X - x)^2 + (Y - y)^2 | x^2 + y^2 | 0 |
//!
//! # Extrema of SIR_1 on an edge with noise
//!
//! In the same notation, with s = (t - P)^2 + a, the slope of SIR_1 has the sign of
//!
//! ```text
//! P t^2 - (P^2 + a - b) t - P b - nu t s^2
//! ```
//!
//! For P > 0 (otherwise everything is mirrored) this over t, phi, is concave for t > 0, since s is convex and not negative, and
//! so is s^2. So there are at most two extrema, a minimum and a maximum, none before the noise-free minimum. For t < 0 phi falls
//! with |t| from a positive value: one extremum, closer than the noise-free one. For P = 0 the sign is that of -t (a - b + nu
//! (t^2 + a)^2).
//!
//! # Corridor at one altitude
//!
//! If the touching position is outside of the corridor, a relay with lateral freedom and noise is placed by a search at
//! one altitude.
//!
//! Without noise no position inside the rectangle can then be optimal. With noise there may be a second position at
//! which two level lines touch from within, on the other side of the interferer's line; near Y = 0 it is almost the
//! mirror image of the first. Their number is not proven, so the plane is searched. The best x for each y is computed
//! exactly, as on an edge. The best y is searched on values that are closer near y = 0, and by golden section around
//! the three best.
//!
//! # Touching position in a vertical plane
//!
//! With noise there may be a position inside the box at which the level lines of both SIRs touch.
//!
//! In the plane y = y0, SIR_2 is constant on the circle of radius r about (D, y0), and with z = x - D both squared distances are
//! linear in z:
//!
//! ```text
//! l = r^2 + y0^2 + D^2 + 2 D z               from Tx
//! s = r^2 + (D - X)^2 + (y0 - Y)^2 + 2 (D - X) z    from the interferer
//! ```
//!
//! The slope of SIR_1 = A s / (l (1 + nu s)) by z has the sign of (D - X) l - D s - D nu s^2. The sum of the first two terms does
//! not depend on z:
//!
//! ```text
//! T = (D - X) y0^2 - X r^2 + D ((D - X) X - (y0 - Y)^2)
//! ```
//!
//! Without noise SIR_1 is monotone along the circle, and no position inside the box is optimal: Theorem 3 as corrected. With
//! noise and X < D it rises up to s = sqrt(T / (D nu)) and falls beyond; this maximum is above the ground if |z| < r. For X >= D
//! the sign is negative.
//!
//! SIR_1 has no maximum off the ground: its slope by h is 0 only where l = s (1 + nu s), and then that by x only for X = 0, where
//! it is the sum of two terms that are not. So the maximum on a circle is that of its inside, and does not fall with r, while
//! SIR_2 does. They are equal at one r, found by bisection. A position inside the box that cannot be improved must be this one:
//! both slopes are opposite there, so SIR_1 is stationary along the circle, and the SIRs are equal.

use uav_relay::{Band, Interferer, Mission, Placement};
use uav_relay_scenario::number::narrow;

use super::extrema::{Slope, bisected};
use super::{Found, HALVINGS, TwoHops};

/// Coordinate that varies along an edge of the box in which a relay may be.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum EdgeCoordinate {
    /// Position varies from Tx toward Rx: edge along x.
    Along = 4,
    /// Lateral position varies: edge along y.
    Across = 5,
    /// Vertical edge: the altitude varies.
    Upward = 6,
}

/// Edge of the box of a relay's allowed positions.
///
/// The coordinate `free` varies within `room`, m. The other two coordinates are those of the point `through`.
#[derive(Clone, Copy)]
pub(super) struct Edge {
    pub(super) free: EdgeCoordinate,
    pub(super) through: Placement,
    pub(super) room: Band,
}

impl Edge {
    fn place(&self, t: f32) -> Placement {
        let mut place = self.through;
        match self.free {
            EdgeCoordinate::Along => place.x_m = t,
            EdgeCoordinate::Across => place.y_m = t,
            EdgeCoordinate::Upward => place.altitude_m = t,
        }
        place
    }

    /// Returns the extrema of both hops' SIRs along the edge, as values of the varying coordinate, m.
    ///
    /// An extremum that does not exist is NaN, or far away.
    fn turns(&self, mission: &Mission, interferer: &Interferer) -> [f32; 4] {
        let wide = |x: f32| f64::from(x);
        let at = self.through;
        let (x, y, h) = (wide(at.x_m), wide(at.y_m), wide(at.altitude_m));
        let (past, beside) = (wide(interferer.x_m), wide(interferer.y_m));
        let (p, a, b, end) = match self.free {
            EdgeCoordinate::Along => (
                past,
                squared(beside - y) + squared(h),
                squared(y) + squared(h),
                mission.config().distance_m,
            ),
            EdgeCoordinate::Across => (
                beside,
                squared(past - x) + squared(h),
                squared(x) + squared(h),
                0.0,
            ),
            EdgeCoordinate::Upward => (
                0.0,
                squared(past - x) + squared(beside - y),
                squared(x) + squared(y),
                0.0,
            ),
        };
        let noise = wide(mission.noise_at_a_metre());
        if noise > 0.0 {
            let [behind, valley, hill] = noisy_turns(p, a, b, noise).map(narrow);
            return [behind, valley, hill, end];
        }
        let [one, other] = noise_free_turns(p, a, b).map(narrow);
        [one, other, end, f32::NAN]
    }

    /// Returns the position on the edge with the best SIR of the worse hop.
    ///
    /// Work: at most 16 evaluations of both hops, and 42 more for each interval with a crossing of the two SIRs.
    /// Without noise there is one such interval for x and for the altitude, and two for y.
    pub(super) fn best(&self, hops: &TwoHops<'_>, interferer: &Interferer) -> Found {
        let Band {
            least_m: from,
            most_m: to,
        } = self.room;
        let mut best = hops.found(self.place(from));
        let mut low = from;
        let turns = self.turns(hops.mission, interferer);
        for turn in in_order(turns).into_iter().chain([to]) {
            let high = turn.max(low).min(to);
            if high > low {
                best = best.or(self.best_of(hops, low, high));
                low = high;
            }
        }
        best
    }

    /// Returns the best position on the edge with the varying coordinate above `low` and up to `high`, m.
    ///
    /// Between `low` and `high` each hop's SIR must only rise or only fall.
    fn best_of(&self, hops: &TwoHops<'_>, low: f32, high: f32) -> Found {
        let both = |t: f32| hops.both(self.place(t));
        let (at_low, at_high) = (both(low), both(high));
        let end = hops.found(self.place(high));
        let better = |(first, second): (f32, f32)| first > second;
        let apart = (at_high.0 > at_low.0) != (at_high.1 > at_low.1);
        if !apart || better(at_low) == better(at_high) {
            return end;
        }
        let is_low = |t| better(both(t)) == better(at_low);
        end.or(hops.crossing(low, high, is_low, |t| self.place(t)))
    }
}

/// Returns the values in ascending order. A copy of one of the other values replaces a NaN.
fn in_order([a, b, c, d]: [f32; 4]) -> [f32; 4] {
    let (a, b) = (a.min(b), a.max(b));
    let (c, d) = (c.min(d), c.max(d));
    let (a, c) = (a.min(c), a.max(c));
    let (b, d) = (b.min(d), b.max(d));
    [a, b.min(c), b.max(c), d]
}

const NOISY_HALVINGS: u8 = 60;

/// Returns the two t, m, of the first hop's extrema on an edge, if there is no noise.
///
/// t is the coordinate that varies along the edge.
fn noise_free_turns(p: f64, a: f64, b: f64) -> [f64; 2] {
    let half = 0.5 * (squared(p) + a - b);
    // The larger root first, the other from the product of both: neither loses digits.
    let root = libm::sqrt(squared(half) + squared(p) * b);
    let sum = half + libm::copysign(root, half);
    [sum / p, -p * b / sum]
}

/// Returns the three t, m, of the first hop's extrema on an edge, with noise.
///
/// t is the coordinate that varies along the edge. The SIR is proportional to s / ((t^2 + `b`) (1 + nu s)) with s = (t
/// - `p`)^2 + `a`; `noise` is nu. An extremum that does not exist is NaN.
fn noisy_turns(p: f64, a: f64, b: f64, noise: f64) -> [f64; 3] {
    if !(libm::fabs(p) > 0.0) {
        let squared = libm::sqrt((b - a) / noise) - a;
        let t = if squared > 0.0 {
            libm::sqrt(squared)
        } else {
            f64::NAN
        };
        return [-t, 0.0, t];
    }
    let slope = Slope {
        p: libm::fabs(p),
        q: p * p + a - b,
        a,
        b,
        noise,
        halvings: NOISY_HALVINGS,
    };
    let [one, other] = noise_free_turns(slope.p, a, b);
    let (behind, valley) = (one.min(other), one.max(other));
    let [low, high] = slope.valley_and_hill(valley).unwrap_or([f64::NAN; 2]);
    let mirrored = Slope {
        p: -slope.p,
        ..slope
    };
    [-mirrored.hill(-behind), low, high].map(|t| libm::copysign(1.0, p) * t)
}

/// Number of lines of constant y > 0 in the search at one altitude; there are as many with y < 0.
const LINES: u8 = 24;

/// Number of the best lines of constant y near which the search is refined.
const FOLLOWED: usize = 3;

/// Number of golden-section steps in y near each of the best lines of constant y.
const STEPS: u8 = 32;

const GOLDEN: f32 = 0.618_034;

/// Returns the position of a single relay with the highest SIR at the altitude `altitude_m`.
///
/// x is limited to `along`, and y to `across`. The best x is found on several lines of constant y. Then y is refined
/// near the best three lines. Work: at most 243 lines of some 90 evaluations of both hops.
pub(super) fn best_in_corridor(
    hops: &TwoHops<'_>,
    interferer: &Interferer,
    along: Band,
    across: Band,
    altitude_m: f32,
) -> Found {
    let line = |y_m: f32| {
        let through = Placement {
            x_m: 0.0,
            y_m,
            altitude_m,
        };
        let free = EdgeCoordinate::Along;
        let room = along;
        Edge {
            free,
            through,
            room,
        }
        .best(hops, interferer)
    };
    let mut best = line(0.0);
    // The three best lines, and the lines next to each.
    let mut followed = [(0.0_f32, 0.0_f32, 0.0_f32); FOLLOWED];
    for end in [across.least_m, across.most_m] {
        let at = |step: u8| {
            let part = f32::from(step) / f32::from(LINES);
            end * (part * part * part)
        };
        let (mut before, mut here) = (0.0, best.sir.max(line(0.0).sir));
        for step in 1..=LINES {
            let found = line(at(step));
            let after = found.sir;
            best = best.or(found);
            if here >= before && here >= after {
                keep(&mut followed, (here, at(step.saturating_sub(2)), at(step)));
            }
            (before, here) = (here, after);
        }
        keep(&mut followed, (here, at(LINES - 1), end));
    }
    for (sir, low, high) in followed {
        if !(sir > 0.0) {
            continue;
        }
        let (mut low, mut high) = (low, high);
        for _ in 0..STEPS {
            let (a, b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
            let (one, other) = (line(a), line(b));
            best = best.or(one).or(other);
            if one.sir > other.sir {
                high = b;
            } else {
                low = a;
            }
        }
    }
    best
}

/// Inserts a line of constant y into the list of the best lines, if it is good enough.
///
/// Each entry has the best SIR on the line, and the y of the two adjacent lines.
fn keep(followed: &mut [(f32, f32, f32); FOLLOWED], new: (f32, f32, f32)) {
    let mut new = new;
    for slot in followed {
        if new.0 > slot.0 {
            std::mem::swap(slot, &mut new);
        }
    }
}

/// Returns the position in the plane y = `y_m` at which the curves of constant SIR of both hops touch.
///
/// `None` if there is no noise, or if the position is not between Tx and Rx or not within the altitudes `band`. Work:
/// 40 bisection steps.
pub(super) fn touching_inside(
    hops: &TwoHops<'_>,
    interferer: &Interferer,
    y_m: f32,
    band: Band,
) -> Option<Found> {
    let mission = hops.mission;
    let face = Face {
        d: f64::from(mission.config().distance_m),
        x: f64::from(interferer.x_m),
        aside: squared(f64::from(y_m) - f64::from(interferer.y_m)),
        y: squared(f64::from(y_m)),
        noise: f64::from(mission.noise_at_a_metre()),
        g: mission.last_to_first(hops.power_w),
    };
    if !(face.noise > 0.0 && face.x < face.d) {
        return None;
    }
    let farthest = libm::hypot(face.d, f64::from(band.most_m));
    let is_inside = |r| face.first(r) < face.g / (squared(r) + face.y);
    let (_, r) = bisected(0.0, farthest, HALVINGS, is_inside);
    let z = face.best(r);
    let across = squared(r) - squared(z);
    let place = Placement {
        x_m: narrow(face.d + z),
        y_m,
        altitude_m: narrow(libm::sqrt(across.max(0.0))),
    };
    let within = (0.0..=mission.config().distance_m).contains(&place.x_m)
        && (band.least_m..=band.most_m).contains(&place.altitude_m);
    within.then(|| hops.found(place))
}

/// Vertical plane y = y0, with the numbers that both hops' SIRs depend on.
///
/// The numbers are D (distance Tx-Rx), the interferer's X, (y0 - Y)^2, y0^2, the noise nu, and the ratio G = K / A of
/// the hops' gains, in m and m^2.
struct Face {
    d: f64,
    x: f64,
    aside: f64,
    y: f64,
    noise: f64,
    g: f64,
}

impl Face {
    /// Returns the point on a circle about Rx in this plane at which the first hop's SIR is largest.
    ///
    /// The result is its x minus the x of Rx, m. `r` is the radius of the circle, m.
    fn best(&self, r: f64) -> f64 {
        let (d, gap) = (self.d, self.d - self.x);
        let t = gap * self.y - self.x * squared(r) + d * (gap * self.x - self.aside);
        let s = libm::sqrt((t / (d * self.noise)).max(0.0));
        let z = (s - squared(r) - squared(gap) - self.aside) / (2.0 * gap);
        z.max(-r).min(r)
    }

    /// Returns the first hop's largest SIR, divided by the hop's gain, on a circle about Rx in this plane.
    ///
    /// `r` is the radius of the circle, m.
    fn first(&self, r: f64) -> f64 {
        let (z, gap) = (self.best(r), self.d - self.x);
        let s = squared(r) + squared(gap) + self.aside + 2.0 * gap * z;
        let l = squared(r) + self.y + squared(self.d) + 2.0 * self.d * z;
        s / (l * (1.0 + self.noise * s))
    }
}

pub(super) fn squared(x: f64) -> f64 {
    x * x
}
