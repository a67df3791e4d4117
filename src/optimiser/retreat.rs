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
//! The receiver need not be as close to Tx as possible: with less interference the hop may be longer. The positions from which a
//! relay can be continued to Rx form a range [l, r], and the next range starts at
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
//! Accuracy: asserted by `retreats_agree_with_the_reference` in `host-tests/tests/stochastic.rs` against f64.

use crate::field::{FieldPoint, InNoise};
use crate::mission::Mission;
use crate::place::Station;
use crate::root::sqrt;
use crate::sir::square;

/// Hop toward Rx in an interference field, prepared for many targets. The position of its receiver is known.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Retreat {
    /// Gain A of the hop, m^2, for the field's largest Upsilon = E[1/I]. For the hop to Rx it is that with the
    /// Upsilon at Rx.
    gain: f32,
    /// Squared difference in altitude of sender and receiver, (h - h0)^2, m^2.
    climb_squared: f32,
    least_step: f32,
    /// Smallest x that the hop's sender may take, m.
    end_m: f32,
    to_rx: bool,
}

impl Retreat {
    /// Returns the hop from relay `index`, `own`, to a relay at `altitude_m`, m; `None` stands for Rx.
    pub fn new(mission: &Mission, own: Station, index: u16, altitude_m: Option<f32>) -> Self {
        let climb = own.cross_section.altitude_m - altitude_m.unwrap_or(0.0);
        Self {
            gain: match altitude_m {
                Some(_) => mission.relay_gain(own.power_w).value(),
                None => mission.receiver_gain(own.power_w),
            },
            climb_squared: square(climb),
            // The receiver is on the ground, so altitude alone separates relay N from it.
            least_step: match altitude_m {
                Some(_) => mission.least_step(square(climb)),
                None => 0.0,
            },
            end_m: mission.end_for(index, 0.0),
            to_rx: altitude_m.is_none(),
        }
    }

    /// Returns this hop without reserving a separation for the relays between `index` and Tx.
    pub(super) fn to_the_end(self, mission: &Mission, index: u16) -> Self {
        Self {
            end_m: mission.end_freely(index),
            ..self
        }
    }

    /// Returns the receiver's smallest x, m, that leaves the sender its minimum step.
    fn nearest(&self) -> f32 {
        let place = self.end_m + self.least_step;
        if place - self.end_m < self.least_step {
            place.next_up()
        } else {
            place
        }
    }

    /// Returns the x closest to Tx in [end, `from_m`] from which the sender meets `target`. `None` if there is none.
    ///
    /// `target` is a linear SIR above zero, `from_m` the receiver's x in [0, D], m. `quiet` is Upsilon = E[1/I] there
    /// over the field's largest, above 0, or 1 at Rx. The result is rounded toward the receiver. Constant work.
    pub fn reach(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
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

    /// Returns the hop for `target` that starts closest to Tx, for a receiver from `low` to `high`, m. `None`
    /// if there is none.
    pub fn longest(
        &self,
        interference: HopInterference<'_>,
        target: f32,
        low: f32,
        high: f32,
    ) -> Option<Step> {
        let low = low.max(self.nearest());
        let squares = [
            self.climb_squared,
            self.climb_squared + square(self.least_step),
        ];
        let value = |y, quiet| self.reach(target, y, quiet);
        least(interference, self.gain / target, squares, low, high, value)
    }
}

/// Hop along the line: the x of its receiver and the x of its sender.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// x of the hop's receiver, m.
    pub to_m: f32,
    /// x of the hop's sender, m.
    pub from_m: f32,
}

/// Interference at the receiver of a hop, as a function of the receiver's position.
#[derive(Clone, Copy, Debug)]
pub enum HopInterference<'a> {
    /// Same at every position: the receiver's measured Upsilon = E[1/I] over the field's largest.
    Evenly(f32),
    /// Interference field of the mission, with receiver noise.
    In(InNoise<'a>),
}

impl<'a> HopInterference<'a> {
    /// Returns the interference as the receiver measured it: Upsilon = E[1/I], 1/W. For `None` it is that of the
    /// mission's field. Both include the receiver noise.
    pub fn new(mission: &'a Mission, measured_per_w: Option<f32>) -> Self {
        match (mission.heard(), measured_per_w) {
            (Some(field), Some(upsilon)) => Self::Evenly(upsilon / field.largest()),
            (Some(field), None) => Self::In(field),
            (None, _) => Self::Evenly(1.0),
        }
    }

    /// Returns the ratio of Upsilon = E[1/I] at `x_m` to the field's largest.
    pub fn quiet(self, x_m: f32) -> f32 {
        match self {
            Self::Evenly(quiet) => quiet,
            Self::In(field) => field.upsilon(x_m) / field.largest(),
        }
    }
}

/// Returns the hop whose sender's x is smallest, for a receiver's x in [`low`, `high`], m. Of equal ones it has the
/// smallest receiver's x.
///
/// `value` returns the sender's x for the receiver's x, y, and `quiet`, the ratio of Upsilon = E[1/I] at y to the
/// field's largest. It is y - sqrt(`c` quiet - q) with q the first of `squares`, or `None` if the square under the
/// root is below the second minus the first. Work: at most three values for each field point in between that a hop
/// could reach.
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
        // To start closer to Tx than the best, a hop would have to be longer than possible here.
        if let Some(best) = best
            && left.x_m > best.from_m
            && square(left.x_m - best.from_m) + apart > c * start.max(end)
        {
            continue;
        }
        let slope = (end - start) / (right.x_m - left.x_m);
        // The points at which the root is c slope / 2, and at which it is just long enough to count.
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
