//! Single relay without a known interferer: noise only, or a field of interference.
//!
//! # Noise only
//!
//! [`best_in_noise`] is the limit of an interferer that is too far away or too weak to matter.
//!
//! SNR_1 = p_t / (eta n_1 (x^2 + h^2)) falls with x, SNR_2 = p_u / (eta n_2 ((D - x)^2 + h^2)) rises, and both fall with the
//! altitude. So the optimum is where they are equal, or above Tx or Rx, at the lowest altitude. With r = (p_u n_1) / (p_t n_2)
//! they are equal where (1 - r) x^2 - 2 D x + C = 0, C = D^2 + (1 - r) h^2. The root between Tx and Rx is x = C / (D + sqrt(D^2 -
//! (1 - r) C)), in a form without a special case for r = 1 (x = D / 2). The discriminant is r D^2 - (1 - r)^2 h^2.
//!
//! Accuracy: `one_relay_in_noise_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SNR.
//!
//! # Field: Algorithm 3, as corrected, and its limit
//!
//! With one relay E(SIR_2) rises with x, so a target gamma determines x = D - sqrt(A / gamma - h^2), where E(SIR_2) is
//! gamma. The printed algorithm takes the first gamma, from the top, that E(SIR_1) meets there. That is not optimal: a
//! position whose E(SIR_1) is below its gamma may still be better than one that meets a lower gamma. The corrected
//! algorithm continues until gamma is at most the best min(gamma, E(SIR_1)) so far.
//!
//! [`best_in_field`] needs no step. Between two points of the field E(SIR_1) = c (a + b x) / (x^2 + h^2), and its
//! extrema are the roots of a quadratic. Between two extrema it is monotone, so the optimum is at an end or where the
//! two SIRs cross. [`stepped`] is the algorithm.
//!
//! Accuracy: `host-tests/tests/single.rs`, against a dense search in f64.

use uav_relay::root::sqrt;
use uav_relay::sir::square;
use uav_relay::{Mission, Placement, Profile};
use uav_relay_scenario::number::narrow;

use super::{Found, Two};

/// Noise power at the receivers' inputs, W, above 0 (1e-15 W is -120 dBm).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Noise {
    /// Receiver noise power of the relay, W.
    pub relay_w: f32,
    /// Receiver noise power of the ground receiver Rx, W.
    pub receiver_w: f32,
}

/// Returns the optimal position of a relay with `profile` against `noise` only, and its SNR (linear).
///
/// Only the mission's distance, Tx power and channel are used. The relay has the altitude of `profile`; a lower
/// altitude would always be better. Constant work.
pub fn best_in_noise(mission: &Mission, profile: Profile, noise: Noise) -> Found {
    let config = mission.config();
    let (d, h) = (config.distance_m, profile.altitude_m);
    let first_w = narrow(f64::from(config.tx_power_w) / config.channel.eta()) / noise.relay_w;
    let second_w =
        first_w * (profile.power_w / config.tx_power_w) * (noise.relay_w / noise.receiver_w);
    let snr = |x_m: f32| {
        let first = first_w / (square(x_m) + square(h));
        let second = second_w / (square(d - x_m) + square(h));
        (first, second)
    };
    let r = second_w / first_w;
    // If the SNRs are equal nowhere between Tx and Rx, the root is beyond the optimal end. This holds with the
    // discriminant cut to 0, too.
    let root = sqrt(r * square(d) - square((1.0 - r) * h));
    let x_m = ((square(d) + (1.0 - r) * square(h)) / (d + root))
        .max(0.0)
        .min(d);
    let (first, second) = snr(x_m);
    Found {
        place: Placement::on_line(x_m, h),
        sir: first.min(second),
    }
}

/// Returns the position from `low` to `high`, m, at which the worse hop has its largest SIR.
///
/// From `low` to `high` the first hop's mean SIR must only rise or only fall.
fn best_of(two: &Two, low: f32, high: f32) -> Found {
    let ends = two.found(low).or(two.found(high));
    if two.first(low) <= two.second(low) || two.first(high) >= two.second(high) {
        return ends;
    }
    // E(SIR_1) is above E(SIR_2) at one end and below at the other, and E(SIR_2) rises. So they cross once.
    ends.or(two.crossing(low, high))
}

/// Returns the optimal position of a relay with `profile`; `None` if the mission has no field.
///
/// A field is the distribution of the interference at some points along the line Tx-Rx. The relative difference from
/// the best SIR is at most 1e-5. Work: at most 260 evaluations of both hops for each point; not for a relay's main
/// loop.
pub fn best_in_field(mission: &Mission, profile: Profile) -> Option<Found> {
    let field = mission.heard()?;
    let two = Two::new(mission, profile);
    let end_m = mission.config().distance_m;
    let mut best = two.found(0.0);
    let mut from = 0.0_f32;
    let corners = mission
        .field()?
        .points()
        .iter()
        .map(|point| point.x_m)
        .chain([end_m]);
    for corner in corners {
        let to = corner.min(end_m);
        if to <= from {
            continue;
        }
        let mut piece = from;
        for turn in turns(|x_m| field.upsilon(x_m), from, to, profile.altitude_m)
            .into_iter()
            .chain([to])
        {
            if turn > piece && turn <= to {
                best = best.or(best_of(&two, piece, turn));
                piece = turn;
            }
        }
        from = to;
    }
    Some(best)
}

/// Returns both extrema of the first hop's mean SIR along x, ascending, m.
///
/// `upsilon` is E[1/I], the mean of the inverse interference power, and is linear in [`low`, `high`]. If it is a + b x
/// there, and h is the altitude, the extrema are the roots of b x^2 + 2 a x - b h^2 = 0. If it is constant, both
/// results are `high`.
fn turns(upsilon: impl Fn(f32) -> f32, low: f32, high: f32, altitude_m: f32) -> [f32; 2] {
    let (at_low, at_high) = (upsilon(low), upsilon(high));
    let b = (at_high - at_low) / (high - low);
    let a = at_low - b * low;
    if !(b.abs() * high > 1e-7 * at_low) {
        // Upsilon is constant, so E(SIR_1) falls.
        return [high, high];
    }
    // Without cancellation: with q = -(a + sign(a) sqrt(a^2 + b^2 h^2)) the roots are q / b and -b h^2 / q.
    let root = sqrt(a * a + square(b * altitude_m));
    let q = -(a + root.copysign(a));
    let (one, other) = (q / b, -b * square(altitude_m) / q);
    [one.min(other), one.max(other)]
}

/// Runs the paper's Algorithm 3, which lowers the target SIR in steps of `epsilon`.
///
/// `epsilon` is linear, above 0. `None` without a field (interference distribution along the line Tx-Rx). Only
/// positions at which the second hop's mean SIR equals a target are evaluated. An optimum between them can be missed.
/// Work: at most `most` evaluations, and at most the first target SIR divided by `epsilon`.
pub fn stepped(mission: &Mission, profile: Profile, epsilon: f32, most: u32) -> Option<Found> {
    mission.field()?;
    let two = Two::new(mission, profile);
    let end_m = mission.config().distance_m;
    let start = two.second(end_m);
    let mut best: Option<Found> = None;
    for step in 0..most {
        let target = narrow(f64::from(start) - f64::from(step) * f64::from(epsilon));
        if !(target > best.map_or(0.0, |best| best.sir)) {
            break;
        }
        let back = mission.receiver_gain(profile.power_w) / target - square(profile.altitude_m);
        let x_m = end_m - sqrt(back);
        let found = two.found(x_m.max(0.0));
        if best.is_none_or(|best| found.sir > best.sir) {
            best = Some(found);
        }
        if x_m < 0.0 {
            break;
        }
    }
    best
}
