//! One relay where nothing but noise disturbs it: the limit of an interferer that is too far away or too weak to matter.
//!
//! SNR_1 = p_t / (eta n_1 (x^2 + h^2)) falls with x, SNR_2 = p_u / (eta n_2 ((D - x)^2 + h^2)) rises, and both fall with the
//! altitude: the best place is where they are equal, or above Tx or Rx, as low as may be. With r = (p_u n_1) / (p_t n_2) they
//! are equal where (1 - r) x^2 - 2 D x + C = 0, C = D^2 + (1 - r) h^2; of its roots x = C / (D + sqrt(D^2 - (1 - r) C)) is the
//! one between Tx and Rx, written so that r = 1 (x = D / 2) is no special case. The discriminant is r D^2 - (1 - r)^2 h^2.
//!
//! Accuracy: `noise_is_no_worse_than_brute_force` in `host-tests/tests/theorems/`: within 1e-4 relative of the best SNR.

use super::Found;
use crate::mission::{Mission, Profile};
use crate::place::Placement;
use crate::root::sqrt;
use crate::sir::square;

/// Noise power at the inputs of the receivers, W, above 0 (1e-15 W is -120 dBm).
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Noise {
    /// At the relay.
    pub relay_w: f32,
    /// At Rx.
    pub receiver_w: f32,
}

/// Where a relay that holds `profile` does best against `noise` alone, and its SNR (linear) there.
///
/// Of the mission only the distance, Tx's power and the channel count. For the altitude take the lowest there is. Constant work.
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
    // Where they are equal nowhere between Tx and Rx the root lies beyond the end that is best, and so does what is left of it
    // without a discriminant.
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
