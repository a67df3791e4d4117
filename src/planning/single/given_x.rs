//! One relay at a given x: the paper's Theorem 2, for an interferer anywhere.
//!
//! SIR_2 falls with the altitude. SIR_1 = A (a + h^2) / (b + h^2) with a = (x - X)^2 + Y^2 and b = x^2 falls too, unless X > 0
//! and x is beyond the paper's Psi^h = (X^2 + Y^2) / 2X. There it rises, and the worse one is maximal where they are equal (Lemma
//! 1), or at an end of the band.
//!
//! With noise SIR_1 = A (a + h^2) / ((b + h^2)(1 + nu (a + h^2))) rises only while nu (a + h^2)^2 < b - a, and falls above that,
//! as SIR_2 does. So no higher altitude is better, and below it everything is as without noise.
//!
//! Accuracy: `theorem_2_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::{Found, Two, locus};
use crate::mission::{Band, Interferer, Mission, Profile};
use crate::root::sqrt;
use crate::sir::square;

/// Case of the optimum; the first three are Theorem 2's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum AltitudeCase {
    /// Lowest altitude: both SIRs fall with the altitude (x <= Psi^h, or X <= 0).
    BothFall = 1,
    /// Altitude within the band at which SIR_1, which rises with the altitude, equals SIR_2.
    Crossing = 2,
    /// End of the band: SIR_1 rises with the altitude, but equals SIR_2 nowhere in the band.
    End = 3,
    /// Lowest altitude: the interferer is at Rx (X = D, Y = 0), so SIR_2 is 0 everywhere.
    Drowned = 4,
}

impl AltitudeCase {
    /// Number of the case in Theorem 2, 1 to 3; 0 for the case that it omits.
    pub const fn printed(self) -> u8 {
        match self {
            Self::Drowned => 0,
            other => other as u8,
        }
    }
}

/// Returns the optimal altitude in the mission's band for a relay of `power_w` watts at `x_m`, m in [0, D], and its case.
///
/// `None` in a field, and for `x_m` outside [0, D]. Work: at most six evaluations of both hops and one of Lemma 1.
pub fn best_place(mission: &Mission, x_m: f32, power_w: f32) -> Option<(Found, AltitudeCase)> {
    let interferer = mission.interferer()?;
    if !(0.0..=mission.config().distance_m).contains(&x_m) {
        return None;
    }
    let band = mission.config().band;
    let at = |altitude_m: f32| Two {
        mission,
        profile: Profile {
            altitude_m,
            power_w,
        },
    };
    let (rises, top_m) = rising(mission, interferer, x_m, band);
    let (lowest, highest) = (at(band.least_m), at(top_m));
    let low = lowest.found(x_m);
    if !(lowest.second(x_m) > 0.0) {
        return Some((low, AltitudeCase::Drowned));
    }
    if !rises {
        return Some((low, AltitudeCase::BothFall));
    }
    if lowest.first(x_m) > lowest.second(x_m) || highest.first(x_m) < highest.second(x_m) {
        return Some((low.or(highest.found(x_m)), AltitudeCase::End));
    }
    // SIR_1 is smaller below the crossing, SIR_2 above: it is the larger root, unless that is where SIR_1 falls.
    let [lower, upper] = locus::altitudes(mission, x_m, power_w);
    let crossing = upper
        .filter(|upper| !(*upper > top_m && mission.noise_at_a_metre() > 0.0))
        .or(lower);
    let altitude_m = crossing
        .unwrap_or(band.least_m)
        .max(band.least_m)
        .min(top_m);
    Some((at(altitude_m).found(x_m), AltitudeCase::Crossing))
}

/// Returns true if SIR_1 rises with the altitude from the bottom of `band`, and the altitude up to which it rises.
fn rising(mission: &Mission, interferer: &Interferer, x_m: f32, band: Band) -> (bool, f32) {
    let ahead = 2.0 * interferer.x_m * x_m - square(interferer.x_m) - square(interferer.y_m);
    let noise = mission.noise_at_a_metre();
    if !(noise > 0.0 && ahead > 0.0) {
        let rises = 2.0 * interferer.x_m * x_m > square(interferer.x_m) + square(interferer.y_m);
        return (rises, band.most_m);
    }
    let a = square(x_m - interferer.x_m) + square(interferer.y_m);
    let top_m = sqrt(sqrt(ahead / noise) - a).min(band.most_m);
    (top_m > band.least_m, top_m.max(band.least_m))
}
