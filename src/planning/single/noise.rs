//! One relay with noise only: the limit of an interferer that is too far away or too weak to matter.
//!
//! SNR_1 = p_t / (eta n_1 (x^2 + h^2)) falls with x, SNR_2 = p_u / (eta n_2 ((D - x)^2 + h^2)) rises, and both fall with the
//! altitude. So the optimum is where they are equal, or above Tx or Rx, at the lowest altitude. With r = (p_u n_1) / (p_t n_2)
//! they are equal where (1 - r) x^2 - 2 D x + C = 0, C = D^2 + (1 - r) h^2. The root between Tx and Rx is x = C / (D + sqrt(D^2 -
//! (1 - r) C)), in a form without a special case for r = 1 (x = D / 2). The discriminant is r D^2 - (1 - r)^2 h^2.
//!
//! Accuracy: `noise_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SNR.

use super::Found;
use crate::mission::{Mission, Profile};
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;

/// Noise power at the receivers' inputs, W, above 0 (1e-15 W is -120 dBm).
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise {
    /// Noise of the relay.
    pub relay_w: f32,
    /// Noise of Rx.
    pub receiver_w: f32,
}

/// Returns the optimal position of a relay with `profile` against `noise` only, and its SNR (linear).
///
/// Only the mission's distance, Tx power and channel are used. The lowest altitude is best. Constant work.
pub fn best_place(mission: &Mission, profile: Profile, noise: Noise) -> Found {
    let config = mission.config();
    let (d, h) = (config.distance_m, profile.altitude_m);
    let first_w = mission.first_hop_power_w(1.0) / noise.relay_w;
    let second_w =
        first_w * (profile.power_w / config.tx_power_w) * (noise.relay_w / noise.receiver_w);
    let snr = |x_m: f32| {
        let first = first_w / (square(x_m) + square(h));
        let second = second_w / (square(d - x_m) + square(h));
        (first, second)
    };
    let r = second_w / first_w;
    // If they are equal nowhere between Tx and Rx, the root is beyond the optimal end, also with the discriminant cut to 0.
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
