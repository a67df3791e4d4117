//! One relay at a given place along x: the paper's Theorem 2, for an interferer anywhere.
//!
//! SIR_2 falls with the altitude. SIR_1 = A (a + h^2) / (b + h^2) with a = (x - X)^2 + Y^2 and b = x^2 falls too, unless x lies
//! beyond the paper's Psi^h = (X^2 + Y^2) / 2X, which needs X > 0: there it rises, and the worse of the two is best where they
//! are equal (Lemma 1), or at an end of the band.
//!
//! With noise SIR_1 = A (a + h^2) / ((b + h^2)(1 + nu (a + h^2))) rises only as long as nu (a + h^2)^2 < b - a, and falls from there on,
//! as SIR_2 does: nothing higher is any better, and below it all is as without noise.
//!
//! Accuracy: `theorem_2_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.

use super::{Found, Two, locus};
use crate::mission::{Band, Interferer, Mission, Profile};
use crate::root::sqrt;
use crate::sir::square;

/// Which case applied; the first three are Theorem 2's.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum AltitudeCase {
    /// Both SIRs fall with the altitude (x <= Psi^h, or X <= 0): the lowest.
    BothFall = 1,
    /// SIR_1 rises with the altitude, and is equal to SIR_2 within the band: there.
    Crossing = 2,
    /// SIR_1 rises with the altitude, but the SIRs are equal nowhere in the band: one of its ends.
    End = 3,
    /// The interferer stands at Rx (X = D, Y = 0), and no altitude helps: SIR_2 is 0; the lowest.
    Drowned = 4,
}

impl AltitudeCase {
    /// The number that Theorem 2 has for it, 1 to 3; 0 for the case that it leaves out.
    pub const fn printed(self) -> u8 {
        match self {
            Self::Drowned => 0,
            other => other as u8,
        }
    }
}

/// The altitude in the mission's band at which a relay of `power_w` watts at `x_m`, m in [0, D], does best, and why.
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
    // Below it SIR_1 is the smaller, above it SIR_2: the larger root, but for one beyond where SIR_1 falls.
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

/// Whether SIR_1 rises with the altitude from the bottom of `band` on, and up to where in it.
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
