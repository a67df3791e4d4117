//! One relay at a given altitude: the paper's Corollary 1 and Theorem 1, for an interferer anywhere.
//!
//! SIR_2 rises with x. SIR_1 falls up to its valley and rises beyond (X > 0), so the worse of the two is best where they cross
//! before the valley, or above Rx. With the interferer behind Tx (X < 0), which the paper leaves out, SIR_1 rises up to a hill
//! and falls beyond: up to the hill both rise, so the best place is the hilltop, the crossing beyond it, or above Rx.
//!
//! With noise SIR_1 falls for good in the end: beyond its valley it has a hill, or neither. Up to the hill both rise; beyond it the best
//! is the hilltop, the crossing, or above Rx.
//!
//! The crossing is a root of the paper's quartic. Its coefficients cancel in f32; the SIRs themselves do not, so the root is
//! found by halving a stretch on which their difference changes its sign once.
//!
//! Accuracy: `theorem_1_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::{Found, Two};
use crate::mission::{Mission, Profile};
use crate::sir::{Extremum, first_hop_turn};

/// Which case applied; the first five are Corollary 1's, for X >= 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum PlaceCase {
    /// The first hop is the worse one even right above Tx, p_t / p_u < C_1: x = 0.
    AboveTx = 1,
    /// SIR_1 falls all the way that counts and crosses SIR_2 once: x is there.
    Crossing = 2,
    /// The first hop is the better one wherever it is not rising: x = D.
    AboveRx = 3,
    /// The SIRs cross before the valley of SIR_1: x is there, or D if SIR_1 has recovered by then.
    BeforeValley = 4,
    /// The first hop is the better one even in its valley: x = D.
    OverValley = 5,
    /// X < 0, and SIR_1 is the worse one even where it is best, on its hill: x is there.
    Hilltop = 6,
    /// X < 0, and the SIRs cross beyond the hill of SIR_1: x is there.
    BeyondHill = 7,
    /// X < 0, and the first hop is the better one even above Rx, or rises all the way: x = D.
    HillAboveRx = 8,
    /// The interferer stands at Tx (X = Y = 0), SIR_1 is the same everywhere: x = D.
    Level = 9,
    /// The interferer stands at Rx (X = D, Y = 0), and no place helps: SIR_2 is 0; x = D.
    Drowned = 10,
    /// With noise: the best is beyond the valley of SIR_1, on the hill that follows it, or where the SIRs cross beyond that.
    SecondHill = 11,
}

impl PlaceCase {
    /// The number that Corollary 1 has for it, 1 to 5; 0 for the cases that it leaves out.
    pub const fn printed(self) -> u8 {
        let number = self as u8;
        if number <= Self::OverValley as u8 {
            number
        } else {
            0
        }
    }
}

/// Where a relay that holds `profile` does best between Tx and Rx, and why; `None` in a field.
///
/// Any place of the interferer, any D and altitude that a mission takes. Work: at most 90 evaluations of both hops, and with noise 230 more.
pub fn best_place(mission: &Mission, profile: Profile) -> Option<(Found, PlaceCase)> {
    let interferer = mission.interferer()?;
    let two = Two { mission, profile };
    let end_m = mission.config().distance_m;
    let above_rx = two.found(end_m);
    if !(two.second(end_m) > 0.0) {
        return Some((above_rx, PlaceCase::Drowned));
    }
    let worse_first = |x_m: f32| two.first(x_m) <= two.second(x_m);
    // How far SIR_1 falls, and whether it rises again before Rx.
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

/// The best on the hill that follows the valley of SIR_1, or beyond it, if that is before `end_m`.
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
