//! One relay at a given altitude: the paper's Corollary 1 and Theorem 1, for an interferer anywhere.
//!
//! SIR_2 rises with x. For X > 0 SIR_1 falls to a minimum and rises beyond, so the worse one is maximal where they cross before
//! the minimum, or above Rx. With the interferer behind Tx (X < 0), which the paper omits, SIR_1 rises to a maximum and falls
//! beyond. Up to the maximum both rise, so the optimum is the maximum, the crossing beyond it, or above Rx.
//!
//! With noise SIR_1 finally falls: beyond its minimum it has a maximum, or it has neither. Up to the maximum both rise; beyond,
//! the optimum is the maximum, the crossing, or above Rx.
//!
//! The crossing is a root of the paper's quartic. Its coefficients cancel in f32, but the SIRs themselves do not, so the root is
//! found by bisection of an interval on which their difference changes its sign once.
//!
//! Accuracy: `theorem_1_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::{Found, Two};
use crate::mission::{Mission, Profile};
use crate::sir::{Extremum, first_hop_turn};

/// Case of the optimum; the first five are Corollary 1's, for X >= 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum PlaceCase {
    /// x = 0: the first hop is the worse one even right above Tx, p_t / p_u < C_1.
    AboveTx = 1,
    /// x of the only crossing: SIR_1 falls over the relevant range and crosses SIR_2 once.
    Crossing = 2,
    /// x = D: the first hop is the better one wherever SIR_1 does not rise.
    AboveRx = 3,
    /// x of the crossing before the minimum of SIR_1, or D if SIR_1 has recovered by then.
    BeforeValley = 4,
    /// x = D: the first hop is the better one even at the minimum of SIR_1.
    OverValley = 5,
    /// x of the maximum of SIR_1, for X < 0: the first hop is the worse one even there.
    Hilltop = 6,
    /// x of the crossing beyond the maximum of SIR_1, for X < 0.
    BeyondHill = 7,
    /// x = D, for X < 0: the first hop is the better one even above Rx, or SIR_1 rises over the whole range.
    HillAboveRx = 8,
    /// x = D: the interferer is at Tx (X = Y = 0), so SIR_1 is constant.
    Level = 9,
    /// x = D: the interferer is at Rx (X = D, Y = 0), so SIR_2 is 0 everywhere.
    Drowned = 10,
    /// Maximum that follows the minimum of SIR_1, or the crossing beyond it; with noise.
    SecondHill = 11,
}

impl PlaceCase {
    /// Number of the case in Corollary 1, 1 to 5; 0 for cases that it omits.
    pub const fn printed(self) -> u8 {
        let number = self as u8;
        if number <= Self::OverValley as u8 {
            number
        } else {
            0
        }
    }
}

/// Returns the optimal position of a relay with `profile` between Tx and Rx, and its case; `None` in a field.
///
/// Valid for any valid mission. Work: at most 90 evaluations of both hops, and with noise 230 more.
pub fn best_place(mission: &Mission, profile: Profile) -> Option<(Found, PlaceCase)> {
    let interferer = mission.interferer()?;
    let two = Two { mission, profile };
    let end_m = mission.config().distance_m;
    let above_rx = two.found(end_m);
    if !(two.second(end_m) > 0.0) {
        return Some((above_rx, PlaceCase::Drowned));
    }
    let worse_first = |x_m: f32| two.first(x_m) <= two.second(x_m);
    // End of the falling part of SIR_1, and true if it rises again before Rx.
    let turn = first_hop_turn(mission, interferer, profile.altitude_m);
    let (to, valley) = match turn {
        Extremum::Level => return Some((above_rx, PlaceCase::Level)),
        Extremum::Hill(peak) => {
            return Some(if peak >= end_m || !worse_first(end_m) {
                (above_rx, PlaceCase::HillAboveRx)
            } else if worse_first(peak) {
                (two.found(peak), PlaceCase::Hilltop)
            } else {
                (two.crossing(peak, end_m), PlaceCase::BeyondHill)
            });
        }
        Extremum::Valley(bottom) | Extremum::ValleyAndHill(bottom, _) if bottom < end_m => {
            (bottom, true)
        }
        _ => (end_m, false),
    };
    if two.first(0.0) < two.second(0.0) {
        return Some((two.found(0.0), PlaceCase::AboveTx));
    }
    let second = second_hill(two, turn, end_m);
    let first = match (worse_first(to), valley) {
        (true, false) => (two.crossing(0.0, to), PlaceCase::Crossing),
        (true, true) => (two.crossing(0.0, to).or(above_rx), PlaceCase::BeforeValley),
        (false, false) => (above_rx, PlaceCase::AboveRx),
        (false, true) => (above_rx, PlaceCase::OverValley),
    };
    Some(match second {
        Some(second) if second.sir > first.0.sir => (second, PlaceCase::SecondHill),
        _ => first,
    })
}

/// Returns the best position at or beyond the maximum that follows the minimum of SIR_1, if that is before `end_m`.
fn second_hill(two: Two<'_>, turn: Extremum, end_m: f32) -> Option<Found> {
    let Extremum::ValleyAndHill(_, hill) = turn else {
        return None;
    };
    let worse_first = |x_m: f32| two.first(x_m) <= two.second(x_m);
    if !(hill < end_m) {
        return None;
    }
    Some(if worse_first(hill) {
        two.found(hill)
    } else if worse_first(end_m) {
        two.crossing(hill, end_m)
    } else {
        two.found(end_m)
    })
}
