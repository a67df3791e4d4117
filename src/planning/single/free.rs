//! One relay that may choose both: the paper's Theorem 3, corrected.
//!
//! The best place lies on the edge of the box [0, D] x band. At a place inside, SIR_1 and SIR_2 would have to be equal, with
//! slopes that point in opposite directions, since neither has a stationary point there: the lines of equal SIR of both would
//! touch. But those of SIR_1 are circles about points of the ground, and those of SIR_2 about Rx: such circles touch on the
//! ground alone. Two of the printed cases miss this, and are wrong (by a factor of 17 in the first counterexample of the
//! tests).
//!
//! On the edges Theorems 1 and 2 are exact, and the best of them is the optimum. Right above Tx both SIRs fall with the altitude,
//! so of that edge only the lowest place counts, which is on the lowest edge too: three are left.
//!
//! With noise the lines of equal SIR_1 are no circles, and there is one place inside at which they may touch: `touching`.
//!
//! Accuracy: `theorem_3_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::edge::TwoHops;
use super::{Found, given_altitude, given_x, touching};
use crate::mission::{Mission, Profile};

/// On which edge of the box the best place lies, or that it is inside, and which case applied there. On a corner it is the first of them.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FreeCase {
    /// At the lowest altitude, by Theorem 1.
    Lowest(given_altitude::PlaceCase),
    /// At the highest altitude, by Theorem 1.
    Highest(given_altitude::PlaceCase),
    /// Right above Rx, by Theorem 2.
    AboveRx(given_x::AltitudeCase),
    /// With noise: inside the box, where the lines of equal SIR of both hops touch.
    Touching,
}

/// Where a relay of `power_w` watts does best in [0, D] and the mission's band, and why; `None` in a field.
///
/// Work: at most 190 evaluations of both hops and one of Lemma 1.
pub fn best_place(mission: &Mission, power_w: f32) -> Option<(Found, FreeCase)> {
    let config = mission.config();
    let level = |altitude_m: f32| {
        let profile = Profile {
            altitude_m,
            power_w,
        };
        given_altitude::best_place(mission, profile)
    };
    let (found, case) = level(config.band.least_m)?;
    let mut best = (found, FreeCase::Lowest(case));
    let mut weigh = |found: Found, case: FreeCase| {
        if found.sir > best.0.sir {
            best = (found, case);
        }
    };
    let (found, case) = level(config.band.most_m)?;
    weigh(found, FreeCase::Highest(case));
    let (found, case) = given_x::best_place(mission, config.distance_m, power_w)?;
    weigh(found, FreeCase::AboveRx(case));
    let hops = TwoHops { mission, power_w };
    if let Some(found) = touching::inside(&hops, mission.interferer()?, 0.0, config.band) {
        weigh(found, FreeCase::Touching);
    }
    Some(best)
}
