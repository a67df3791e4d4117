//! How far from its receiver the sender of a hop may stand in a field: Algorithm 4's way back from Rx, in closed form.
//!
//! Where the node that hears a hop stands is known, and with it the Upsilon it hears through. With that node at (x0, h0),
//! its sender at (x0 - d, h) and A = p Upsilon(x0) / `mu_los` for a sender of p watts, E(SIR) >= gamma is
//!
//! ```text
//! d^2 <= A / gamma - (h - h0)^2
//! ```
//!
//! the paper's eq. (num), with relays that differ in altitude. For the last hop x0 = D, h0 = 0 and A = p Upsilon(D) / eta.
//! The printed algorithm lets a place become negative; here a sender stops where there is just room for those before it.
//!
//! That node need not stand as near to Tx as it may: where it hears less of the interference the hop may be longer. The places
//! from which a relay can be continued to Rx are a range [l, r], and the next range begins at
//!
//! ```text
//! l_k = min { y - d(y) : l_{k+1} <= y <= r_{k+1} }.
//! ```
//!
//! Between two points of the field d(y)^2 = c Upsilon(y) - q with q = (h - h0)^2 is linear in y, so y - d(y) is convex where it
//! is defined, and its least value is at an end, where d falls to the least step, or where d'(y) = 1: d = c b / 2 with b the
//! slope of Upsilon. `the_best_of_equals_in_a_field` in `host-tests/tests/fleet/` holds it against grids of places.
//! Where a least separation or a climb makes some y useless the ranges may have holes, and l_k is a bound.
//!
//! Accuracy: `retreats_agree_with_the_reference` in `host-tests/tests/stochastic.rs` asserts it in f64.

use crate::field::{FieldPoint, InNoise};
use crate::mission::Mission;
use crate::place::Station;
use crate::root::sqrt;
use crate::sir::square;

/// One hop, from where it is heard: ready to be evaluated for many targets.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Retreat {
    /// A of the module's text without its Upsilon, for the hop to Rx with it.
    gain: f32,
    /// (h - h0)^2, m^2.
    climb_squared: f32,
    /// The least step to the sender, m.
    least_step: f32,
    /// The first place the sender may take, m.
    end_m: f32,
    /// Whether it is Rx that hears it.
    to_rx: bool,
}

impl Retreat {
    /// The hop that relay `index`, `own`, feeds to a relay at `altitude_m`; `None` for the one to Rx.
    pub fn new(mission: &Mission, own: Station, index: u16, altitude_m: Option<f32>) -> Self {
        let climb = own.at.altitude_m - altitude_m.unwrap_or(0.0);
        Self {
            gain: match altitude_m {
                Some(_) => mission.relay_gain(own.power_w).value(),
                None => mission.receiver_gain(own.power_w),
            },
            climb_squared: square(climb),
            // The receiver stands on the ground: its altitude alone keeps relay N clear of it.
            least_step: match altitude_m {
                Some(_) => mission.least_step(square(climb)),
                None => 0.0,
            },
            end_m: mission.end_for(index, 0.0),
            to_rx: altitude_m.is_none(),
        }
    }

    /// The same hop of relay `index` where those before it hold back to leave themselves room rather than this one.
    pub(super) fn to_the_end(self, mission: &Mission, index: u16) -> Self {
        Self {
            end_m: mission.end_freely(index),
            ..self
        }
    }

    /// The place nearest to Tx at which its receiver leaves the sender room, m.
    fn nearest(&self) -> f32 {
        let place = self.end_m + self.least_step;
        if place - self.end_m < self.least_step {
            place.next_up()
        } else {
            place
        }
    }

    /// The place nearest to Tx in [end, `from_m`] from which the sender still meets `target`; `None` if there is none.
    ///
    /// `target` is a linear SIR above zero, `from_m` the receiver's place in [0, D], `quiet` what it hears through: Upsilon
    /// there over the field's largest, above 0, or 1 at Rx. The place is rounded toward the receiver. Constant work.
    pub fn reach(&self, target: f32, from_m: f32, quiet: f32) -> Option<f32> {
        let room = from_m - self.end_m;
        if room < self.least_step {
            return None;
        }
        // Cut at 1e9 m, far beyond any end: of infinity there is no root.
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
        // Two relays never share a place, however short the hop.
        (place < from_m || self.to_rx).then_some(place)
    }

    /// The hop that begins nearest to Tx of all into [`low`, `high`]; `None` if there is none.
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

/// A hop: where it ends, and where it begins.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Step {
    /// Where it is heard, m.
    pub to_m: f32,
    /// Where its sender stands, m.
    pub from_m: f32,
}

/// The interference that a hop may meet, place by place.
#[derive(Clone, Copy, Debug)]
pub enum HopInterference<'a> {
    /// The same Upsilon everywhere, over the field's largest: what its receiver measures.
    Evenly(f32),
    /// The agreed field.
    In(InNoise<'a>),
}

impl<'a> HopInterference<'a> {
    /// The mission's field with the noise, or what the receiver measures instead, 1/W: that has its noise in it.
    pub fn new(mission: &'a Mission, measured_per_w: Option<f32>) -> Self {
        match (mission.heard(), measured_per_w) {
            (Some(field), Some(upsilon)) => Self::Evenly(upsilon / field.largest()),
            (Some(field), None) => Self::In(field),
            (None, _) => Self::Evenly(1.0),
        }
    }

    /// Upsilon at `x_m` over the field's largest.
    pub fn quiet(self, x_m: f32) -> f32 {
        match self {
            Self::Evenly(quiet) => quiet,
            Self::In(field) => field.upsilon(x_m) / field.largest(),
        }
    }
}

/// The least `value` of a place y in [`low`, `high`] and its quiet, where it is y - sqrt(`c` quiet - q), or `None` where the
/// root is of less than the second of `squares`, of which q is the first. Of equal ones the one nearest to Tx.
///
/// Work: at most three values for each point of the field in between that a hop could reach at all.
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
        // To begin nearer to Tx than the best, a hop would have to be longer than any here can be.
        if let Some(best) = best
            && left.x_m > best.from_m
            && square(left.x_m - best.from_m) + apart > c * start.max(end)
        {
            continue;
        }
        let slope = (end - start) / (right.x_m - left.x_m);
        // Where the root is c slope / 2 long, and where it is just long enough to count.
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
