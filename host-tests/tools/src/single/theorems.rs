//! Single relay with y = 0, and one interferer anywhere: Lemma 1, Corollary 1, and Theorems 1 to 3.
//!
//! # Given altitude: Corollary 1 and Theorem 1
//!
//! [`best_at_altitude`] has the optimum.
//!
//! SIR_2 rises with x. For X > 0 SIR_1 falls to a minimum and rises beyond. The worse SIR is therefore largest where
//! they cross before the minimum, or above Rx. The paper omits an interferer behind Tx (X < 0). SIR_1 then rises to a
//! maximum and falls beyond. Up to the maximum both rise, so the optimum is the maximum, the crossing beyond it, or
//! above Rx.
//!
//! With noise SIR_1 falls at last: it has a minimum and then a maximum, or neither. Between minimum and maximum both
//! rise. So beyond the minimum, the optimum is the maximum, the crossing after it, or above Rx.
//!
//! The crossing is a root of the paper's quartic. Its coefficients lose their digits in f32, but the SIRs do not. The
//! root is therefore found by bisection of an interval in which the difference of the SIRs changes its sign once.
//!
//! Accuracy: `theorem_1_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.
//!
//! # Given x: Theorem 2
//!
//! [`best_at_x`] has the optimum.
//!
//! SIR_2 falls with the altitude. SIR_1 = A (a + h^2) / (b + h^2) with a = (x - X)^2 + Y^2 and b = x^2 falls too,
//! unless X > 0 and x is beyond the paper's Psi^h = (X^2 + Y^2) / 2X. There it rises, and the worse SIR is largest
//! where they are equal (Lemma 1), or at an end of the permitted altitudes.
//!
//! With noise SIR_1 = A (a + h^2) / ((b + h^2)(1 + nu (a + h^2))) rises only while nu (a + h^2)^2 < b - a, and falls
//! above that altitude, as SIR_2 does. So no higher altitude is better. Below that altitude the solution is as without
//! noise.
//!
//! Accuracy: `theorem_2_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.
//!
//! # Free x and altitude: Theorem 3, corrected
//!
//! [`best_free`] has the optimum.
//!
//! The optimum is on an edge of the rectangle of allowed x and altitudes. Inside, SIR_1 and SIR_2 would have to be
//! equal with opposite slopes, since neither has a stationary point there. Their curves of constant SIR would touch.
//! But for SIR_1 these are circles about ground points, and for SIR_2 circles about Rx. Such circles touch on the
//! ground only. Two of the printed cases miss this, and are wrong (by a factor of 17 in the first counterexample of the
//! tests).
//!
//! On the edges Theorems 1 and 2 are exact, and the best of the edges is the optimum. Right above Tx both SIRs fall
//! with the altitude, so only the lowest position of that edge counts. It is also on the lowest edge, so three edges
//! are left.
//!
//! With noise the curves of constant SIR_1 are no circles. They may then touch those of SIR_2 at one position inside:
//! see `edge`.
//!
//! Accuracy: `theorem_3_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SIR.
//!
//! # Guide for the powers of Tx and relay
//!
//! [`power_ratios`] are the ratios p_t / p_u at which the cases of Corollary 1 change.
//!
//! SIR_1 / SIR_2 is proportional to p_t / p_u. With each ratio the two are equal at one position: above Tx (C_1), above
//! Rx (C_2), and at the minimum of SIR_1 (C_3). The paper prints them as formulas; here they are computed from the
//! SIRs.
//!
//! # Locus of equal SIR of both hops: Lemma 1
//!
//! [`equal_altitudes`] has the altitudes for an x.
//!
//! With u = h^2, a = (x - X)^2 + Y^2, b = x^2, c = (D - x)^2 and G = (p_u / p_t)(mu_nlos / eta)((X - D)^2 + Y^2), SIR_1 = SIR_2
//! is (a + u)(c + u) = G (b + u), or
//!
//! ```text
//! u^2 + (a + c - G) u + a c - G b = 0,
//! ```
//!
//! which is the paper's A u^2 + B u + C = 0 divided by A = p_t. With noise the denominator of SIR_1 has a factor 1 + nu (a + u),
//! K includes the noise at Rx, and
//!
//! ```text
//! (1 - G nu) u^2 + (a + c - G - G nu (a + b)) u + a c - G b - G nu a b = 0.
//! ```
//!
//! Computed in f64, and so exact to the last place of the f32 result. Accuracy: `the_locus_is_where_the_hops_are_equal` in
//! `host-tests/tests/theorems/`.

use uav_relay::root::sqrt;
use uav_relay::sir::square;
use uav_relay::{Band, Interferer, Mission, Profile};
use uav_relay_scenario::number::narrow;

use super::edge::{squared, touching_inside};
use super::extrema::{Extremum, first_hop_turn};
use super::{Found, Two, TwoHops};

/// Case of the optimal x at a given altitude.
///
/// The first five cases are the cases of the paper's Corollary 1, for an interferer at X >= 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum PlaceCase {
    /// Optimum above Tx: even there the first hop's SIR is lower than the second hop's.
    ///
    /// The ratio of the powers of Tx and relay is below C_1 ([`Guide::c1`]).
    AboveTx = 1,
    /// Optimum at the only x with the same SIR on both hops.
    ///
    /// The first hop's SIR falls all the way to Rx, and equals the second hop's SIR once.
    Crossing = 2,
    /// Optimum above Rx: the first hop's SIR falls all the way to Rx.
    ///
    /// Above Rx the first hop's SIR is still higher than the second hop's.
    AboveRx = 3,
    /// Optimum at an x with the same SIR on both hops, before the minimum of the first hop's SIR.
    ///
    /// The first hop's SIR rises again beyond its minimum. If the worse hop's SIR is higher above Rx than here, the
    /// optimum is above Rx instead.
    BeforeValley = 4,
    /// Optimum above Rx: the first hop's SIR has a minimum before Rx.
    ///
    /// At that minimum the first hop's SIR is still higher than the second hop's.
    OverValley = 5,
    /// Optimum at the maximum of the first hop's SIR. Even there it is lower than the second hop's SIR.
    ///
    /// The interferer is behind Tx.
    Hilltop = 6,
    /// Optimum at an x with the same SIR on both hops, beyond the maximum of the first hop's SIR.
    ///
    /// The interferer is behind Tx.
    BeyondHill = 7,
    /// Optimum above Rx, with the interferer behind Tx.
    ///
    /// The first hop's SIR rises all the way to Rx, or is still higher above Rx than the second hop's.
    HillAboveRx = 8,
    /// Optimum above Rx: the interferer is at Tx, so the first hop's SIR is the same at every x.
    Level = 9,
    /// Optimum above Rx: the interferer is at Rx, so the second hop's SIR is 0 everywhere.
    Drowned = 10,
    /// Optimum at or beyond the maximum that the first hop's SIR has after its minimum; only with noise.
    ///
    /// If the optimum is beyond this maximum, both hops have the same SIR there.
    SecondHill = 11,
}

impl PlaceCase {
    /// Number of the case in the paper's Corollary 1, 1 to 5; 0 for cases that the paper omits.
    pub const fn printed(self) -> u8 {
        let number = self as u8;
        if number <= Self::OverValley as u8 {
            number
        } else {
            0
        }
    }
}

/// Returns the optimal position of a relay with `profile` and y = 0, and its case.
///
/// The position is between Tx and Rx. `None` if the mission has no interferer. Work: at most 90 evaluations of both
/// hops, and with noise 230 more.
pub fn best_at_altitude(mission: &Mission, profile: Profile) -> Option<(Found, PlaceCase)> {
    let interferer = mission.interferer()?;
    let two = Two::new(mission, profile);
    let end_m = mission.config().distance_m;
    let above_rx = two.found(end_m);
    if !(two.second(end_m) > 0.0) {
        return Some((above_rx, PlaceCase::Drowned));
    }
    // End of the falling part of SIR_1, and true if SIR_1 rises again before Rx.
    let turn = first_hop_turn(mission, interferer, profile.altitude_m);
    let (to, valley) = match turn {
        Extremum::Level => return Some((above_rx, PlaceCase::Level)),
        Extremum::Hill(peak) => {
            return Some(if peak >= end_m || !two.is_first_worse(end_m) {
                (above_rx, PlaceCase::HillAboveRx)
            } else if two.is_first_worse(peak) {
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
    let first = match (two.is_first_worse(to), valley) {
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

/// Returns the best position at or beyond the maximum that the first hop's SIR has with noise.
///
/// Along x this SIR falls to a minimum, rises to the maximum, and falls again. `None` if there is no such maximum below
/// `end_m`.
fn second_hill(two: Two<'_>, turn: Extremum, end_m: f32) -> Option<Found> {
    let Extremum::ValleyAndHill(_, hill) = turn else {
        return None;
    };
    if !(hill < end_m) {
        return None;
    }
    Some(if two.is_first_worse(hill) {
        two.found(hill)
    } else if two.is_first_worse(end_m) {
        two.crossing(hill, end_m)
    } else {
        two.found(end_m)
    })
}

/// Case of the optimal altitude at a given x.
///
/// The first three cases are the cases of the paper's Theorem 2.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum AltitudeCase {
    /// Optimum at the lowest altitude: both hops' SIRs fall as the altitude rises.
    ///
    /// This is so if X <= 0, or if x <= (X^2 + Y^2) / 2X (the paper's Psi^h), with the interferer at (X, Y).
    BothFall = 1,
    /// Optimum at the altitude with the same SIR on both hops. The first hop's SIR rises with the altitude.
    Crossing = 2,
    /// Optimum at the lowest altitude, or at the altitude of the first hop's largest SIR.
    ///
    /// Between these two altitudes the SIRs of the two hops are equal nowhere.
    End = 3,
    /// Optimum at the lowest altitude: the interferer is at Rx, so the second hop's SIR is 0 everywhere.
    Drowned = 4,
}

impl AltitudeCase {
    /// Number of the case in the paper's Theorem 2, 1 to 3; 0 for the case that the paper omits.
    pub const fn printed(self) -> u8 {
        match self {
            Self::Drowned => 0,
            other => other as u8,
        }
    }
}

/// Returns the optimal position at `x_m` within the mission's altitudes, and its case.
///
/// The relay has `power_w` watts. `None` if the mission has no interferer, or if `x_m` is not from 0 (Tx) to D (Rx).
/// Work: at most six evaluations of both hops and one of Lemma 1.
pub fn best_at_x(mission: &Mission, x_m: f32, power_w: f32) -> Option<(Found, AltitudeCase)> {
    let interferer = mission.interferer()?;
    if !(0.0..=mission.config().distance_m).contains(&x_m) {
        return None;
    }
    let band = mission.config().band;
    let at = |altitude_m: f32| {
        let profile = Profile {
            altitude_m,
            power_w,
        };
        Two::new(mission, profile)
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
    // SIR_1 is smaller below the crossing, and SIR_2 above it. So the crossing is the larger root, unless SIR_1 falls
    // there.
    let [lower, upper] = equal_altitudes(mission, x_m, power_w);
    let crossing = upper
        .filter(|upper| !(*upper > top_m && mission.noise_at_a_metre() > 0.0))
        .or(lower);
    let altitude_m = crossing
        .unwrap_or(band.least_m)
        .max(band.least_m)
        .min(top_m);
    Some((at(altitude_m).found(x_m), AltitudeCase::Crossing))
}

/// Returns true if the first hop's SIR rises with the altitude at `x_m`, and the end of this rise, m.
///
/// The end is limited to the permitted range `band`.
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

/// Location of the optimum in the rectangle of allowed x and altitudes: an edge, or the inside.
///
/// An optimum at a corner counts for the edge that is first in this list.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FreeCase {
    /// Optimum at the lowest altitude, with this case of the optimal x (Theorem 1).
    Lowest(PlaceCase),
    /// Optimum at the highest altitude, with this case of the optimal x (Theorem 1).
    Highest(PlaceCase),
    /// Optimum above Rx, with this case of the optimal altitude (Theorem 2).
    AboveRx(AltitudeCase),
    /// Optimum inside the rectangle of x and altitude; only with noise.
    ///
    /// The curves of constant SIR of both hops touch there.
    Touching,
}

/// Returns the optimal x and altitude of a relay of `power_w` watts with y = 0, and its case.
///
/// x is between Tx and Rx, and the altitude in the mission's range. `None` if the mission has no interferer. Work: at
/// most 190 evaluations of both hops and one of Lemma 1.
pub fn best_free(mission: &Mission, power_w: f32) -> Option<(Found, FreeCase)> {
    let config = mission.config();
    let level = |altitude_m: f32| {
        let profile = Profile {
            altitude_m,
            power_w,
        };
        best_at_altitude(mission, profile)
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
    let (found, case) = best_at_x(mission, config.distance_m, power_w)?;
    weigh(found, FreeCase::AboveRx(case));
    let hops = TwoHops { mission, power_w };
    if let Some(found) = touching_inside(&hops, mission.interferer()?, 0.0, config.band) {
        weigh(found, FreeCase::Touching);
    }
    Some(best)
}

/// Limits of the power ratio p_t / p_u, linear, between the cases of the optimal x.
///
/// p_t and p_u are the powers of Tx and relay. The cases are those of the paper's Corollary 1.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Guide {
    /// Ratio C_1: below it, the first hop has a lower SIR than the second even vertically above Tx.
    ///
    /// C_1 is 0 if the interferer is at Rx.
    pub c1: f32,
    /// Ratio C_2: above it, the first hop has a higher SIR than the second even vertically above Rx.
    pub c2: f32,
    /// Ratio C_3: above it, the first hop has a higher SIR than the second even at the first hop's minimum.
    ///
    /// This minimum of the first hop's SIR along x is between Tx and Rx, or beyond Rx. `None` if there is no minimum,
    /// for example for an interferer at X <= 0. With noise the SIR has a minimum and then a maximum; C_3 belongs to the
    /// minimum.
    pub c3: Option<f32>,
}

/// Returns the power ratios C_1 to C_3 for a relay at `altitude_m`, m, above 0.
///
/// `None` if the mission has no interferer. Relative error below 1e-4: `the_guide_agrees_with_the_cases` in
/// `host-tests/tests/theorems/`. Constant work.
pub fn power_ratios(mission: &Mission, altitude_m: f32) -> Option<Guide> {
    let interferer = mission.interferer()?;
    let config = mission.config();
    let profile = Profile {
        altitude_m,
        power_w: config.common.power_w,
    };
    let two = Two::new(mission, profile);
    let present = config.tx_power_w / profile.power_w;
    let equal_at = |x_m: f32| present * (two.second(x_m) / two.first(x_m));
    Some(Guide {
        c1: equal_at(0.0),
        c2: equal_at(config.distance_m),
        c3: match first_hop_turn(mission, interferer, altitude_m) {
            Extremum::Valley(bottom) | Extremum::ValleyAndHill(bottom, _) if bottom < 1e18 => {
                Some(equal_at(bottom))
            }
            _ => None,
        },
    })
}

/// Returns the altitudes at which both hops have the same SIR, m: the paper's h^- and h^+.
///
/// The lower altitude is first; both are above 0. The relay has `power_w` watts and is at `x_m`. The mission's ranges
/// limit neither `power_w` nor `x_m` nor the altitudes. An altitude that does not exist is `None`; without an
/// interferer both are `None`. Constant work.
pub fn equal_altitudes(mission: &Mission, x_m: f32, power_w: f32) -> [Option<f32>; 2] {
    let Some(interferer) = mission.interferer() else {
        return [None; 2];
    };
    let wide = |x: f32| f64::from(x);
    let x = wide(x_m);
    let a = squared(x - wide(interferer.x_m)) + squared(wide(interferer.y_m));
    let b = squared(x);
    let c = squared(wide(mission.config().distance_m) - x);
    let g = mission.last_to_first(power_w);
    let lost = g * wide(mission.noise_at_a_metre());
    let half = 0.5 * (a + c - g - lost * (a + b));
    let (square, product) = (1.0 - lost, a * c - g * b - lost * a * b);
    let discriminant = half * half - square * product;
    if discriminant < 0.0 {
        return [None; 2];
    }
    // The larger root first, the other from the product of both: neither loses digits.
    let far = -(half + libm::copysign(libm::sqrt(discriminant), half));
    let near = if libm::fabs(far) > 0.0 {
        product / far
    } else {
        0.0
    };
    let far = far / square;
    [near.min(far), near.max(far)]
        .map(|u| (u > 0.0 && u.is_finite()).then(|| narrow(libm::sqrt(u))))
}
