//! One relay with free x and altitude: the paper's Theorem 3, corrected.
//!
//! The optimum is on the edge of the box [0, D] x band. Inside, SIR_1 and SIR_2 would have to be equal with opposite slopes,
//! since neither has a stationary point there: their level lines would touch. But those of SIR_1 are circles about ground points,
//! and those of SIR_2 circles about Rx, and such circles touch on the ground only. Two of the printed cases miss this, and are
//! wrong (by a factor of 17 in the first counterexample of the tests).
//!
//! On the edges Theorems 1 and 2 are exact, and the best of the edges is the optimum. Right above Tx both SIRs fall with the
//! altitude, so only the lowest position of that edge counts, which is on the lowest edge too: three edges are left.
//!
//! With noise the level lines of SIR_1 are no circles, and there is one position inside at which they may touch: `touching`.
//!
//! Accuracy: `theorem_3_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::edge::TwoHops;
use super::{Found, given_altitude, given_x, touching};
use crate::mission::{Mission, Profile};

/// Edge of the optimum with its case there, or the inside; on a corner the first edge.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FreeCase {
    /// Lowest altitude, by Theorem 1.
    Lowest(given_altitude::PlaceCase),
    /// Highest altitude, by Theorem 1.
    Highest(given_altitude::PlaceCase),
    /// Above Rx, by Theorem 2.
    AboveRx(given_x::AltitudeCase),
    /// Touching position of the level lines of both SIRs inside the box, with noise.
    Touching,
}

/// Returns the optimal position of a relay of `power_w` watts in [0, D] and the mission's band, and its case; `None` in a field.
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
