//! Maximum distance of a sender from its receiver in a field. Algorithm 4's steps back from Rx, in closed form.
//!
//! The receiver's position is known, and with it Upsilon. With the receiver at (x0, h0), its sender at (x0 - d, h) and A = p
//! Upsilon(x0) / `mu_los` for a sender of p watts, E(SIR) >= gamma is
//!
//! ```text
//! d^2 <= A / gamma - (h - h0)^2
//! ```
//!
//! This is the paper's eq. (num), for relays at different altitudes. For the last hop x0 = D, h0 = 0 and A = p Upsilon(D) / eta.
//! The printed algorithm lets a position become negative; here a sender stops where there is just room for those before it.
//!
//! The receiver need not be as close to Tx as possible: with less interference the hop may be longer. The positions of
//! a relay from which the chain can be continued to Rx form a range [l, r], and the next range starts at
//!
//! ```text
//! l_k = min { y - d(y) : l_{k+1} <= y <= r_{k+1} }.
//! ```
//!
//! Between two points of the field d(y)^2 = c Upsilon(y) - q with q = (h - h0)^2 is linear in y, so y - d(y) is convex where it
//! is defined. Its minimum is at an end, where d falls to the minimum step, or where d'(y) = 1: d = c b / 2 with b the slope of
//! Upsilon. `identical_relays_in_a_field_are_optimal` in `host-tests/tests/fleet/` compares it with grids of positions. If a minimum
//! separation or a climb excludes some y, the ranges may have holes, and l_k is a bound.
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
//! Between two points of the field the right side is linear in x, so the margin is concave there, and the first x from which both
//! directions work is a root of a quadratic.
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
//! The second equation is linear in x and z, and leaves a quadratic for z. `longest` compares all these y. For a given x the set of y
//! that both directions allow is exact: the y up to x + sqrt(A' / gamma - q). The y of a range that lie in a hole are refused.
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

/// Relative tolerance, for rounding errors, on the maximum squared length of a hop toward Tx.
const ROUNDING: f32 = 4e-6;

/// Maximum number of corrections that shorten a computed hop until it meets its target. Each correction is one rounding
/// step of an f32.
const ULPS: u8 = 8;

/// Hop toward Rx in an interference field. Its methods compute the sender's x for a target.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Retreat<'a> {
    /// Gain A of the hop, m^2. The hop's SIR is A times `quiet`, divided by the squared length.
    ///
    /// `quiet` is Upsilon at the receiver divided by the field's largest Upsilon. Upsilon = E[1/I] is the mean inverse
    /// of the interference power I. For the hop to Rx, A includes Upsilon at Rx, and `quiet` is 1.
    gain: f32,
    /// Squared altitude difference of the hop's sender and receiver, m^2.
    climb_squared: f32,
    least_step: f32,
    /// Smallest permitted x of this hop's sender, m; Tx is at x = 0.
    end_m: f32,
    to_rx: bool,
    /// Gain of the backward hop from this hop's receiver to its sender, and interference at the sender. `None` for data
    /// in one direction. The gain applies to the field's largest Upsilon = E[1/I]. It is divided by r, the required
    /// ratio of backward to forward SIR.
    back: Option<(f32, HopInterference<'a>)>,
}

impl<'a> Retreat<'a> {
    /// Returns the hop from relay `index` to the next relay toward Rx, or to Rx. `altitude_m` is the altitude of the
    /// receiving relay, m; `None` for Rx. `own` has the altitude and power of relay `index`.
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

    /// Returns this hop together with the backward hop, if the mission has data from Rx to Tx.
    ///
    /// The backward hop's sender, which receives this hop, has `power_w` watts; `None` if it is Rx. The backward hop's
    /// receiver, which sends this hop, has measured `measured_per_w`: Upsilon, the mean inverse interference power,
    /// 1/W.
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

    /// Returns this hop without space along x for the relays closer to Tx than its sender. The sender's x can then be
    /// as small as 0.
    pub(super) fn to_the_end(self, mission: &Mission, index: u16) -> Self {
        Self {
            end_m: mission.end_freely(index),
            ..self
        }
    }

    /// Returns the smallest permitted x of the receiver, m. It is the sender's smallest permitted x plus the hop's
    /// minimum length along x.
    fn nearest(&self) -> f32 {
        let place = self.end_m + self.least_step;
        if place - self.end_m < self.least_step {
            place.next_up()
        } else {
            place
        }
    }

    /// Returns the smallest x, up to `from_m`, from which the sender meets `target`. `None` if there is none. The x is
    /// not below the sender's smallest permitted x.
    ///
    /// `target` is a linear SIR above zero. `from_m` is the receiver's x, from 0 to the x of Rx, m. `quiet` is above
    /// 0: Upsilon = E[1/I] at the receiver divided by the field's largest Upsilon, and 1 at Rx. The result is rounded
    /// toward the receiver. Constant work.
    pub fn reach(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
        let place = self.onward(target, from_m, quiet)?;
        match self.back() {
            Some((gain, heard)) => self.first(gain / target, heard, place, from_m, f32::INFINITY),
            None => Some(place),
        }
    }

    /// Returns the smallest x, m, of this hop's sender at which the backward hop to it meets the target. `None` if
    /// there is none.
    ///
    /// The x is at least `place` and below `most_m`. This hop's receiver, at x = `from_m`, sends the backward hop. `c`
    /// is the gain of the backward hop for the field's largest Upsilon, divided by the target. Work: at most one root
    /// for each field point from `place` to `from_m`.
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

    /// Returns the largest x of this hop's receiver, m, at which the backward hop from it meets `target`. The backward
    /// hop leads to this hop's sender, which is at x = `place`. The result is infinite for data in one direction, and
    /// -infinite if no x meets `target`.
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

    /// Returns the x of [`Retreat::reach`] for data toward Rx only; `None` if there is none.
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

    /// Returns the longest hop that meets `target`: the smallest x of the sender. `None` if no hop meets it. The
    /// function chooses the receiver's x from `low` to `high`, m.
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

    /// Returns the hop of [`Retreat::longest`] for data in both directions. `there` is the longest hop for data toward
    /// Rx only.
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

    /// Returns the smallest x of the sender for a receiver at `y_m`, m. `quiet` is the receiver's Upsilon divided by
    /// the field's largest Upsilon.
    ///
    /// If `best_m` is `None`, only data toward Rx count. Otherwise both directions of data count, and the result must
    /// be below the value in `best_m`. The function then stores the result in `best_m`.
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

    /// Returns the hop with the smallest x of its sender. The function [`least`] searches for the receiver's x.
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

    /// Returns the receiver's x, m, for each hop that just meets the target in both directions of data. There are at
    /// most two such hops.
    ///
    /// The sender is in the part `from` of the field, the receiver in the part `to`. In each part Upsilon, the mean
    /// inverse interference power, is linear in x. `gains` has the forward and the backward gain, each divided by the
    /// target.
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

    /// Returns the hop of [`Retreat::longest`] for data toward Rx only.
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

/// Hop along the line from Tx to Rx: the x of its receiver and the x of its sender.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// x of the receiver of this hop, m; Tx is at x = 0.
    pub to_m: f32,
    /// x of the sender of this hop, m; Tx is at x = 0.
    pub from_m: f32,
}

/// Interference at a hop's receiver, as a function of the receiver's x.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum HopInterference<'a> {
    /// Measured interference, taken as equal at every x. The value is the measured Upsilon, the mean inverse
    /// interference power, divided by the largest Upsilon of the mission's field.
    Evenly(f32),
    /// Interference field of the mission, with receiver noise.
    In(InNoise<'a>),
}

impl<'a> HopInterference<'a> {
    /// Returns the interference at a receiver: its measurement if there is one, else the mission's field.
    /// `measured_per_w` is Upsilon, the measured mean inverse interference power, in 1/W. Both measurement and field
    /// include the receiver noise.
    pub fn new(mission: &'a Mission, measured_per_w: Option<f32>) -> Self {
        match (mission.heard(), measured_per_w) {
            (Some(field), Some(upsilon)) => Self::Evenly(upsilon / field.largest()),
            (Some(field), None) => Self::In(field),
            (None, _) => Self::Evenly(1.0),
        }
    }

    /// Returns Upsilon at `x_m` as a fraction of the largest Upsilon of the interference field. Upsilon is the mean
    /// inverse interference power, E[1/I].
    pub fn quiet(self, x_m: f32) -> f32 {
        match self {
            Self::Evenly(quiet) => quiet,
            Self::In(field) => field.upsilon(x_m) / field.largest(),
        }
    }

    /// Returns the part of the interference field between `start_m`, m, and the field's next point in x. The part ends
    /// at `end_m`, m, if the next point is beyond.
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

/// Part of the interference field in which Upsilon is linear in x. Upsilon = E[1/I] is the mean inverse interference
/// power.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Piece {
    start_m: f32,
    end_m: f32,
    /// Upsilon at the smallest x of this part, divided by the field's largest Upsilon. Upsilon is the mean inverse
    /// interference power.
    level: f32,
    /// Change of `level` per metre of x.
    slope: f32,
}

/// Returns the hop with the smallest x of its sender, for a receiver's x in [`low`, `high`], m. If several hops are
/// equally good, the function returns the one with the smallest x of the receiver.
///
/// `value` gets the receiver's x, y, and `quiet`, which is Upsilon = E[1/I] at y divided by the field's largest
/// Upsilon. It returns the sender's x, y - sqrt(`c` quiet - s). `c` is the sender's gain divided by the target, and s
/// is the first of `squares`. `value` returns `None` if the square under the root is below the second of `squares`
/// minus the first. Work: at most three values for each field point from `low` to `high` that a hop could reach.
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
