//! One edge of the box of a single relay: one of x, y and altitude is free, the other two are fixed.
//!
//! With t the free coordinate, SIR_1 = A ((t - P)^2 + a) / (t^2 + b) and SIR_2 = K / ((t - E)^2 + d). SIR_2 has one extremum, at
//! E. SIR_1 has extrema where P t^2 - (P^2 + a - b) t - P b = 0, at two points whose product is -b. Between these three points
//! both are monotone, so the worse one is maximal at an end of such an interval, or where they cross, which is at one point. With
//! noise SIR_1 may have three extrema: [`edge_noise`].
//!
//! | free | P | a | b | E |
//! | --- | --- | --- | --- | --- |
//! | x | X | (Y - y)^2 + h^2 | y^2 + h^2 | D |
//! | y | Y | (X - x)^2 + h^2 | x^2 + h^2 | 0 |
//! | h | 0 | (X - x)^2 + (Y - y)^2 | x^2 + y^2 | 0 |

use super::{Found, HALVINGS, edge_noise};
use crate::mission::{Band, Interferer, Mission};
use crate::place::Placement;
use crate::sir::{self, Sender};

/// Free coordinate of an edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum EdgeCoordinate {
    /// x, along the line from Tx to Rx.
    Along = 4,
    /// y, across it.
    Across = 5,
    /// Altitude.
    Upward = 6,
}

/// Two hops of a mission's only relay, at any position.
#[derive(Clone, Copy)]
pub(super) struct TwoHops<'a> {
    pub(super) mission: &'a Mission,
    pub(super) power_w: f32,
}

impl TwoHops<'_> {
    fn both(&self, at: Placement) -> (f32, f32) {
        let first = Sender::transmitter(self.mission).sir_at(self.mission, 0.0, at);
        (first, sir::at_receiver(self.mission, at, self.power_w))
    }

    pub(super) fn found(&self, place: Placement) -> Found {
        let (first, second) = self.both(place);
        Found {
            place,
            sir: first.min(second),
        }
    }
}

/// Edge that contains `through`, with the free coordinate in `room`, m.
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

    /// Returns the extrema of SIR_1, computed in f64, and of SIR_2; missing ones are NaN, or far away.
    fn turns(&self, mission: &Mission, interferer: &Interferer) -> [f32; 4] {
        let wide = |x: f32| f64::from(x);
        let squared = |x: f64| x * x;
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
            let [behind, valley, hill] = edge_noise::turns(p, a, b, noise).map(narrow);
            return [behind, valley, hill, end];
        }
        let half = 0.5 * (squared(p) + a - b);
        // The larger root first, the other one from their product: neither cancels.
        let root = libm::sqrt(squared(half) + squared(p) * b);
        let sum = half + libm::copysign(root, half);
        [narrow(sum / p), narrow(-p * b / sum), end, f32::NAN]
    }

    /// Returns the best position on the edge. Work: at most 10 evaluations of both hops, and 40 more for each interval on which
    /// one SIR rises, the other falls, and they cross: without noise one such interval for x and for the altitude, two for y.
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

    /// Returns the best position of the interval [`low`, `high`] without its lower end; each SIR is monotone on it.
    fn best_of(&self, hops: &TwoHops<'_>, low: f32, high: f32) -> Found {
        let both = |t: f32| hops.both(self.place(t));
        let (at_low, at_high) = (both(low), both(high));
        let end = hops.found(self.place(high));
        let better = |(first, second): (f32, f32)| first > second;
        let apart = (at_high.0 > at_low.0) != (at_high.1 > at_low.1);
        if !apart || better(at_low) == better(at_high) {
            return end;
        }
        let (mut low, mut high) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if !(middle > low && middle < high) {
                break;
            }
            if better(both(middle)) == better(at_low) {
                low = middle;
            } else {
                high = middle;
            }
        }
        let crossing = hops.found(self.place(low));
        end.or(crossing).or(hops.found(self.place(high)))
    }
}

/// Sorts the values; a NaN is replaced by one of the others.
fn in_order([a, b, c, d]: [f32; 4]) -> [f32; 4] {
    let (a, b) = (a.min(b), a.max(b));
    let (c, d) = (c.min(d), c.max(d));
    let (a, c) = (a.min(c), a.max(c));
    let (b, d) = (b.min(d), b.max(d));
    [a, b.min(c), b.max(c), d]
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a place is given as an f32"
)]
pub(super) fn narrow(value: f64) -> f32 {
    value as f32
}
