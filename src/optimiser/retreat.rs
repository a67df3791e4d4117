//! Maximum distance of a sender from its receiver in a field. Algorithm 4's steps back from Rx, in closed form.
//!
//! The receiver's position is known, and with it Upsilon. With the receiver at (x0, h0), its sender at (x0 - d, h) and
//! A = p Upsilon(x0) / `mu_los` for a sender of p watts, E(SIR) >= gamma is
//!
//! ```text
//! d^2 <= A / gamma - (h - h0)^2
//! ```
//!
//! This is the paper's eq. (num), for relays at different altitudes. For the last hop x0 = D, h0 = 0 and A = p
//! Upsilon(D) / eta. The printed algorithm lets a position become negative; here a sender stops where there is just
//! room for those before it.
//!
//! The receiver need not be as close to Tx as possible: with less interference the hop may be longer. The positions of
//! a relay from which the chain can be continued to Rx form a range [l, r], and the next range starts at
//!
//! ```text
//! l_k = min { y - d(y) : l_{k+1} <= y <= r_{k+1} }.
//! ```
//!
//! Between two points of the field d(y)^2 = c Upsilon(y) - q with q = (h - h0)^2 is linear in y, so y - d(y) is convex
//! where it is defined. Its minimum is at an end, where d falls to the minimum step, or where d'(y) = 1: d = c b / 2
//! with b the slope of Upsilon. `identical_relays_in_a_field_are_optimal` in `host-tests/tests/fleet/` compares it with
//! grids of positions. If a minimum separation or a climb excludes some y, the ranges may have holes, and l_k is a
//! bound.
//!
//! # Way back
//!
//! On the way back (data from Rx to Tx) the hop's receiver at y sends, and its sender at x receives. With A' = p'
//! Upsilon(x) / (`mu_los` r) for p' watts at y the way back meets the target if
//!
//! ```text
//! (y - x)^2 <= A' / gamma - q.
//! ```
//!
//! Between two points of the field the right side is linear in x, so the margin is concave there. The first x from
//! which both directions work is a root of a quadratic.
//!
//! If x stays between two points of the field, and y too, each direction allows a convex set of pairs (x, y). So the
//! smallest x has one of three kinds of y: the smallest or largest y of that part of the field, the y that is best for
//! data toward Rx, or one with which the hop just meets the target in both directions. With y = x + z, c = p /
//! (`mu_los` gamma) and c' = p' / (`mu_los` r gamma) the last is
//!
//! ```text
//! z^2 = c Upsilon(y) - q,    c Upsilon(y) = c' Upsilon(x).
//! ```
//!
//! The second equation is linear in x and z, and leaves a quadratic for z. `longest` compares all these y. For a given
//! x the set of y that both directions allow is exact: the y up to x + sqrt(A' / gamma - q). The y of a range that lie
//! in a hole are refused.
//!
//! Accuracy: `retreats_agree_with_the_reference` in `host-tests/tests/stochastic.rs` compares with f64, and
//! `the_best_places_in_a_field_are_found` in `host-tests/tests/both_ways/field.rs` compares chains with a grid search.

use core::cell::Cell;

use crate::features::REVERSE;
use crate::field::{FieldPoint, InNoise};
use crate::mission::Mission;
use crate::place::Station;
use crate::root::sqrt;
use crate::sir::{Sender, square};

/// Relative rounding tolerance on a hop's maximum squared length.
const ROUNDING: f32 = 4e-6;

/// Maximum number of f32 steps that shorten a hop.
const ULPS: u8 = 8;

/// Hop toward Rx in a field, from a searched sender.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Retreat<'a> {
    /// Gain A, m^2: SIR = `A quiet / squared length`. `quiet` is Upsilon divided by the largest.
    gain: f32,
    /// Squared altitude difference of the hop, m^2.
    climb_squared: f32,
    least_step: f32,
    /// Smallest permitted x of the sender, m.
    end_m: f32,
    to_rx: bool,
    /// Backward gain / r, and the interference at its receiver, if any.
    back: Option<(f32, HopInterference<'a>)>,
}

impl<'a> Retreat<'a> {
    /// Returns the hop to a relay at `altitude_m`; `None` for Rx.
    pub fn new(mission: &Mission, own: Station, index: u16, altitude_m: Option<f32>) -> Self {
        let climb_squared = square(own.cross_section.altitude_m - altitude_m.unwrap_or(0.0));
        let (gain, least_step) = match altitude_m {
            Some(_) => (
                mission.relay_gain(own.power_w).value(),
                mission.least_step(climb_squared),
            ),
            // The receiver is on the ground, so altitude alone separates relay N from it.
            None => (mission.receiver_gain(own.power_w), 0.0),
        };
        Self {
            gain,
            climb_squared,
            least_step,
            end_m: mission.end_for(index, 0.0),
            to_rx: altitude_m.is_none(),
            back: None,
        }
    }

    /// Adds the backward hop, if the mission has one. `measured_per_w` is Upsilon at its receiver, 1/W.
    pub(super) fn both_ways(
        self,
        mission: &'a Mission,
        power_w: Option<f32>,
        measured_per_w: Option<f32>,
    ) -> Self {
        let reverse = mission.reverse();
        if !(reverse > 0.0) {
            return self;
        }
        let gain = power_w.map_or(Sender::receiver(mission).gain, |power_w| {
            mission.relay_gain(power_w)
        });
        let heard = HopInterference::new(mission, measured_per_w);
        Self {
            back: Some((gain.value() / reverse, heard)),
            ..self
        }
    }

    fn back(&self) -> Option<(f32, HopInterference<'a>)> {
        if REVERSE { self.back } else { None }
    }

    /// Returns this hop with any sender x down to Tx.
    pub(super) fn to_the_end(self, mission: &Mission, index: u16) -> Self {
        Self {
            end_m: mission.end_freely(index),
            ..self
        }
    }

    /// Returns the smallest permitted x of the receiver, m.
    fn nearest(&self) -> f32 {
        let place = self.end_m + self.least_step;
        if place - self.end_m < self.least_step {
            place.next_up()
        } else {
            place
        }
    }

    /// Returns the smallest x that meets `target`, in [end, `from_m`], m. `quiet` is Upsilon divided by the largest.
    /// Rounded toward the receiver.
    pub fn reach(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
        let place = self.onward(target, from_m, quiet)?;
        match self.back() {
            Some((gain, heard)) => self.first(gain / target, heard, place, from_m, f32::INFINITY),
            None => Some(place),
        }
    }

    /// Returns the smallest x in [`place`, `most_m`) that receives the backward hop, m.
    #[inline(never)] // keeps a sweep of one direction small
    fn first(
        &self,
        c: f32,
        heard: HopInterference<'_>,
        place: f32,
        from_m: f32,
        most_m: f32,
    ) -> Option<f32> {
        let apart = self.climb_squared;
        let is_met =
            |x: f32, quiet: f32| square(from_m - x) + apart <= c * quiet * (1.0 + 0.25 * ROUNDING);
        let last = from_m - self.least_step;
        let hop = |x: f32| {
            let is_hop = x <= last && x < most_m && (x < from_m || self.to_rx);
            is_hop.then_some(x)
        };
        let end = last.min(most_m);
        let mut start_m = place;
        loop {
            let piece = heard.piece(start_m, end);
            if is_met(piece.start_m, piece.level) {
                return hop(piece.start_m);
            }
            // With z = y - x: z^2 + 2 h z - C <= 0.
            let h = 0.5 * c * piece.slope;
            let squared = c * (piece.level + piece.slope * (from_m - piece.start_m)) - apart;
            let discriminant = square(h) + squared;
            if discriminant >= 0.0 {
                let root = sqrt(discriminant);
                let z = if h > 0.0 {
                    squared / (h + root)
                } else {
                    root - h
                };
                let (mut x, mut z) = ((from_m - z).max(piece.start_m), z);
                for _ in 0..ULPS {
                    if x <= piece.end_m && is_met(x, heard.quiet(x)) {
                        return hop(x);
                    }
                    z = z.next_down();
                    x = x.next_up().max(from_m - z);
                }
            }
            start_m = piece.end_m;
            if start_m >= end {
                break;
            }
        }
        is_met(end, heard.quiet(end)).then(|| hop(end)).flatten()
    }

    /// Returns the largest receiver x whose backward hop reaches `place`, m. Infinite for one direction, -infinite if
    /// none.
    pub(super) fn heard_up_to(&self, target: f32, place: f32) -> f32 {
        let Some((gain, heard)) = self.back() else {
            return f32::INFINITY;
        };
        let squared = gain * heard.quiet(place) / target * (1.0 + ROUNDING) - self.climb_squared;
        if squared >= 0.0 {
            (place + sqrt(squared)).next_up()
        } else {
            f32::NEG_INFINITY
        }
    }

    /// Returns [`Retreat::reach`] for data toward Rx only.
    fn onward(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
        let room = from_m - self.end_m;
        if room < self.least_step {
            return None;
        }
        // Limited to 1e9 m, far beyond any end, to avoid infinity.
        let squared = (self.gain * quiet / target).min(1e18) - self.climb_squared;
        if !(squared >= 0.0) {
            return None;
        }
        let d = sqrt(squared);
        if d >= room {
            return Some(self.end_m);
        }
        if d < self.least_step {
            return None;
        }
        let place = from_m - d;
        let place = if from_m - place > d {
            place.next_up()
        } else {
            place
        };
        // Two relays never share an x, however short the hop.
        (place < from_m || self.to_rx).then_some(place)
    }

    /// Returns the hop with the smallest x of its sender.
    pub fn longest(
        &self,
        interference: HopInterference<'_>,
        target: f32,
        low: f32,
        high: f32,
    ) -> Option<Step> {
        let there = self.longest_there(interference, target, low, high)?;
        if self.back().is_none() {
            return Some(there);
        }
        self.longest_both_ways(interference, target, low, high, there)
    }

    /// Returns [`Retreat::longest`] for both directions; `there` is that toward Rx.
    #[inline(never)] // keeps a sweep of one direction small
    fn longest_both_ways(
        &self,
        interference: HopInterference<'_>,
        target: f32,
        low: f32,
        high: f32,
        there: Step,
    ) -> Option<Step> {
        let (gain, heard) = self.back()?;
        let gains = [self.gain, gain].map(|gain| gain / target);
        // Smallest x of the sender so far.
        let best_m = Cell::new(f32::INFINITY);
        let value = |y| self.sender(target, y, interference.quiet(y), Some(&best_m));
        let first = value(there.to_m).map(|from_m| Step {
            to_m: there.to_m,
            from_m,
        });
        if first == Some(there) {
            return first;
        }
        let mut best = self
            .searched(interference, target, low, high, Some(&best_m))
            .or(first);
        let HopInterference::In(_) = interference else {
            return best;
        };
        let mut to_m = low.max(self.nearest());
        while to_m < high {
            let to = interference.piece(to_m, high);
            let mut from_m = there.from_m;
            while from_m < best_m.get().min(to.end_m) {
                let from = heard.piece(from_m, to.end_m);
                for y in self.equal_limits(gains, from, to).into_iter().flatten() {
                    if let Some(from_m) = value(y) {
                        best = Some(Step { to_m: y, from_m });
                    }
                }
                from_m = from.end_m;
            }
            to_m = to.end_m;
        }
        best
    }

    /// Returns the smallest sender x for a receiver at `y_m`, m.
    #[inline]
    fn sender(&self, target: f32, y_m: f32, quiet: f32, best_m: Option<&Cell<f32>>) -> Option<f32> {
        let place = self.onward(target, y_m, quiet)?;
        let Some((best_m, (gain, heard))) = best_m.zip(self.back()) else {
            return Some(place);
        };
        let from_m = self.first(gain / target, heard, place, y_m, best_m.get())?;
        best_m.set(from_m);
        Some(from_m)
    }

    /// Returns the hop that [`least`] finds.
    #[inline(never)] // one copy for data in one and in both directions
    fn searched(
        &self,
        interference: HopInterference<'_>,
        target: f32,
        low: f32,
        high: f32,
        best_m: Option<&Cell<f32>>,
    ) -> Option<Step> {
        let apart = self.climb_squared;
        let squares = [apart, apart + square(self.least_step)];
        let low = low.max(self.nearest());
        let value = |y, quiet| self.sender(target, y, quiet, best_m);
        least(interference, self.gain / target, squares, low, high, value)
    }

    /// Returns the receiver x that just meet both directions, m. `gains` are divided by the target.
    fn equal_limits(&self, gains: [f32; 2], from: Piece, to: Piece) -> [Option<f32>; 2] {
        let [c, back] = gains;
        let (rise, back_rise) = (c * to.slope, back * from.slope);
        let across = rise - back_rise;
        // With the sender's x = (level - rise z) / across, and the receiver's x + z.
        let level = back * (from.level - from.slope * from.start_m)
            - c * (to.level - to.slope * to.start_m);
        let h = 0.5 * back_rise * rise / across;
        let squared = back * from.level + back_rise * (level / across - from.start_m);
        let discriminant = square(h) + squared - self.climb_squared;
        // Not a number if both sides of the equation are equal everywhere, or nowhere.
        if !(discriminant >= 0.0) {
            return [None; 2];
        }
        let root = sqrt(discriminant);
        [root - h, -root - h].map(|z| {
            let y = (level - rise * z) / across + z;
            (y >= to.start_m && y <= to.end_m).then_some(y)
        })
    }

    /// Returns [`Retreat::longest`] for data toward Rx only.
    pub(super) fn longest_there(
        &self,
        interference: HopInterference<'_>,
        target: f32,
        low: f32,
        high: f32,
    ) -> Option<Step> {
        self.searched(interference, target, low, high, None)
    }
}

/// Hop along the line: x of receiver and sender.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// x of the receiver, m.
    pub to_m: f32,
    /// x of the sender, m.
    pub from_m: f32,
}

/// Interference at a receiver as a function of x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum HopInterference<'a> {
    /// Measured Upsilon at every x, divided by the field's largest.
    Evenly(f32),
    /// Interference field with receiver noise.
    In(InNoise<'a>),
}

impl<'a> HopInterference<'a> {
    /// Returns the measurement, or else the field.
    pub fn new(mission: &'a Mission, measured_per_w: Option<f32>) -> Self {
        match (mission.heard(), measured_per_w) {
            (Some(field), Some(upsilon)) => Self::Evenly(upsilon / field.largest()),
            (Some(field), None) => Self::In(field),
            (None, _) => Self::Evenly(1.0),
        }
    }

    /// Returns Upsilon = E[1/I] at `x_m`, divided by the largest.
    pub fn quiet(self, x_m: f32) -> f32 {
        match self {
            Self::Evenly(quiet) => quiet,
            Self::In(field) => field.upsilon(x_m) / field.largest(),
        }
    }

    /// Returns the field from `start_m` to the next point.
    #[inline(never)] // one copy for all loops
    fn piece(self, start_m: f32, end_m: f32) -> Piece {
        let points = match self {
            Self::In(field) => field.points(),
            Self::Evenly(_) => &[],
        };
        let next = points.partition_point(|point| point.x_m <= start_m);
        let end_m = points.get(next).map_or(end_m, |point| point.x_m.min(end_m));
        let level = self.quiet(start_m);
        let slope = if end_m > start_m {
            (self.quiet(end_m) - level) / (end_m - start_m)
        } else {
            0.0
        };
        Piece {
            start_m,
            end_m,
            level,
            slope,
        }
    }
}

/// Part of the field with a linear Upsilon.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Piece {
    start_m: f32,
    end_m: f32,
    /// Upsilon at this part's smallest x, divided by the largest.
    level: f32,
    /// Change of `level` per metre of x.
    slope: f32,
}

/// Returns the hop with the smallest sender x, then receiver x. `value` is `y - sqrt(c quiet - s)` with
/// `s = squares[0]`, for receiver y. Three values per reachable field point.
pub(super) fn least(
    interference: HopInterference<'_>,
    c: f32,
    squares: [f32; 2],
    low: f32,
    high: f32,
    value: impl Fn(f32, f32) -> Option<f32>,
) -> Option<Step> {
    if low > high {
        return None;
    }
    let mut best: Option<Step> = None;
    let mut weigh = |y: f32, quiet: f32| {
        if let Some(from_m) = value(y, quiet)
            && best.is_none_or(|best| from_m < best.from_m)
        {
            best = Some(Step { to_m: y, from_m });
        }
        best
    };
    weigh(low, interference.quiet(low));
    let HopInterference::In(field) = interference else {
        return best;
    };
    if field.is_constant() {
        return best;
    }
    weigh(high, interference.quiet(high));
    let [apart, least_apart] = squares;
    let points = field.points();
    let first = points.partition_point(|point| point.x_m <= low);
    let level = |point: FieldPoint| field.point(point).upsilon_per_w / field.largest();
    for pair in points
        .get(first.saturating_sub(1)..)
        .unwrap_or_default()
        .windows(2)
    {
        let [left, right] = pair else { continue };
        if left.x_m >= high {
            break;
        }
        let (start, end) = (level(*left), level(*right));
        let best = if left.x_m > low {
            weigh(left.x_m, start)
        } else {
            weigh(low, interference.quiet(low))
        };
        // To start closer to Tx than the best hop, a hop would have to be longer than possible here.
        if let Some(best) = best
            && left.x_m > best.from_m
            && square(left.x_m - best.from_m) + apart > c * start.max(end)
        {
            continue;
        }
        let slope = (end - start) / (right.x_m - left.x_m);
        // The points at which the root is c slope / 2, and at which the root is just long enough to count.
        let steepest = (square(0.5 * c * slope) + apart) / c;
        let shortest = least_apart / c * (1.0 + 1e-6);
        for quiet in [steepest, shortest] {
            let y = left.x_m + (quiet - start) / slope;
            if y > low.max(left.x_m) && y < high.min(right.x_m) {
                weigh(y, interference.quiet(y));
            }
        }
    }
    if let Some(last) = points
        .last()
        .filter(|last| last.x_m > low && last.x_m < high)
    {
        weigh(last.x_m, level(*last));
    }
    best
}
