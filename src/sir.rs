//! Signal-to-interference ratio (SIR) of every kind of hop. These formulas are defined only here.
//!
//! With receiver noise N the ratio is the SINR, signal over I + N. A relay at the squared distance s, m^2, from the interferer
//! receives I = P / (eta s), and I + N = P (1 + nu s) / (eta s) with nu = N eta / P. So [`quiet`] becomes s / (1 + nu s), and
//! nothing else changes. In a field, Upsilon includes the noise (see [`Field`](crate::field::Field)); at Rx, K does.
//!
//! The SIR of a chain is that of its worst hop: `SIR_S` = min over hops (paper, section "Position planning for multiple UAVs").
//! All SIRs are linear power ratios. Accuracy against f64 is asserted by `hop_sirs_agree_with_the_reference` in
//! `host-tests/tests/placement/main.rs`.
//! `host-tests/tests/placement/main.rs`.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

mod turn;

pub use turn::{Extremum, first_hop_ceiling, first_hop_turn};

use crate::mission::Mission;
use crate::place::{CrossSection, Placement, Station};
use crate::power_ratio::PowerRatio;

/// Returns the inverse interference at `at`, the one term of a hop's SIR that depends on the kind of interference.
///
/// The SIR of a hop to a receiver at `at` is the sender's gain times this, over the squared length of the hop. For an interferer
/// it is s = (X - x)^2 + (Y - y)^2 + h^2, m^2, with noise s / (1 + nu s). In a field it is Upsilon(x) / `Upsilon_max`, with
/// noise.
pub fn quiet(mission: &Mission, at: Placement) -> f32 {
    match mission.interferer() {
        Some(interferer) => {
            let s = square(interferer.x_m - at.x_m)
                + square(interferer.y_m - at.y_m)
                + square(at.altitude_m);
            in_noise(s, mission.noise_at_a_metre())
        }
        None => mission
            .heard()
            .map_or(1.0, |field| field.upsilon(at.x_m) / field.largest()),
    }
}

/// Returns s / (1 + nu s), m^2, for s in m^2 and `nu` in 1/m^2; without noise exactly s.
pub(crate) const fn in_noise(s: f32, nu: f32) -> f32 {
    if nu > 0.0 { s / (1.0 + nu * s) } else { s }
}

/// Sending node of a hop: its cross-section and its power relative to the interference.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sender {
    pub(crate) at: CrossSection,
    pub(crate) gain: PowerRatio,
}

impl Sender {
    /// Returns the ground transmitter, node 0.
    pub const fn transmitter(mission: &Mission) -> Self {
        Self {
            at: CrossSection::on_line(0.0),
            gain: mission.tx_gain(),
        }
    }

    /// Returns a relay as a sender.
    pub const fn relay(mission: &Mission, relay: Station) -> Self {
        Self {
            at: relay.at,
            gain: mission.relay_gain(relay.power_w),
        }
    }

    /// Returns the SIR at a relay at `to` that receives from this node at `from_m` along x; infinite if both are at one place.
    ///
    /// With s = X - x0: A ((s - d)^2 + (Y - y)^2 + h^2) / (d^2 + (y - y0)^2 + (h - h0)^2). With y = y0 = 0 this is the paper's
    /// `SIR_1` for h0 = 0 and A = `p_t` / `p_MSI`, and its `SIR_i` for A = (`p_u` / `p_MSI`)(eta / `mu_los`). In a field it is
    /// the expected SIR, p Upsilon(x) / (eta d^2) and p Upsilon(x) / (`mu_los` d^2).
    pub fn sir_at(&self, mission: &Mission, from_m: f32, to: Placement) -> f32 {
        let step = to.x_m - from_m;
        let across = to.cross_section().apart_squared(self.at);
        self.gain.value() * quiet(mission, to) / (square(step) + across)
    }
}

/// Returns the SIR at the ground receiver for a relay of `power_w` watts at `from`: the paper's `SIR_{N+1}`, K / (d^2 + y^2 +
/// h^2).
pub fn at_receiver(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let distance = mission.config().distance_m - from.x_m;
    let across = square(from.y_m) + square(from.altitude_m);
    mission.receiver_gain(power_w) / (square(distance) + across)
}

pub(crate) const fn square(x: f32) -> f32 {
    x * x
}
