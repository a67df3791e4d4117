//! Single relay between Tx and Rx: the position that maximises the worse SIR of its two hops.
//!
//! | fixed | file | source |
//! | --- | --- | --- |
//! | altitude, one interferer | [`theorems`] | Corollary 1, Theorem 1 |
//! | x, one interferer | [`theorems`] | Theorem 2 |
//! | nothing, one interferer | [`theorems`] | Theorem 3, as corrected |
//! | nothing, with lateral room, one interferer | [`aside`] | not in the paper |
//! | altitude, a field of interference | [`without_interferer`] | Algorithm 3, as corrected |
//! | altitude, noise only | [`without_interferer`] | the paper's special case without interference |
//!
//! They use the locus of equal SIRs ([`theorems::equal_altitudes`], Lemma 1) and the extrema of the first hop's SIR
//! ([`extrema::first_hop_turn`], Lemma 2). [`theorems::power_ratios`] has C_1, C_2 and C_3, the power ratios at which
//! the cases change. SIR_2 always rises with x and falls with the altitude. With receiver noise SIR_1 may have one more
//! extremum, and the optimum of Theorem 3 may be inside the box (`edge`). All functions use the mission's noise, except
//! [`without_interferer::best_in_noise`], which has a noise argument.

pub mod aside;
mod edge;
pub mod extrema;
pub mod theorems;
pub mod without_interferer;

use uav_relay::sir::{self, Sender};
use uav_relay::{Mission, Placement, Profile};

/// Number of bisection steps for the x of equal SIRs. The result is exact to a step of an f32.
const HALVINGS: u8 = 40;

/// Position of a single relay, and the SIR of the worse of its two hops, linear.
///
/// If the interference is known as a distribution along the line Tx-Rx, the SIR is a mean.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Found {
    /// Position of the single relay.
    pub place: Placement,
    /// SIR of the worse hop, linear: the smaller of SIR_1 (hop from Tx) and SIR_2 (hop to Rx).
    pub sir: f32,
}

impl Found {
    /// Returns the one of `self` and `other` with the higher SIR; `self` if both are equal.
    fn or(self, other: Self) -> Self {
        if other.sir > self.sir { other } else { self }
    }
}

/// SIRs of both hops of a single relay, for any position of that relay.
#[derive(Clone, Copy)]
struct TwoHops<'a> {
    mission: &'a Mission,
    power_w: f32,
}

impl TwoHops<'_> {
    fn both(&self, at: Placement) -> (f32, f32) {
        let first = Sender::transmitter(self.mission).sir_at(self.mission, 0.0, at);
        (first, sir::at_receiver(self.mission, at, self.power_w))
    }

    fn found(&self, place: Placement) -> Found {
        let (first, second) = self.both(place);
        Found {
            place,
            sir: first.min(second),
        }
    }

    /// Returns the position on a straight line at which both hops have the same SIR.
    ///
    /// Bisection of the line's varying coordinate from `low` to `high`, m: `is_low` returns true if a value is too
    /// small, and `place` returns the position for a value. The result is the better of the last two values.
    fn crossing(
        &self,
        low: f32,
        high: f32,
        is_low: impl Fn(f32) -> bool,
        place: impl Fn(f32) -> Placement,
    ) -> Found {
        let (mut low, mut high) = (low, high);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if !(middle > low && middle < high) {
                break;
            }
            if is_low(middle) {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.found(place(low)).or(self.found(place(high)))
    }
}

/// SIRs of both hops of a single relay at one altitude, with y = 0.
#[derive(Clone, Copy)]
struct Two<'a> {
    hops: TwoHops<'a>,
    altitude_m: f32,
}

impl<'a> Two<'a> {
    const fn new(mission: &'a Mission, profile: Profile) -> Self {
        let power_w = profile.power_w;
        Self {
            hops: TwoHops { mission, power_w },
            altitude_m: profile.altitude_m,
        }
    }

    fn at(&self, x_m: f32) -> Placement {
        Placement::on_line(x_m, self.altitude_m)
    }

    fn first(&self, x_m: f32) -> f32 {
        let mission = self.hops.mission;
        Sender::transmitter(mission).sir_at(mission, 0.0, self.at(x_m))
    }

    fn second(&self, x_m: f32) -> f32 {
        sir::at_receiver(self.hops.mission, self.at(x_m), self.hops.power_w)
    }

    fn found(&self, x_m: f32) -> Found {
        self.hops.found(self.at(x_m))
    }

    /// Returns true if the first hop's SIR is at most the second hop's SIR at `x_m`.
    fn is_first_worse(&self, x_m: f32) -> bool {
        self.first(x_m) <= self.second(x_m)
    }

    /// Returns the position at which the first hop's SIR falls below the second hop's SIR.
    ///
    /// Its x is from `low` to `high`, m.
    fn crossing(&self, low: f32, high: f32) -> Found {
        let is_low = |x_m| self.first(x_m) > self.second(x_m);
        self.hops.crossing(low, high, is_low, |x_m| self.at(x_m))
    }
}
