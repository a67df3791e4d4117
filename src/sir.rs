//! Signal-to-interference ratio (SIR) of every kind of hop. These formulas are defined only here.
//!
//! With receiver noise N the ratio is the SINR, signal over I + N. A relay at the squared distance s, m^2, from the
//! interferer receives I = P / (eta s), and I + N = P (1 + nu s) / (eta s) with nu = N eta / P. So [`quiet`] becomes s
//! / (1 + nu s), and nothing else changes. In an interference field the factor Upsilon includes the noise (see
//! [`Field`](crate::field::Field)); for the hop to Rx the factor K does.
//! [`Field`](crate::field::Field)); for the hop to Rx the factor K does.
//!
//! The SIR of a chain is that of its worst hop: `SIR_S` = min over hops (paper, section "Position planning for multiple UAVs").
//! All SIRs are linear power ratios. Accuracy against f64 is asserted by `hop_sirs_agree_with_the_reference` in
//! `host-tests/tests/placement/main.rs`.

use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement, Station};
use crate::root::{PowerRatio, bisected, sqrt};

/// Returns the inverse interference at `at`, the factor in a hop's SIR that depends on interference.
///
/// The SIR of a hop to a receiver at `at` is the sender's gain times this factor, divided by the squared length of the
/// hop. For an interferer at (X, Y) the factor is s = (X - x)^2 + (Y - y)^2 + h^2, m^2, or with receiver noise s / (1 +
/// nu s). In an interference field the factor is Upsilon(x) / `Upsilon_max`, where Upsilon includes the noise.
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

/// Returns the inverse of interference plus noise, s / (1 + nu s), m^2. `s` is the squared distance from the
/// interferer, m^2. `nu` is the noise divided by the interferer's power received at 1 m, 1/m^2.
pub(crate) const fn in_noise(s: f32, nu: f32) -> f32 {
    if nu > 0.0 { s / (1.0 + nu * s) } else { s }
}

/// Sending node of a hop: its lateral offset, its altitude and its gain. A hop's SIR is the gain times the inverse
/// interference, divided by the squared length. The gain contains the node's transmit power.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sender {
    pub(crate) cross_section: CrossSection,
    pub(crate) gain: PowerRatio,
}

impl Sender {
    /// Returns the ground transmitter, node 0, as a sender.
    pub const fn transmitter(mission: &Mission) -> Self {
        Self {
            cross_section: CrossSection::on_line(0.0),
            gain: mission.tx_gain(),
        }
    }

    /// Returns a relay as a sender.
    pub const fn relay(mission: &Mission, relay: Station) -> Self {
        Self {
            cross_section: relay.cross_section,
            gain: mission.relay_gain(relay.power_w),
        }
    }

    /// Returns the ground receiver, node N + 1, as the sender of the first hop from Rx to Tx.
    pub fn receiver(mission: &Mission) -> Self {
        let config = mission.config();
        let relative = f64::from(config.rx_power_w) / f64::from(config.tx_power_w);
        Self {
            cross_section: CrossSection::on_line(0.0),
            gain: PowerRatio::new(mission.tx_gain().wide() * relative),
        }
    }

    /// Returns the linear SIR at a relay at `to`, while this sender is at x = `from_m`, m. The SIR is infinite if
    /// both are at the same position.
    ///
    /// Without noise, with the relay at (x, y, h), the interferer at (X, Y, 0), and the sender, of gain A, at (x0,
    /// y0, h0):
    ///
    /// ```text
    /// SIR = A ((X - x)^2 + (Y - y)^2 + h^2) / L^2
    /// L^2 = (x - x0)^2 + (y - y0)^2 + (h - h0)^2
    /// ```
    ///
    /// With y = y0 = 0 this is the paper's `SIR_1` for h0 = 0 and A = `p_t` / `p_MSI`, and its `SIR_i` for A = (`p_u`
    /// / `p_MSI`)(eta / `mu_los`).
    ///
    /// For interference that the mission gives as a distribution along x, the expected SIR is
    /// p Upsilon(x) / (eta L^2) from Tx and p Upsilon(x) / (`mu_los` L^2) from a relay. L is the length of the hop,
    /// m, and p the sender's power, W.
    pub fn sir_at(&self, mission: &Mission, from_m: f32, to: Placement) -> f32 {
        let step = to.x_m - from_m;
        let across = to.cross_section().apart_squared(self.cross_section);
        self.gain.value() * quiet(mission, to) / (square(step) + across)
    }
}

/// Returns the SIR at the ground receiver of the signal from a relay of `power_w` watts at `from`. This is `SIR_{N+1}`
/// of the paper: [`Mission::receiver_gain`] divided by the squared distance from the relay to Rx.
pub fn at_receiver(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let distance = mission.config().distance_m - from.x_m;
    let across = square(from.y_m) + square(from.altitude_m);
    mission.receiver_gain(power_w) / (square(distance) + across)
}

/// Returns the SIR at Tx when a relay at `from` sends to it with `power_w` watts. 0 while the interferer is unknown.
pub fn at_transmitter(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let across = square(from.y_m) + square(from.altitude_m);
    transmitter_gain(mission, power_w) / (square(from.x_m) + across)
}

/// Returns the factor K of a hop from a relay to Tx, m^2. The SIR at Tx is K divided by the hop's squared length.
#[expect(
    clippy::cast_possible_truncation,
    reason = "a float that fits by the ranges of the mission"
)]
pub(crate) fn transmitter_gain(mission: &Mission, power_w: f32) -> f32 {
    let config = mission.config();
    let (eta, mu_nlos) = (config.channel.eta(), config.channel.mu_nlos());
    if let Some(field) = mission.heard() {
        return (f64::from(power_w) * f64::from(field.upsilon(0.0)) / eta) as f32;
    }
    let Some(interferer) = mission.known_source() else {
        return 0.0;
    };
    let (x, y) = (f64::from(interferer.x_m), f64::from(interferer.y_m));
    let squared = x * x + y * y;
    // P / mu_nlos / squared + N, times squared.
    let heard = f64::from(interferer.power_w) / mu_nlos + f64::from(config.noise_w) * squared;
    (f64::from(power_w) * squared / (eta * heard)) as f32
}

pub const fn square(x: f32) -> f32 {
    x * x
}

/// Number of bisection steps for the x at which the first hop's SIR is largest.
const HALVINGS: u8 = 32;

/// Returns the x, m, at which the first hop's SIR is largest, for an interferer behind Tx (X < 0).
///
/// With s = (X - x)^2 + Y^2 + h^2 and q = X^2 + Y^2 the slope of that SIR has the sign of X x - q - X h^2 / x - nu s^2,
/// which falls with x. So there is a single maximum. Without noise it is a root of a quadratic; with noise it is closer
/// to Tx, and found by bisection.
fn first_hop_peak(mission: &Mission, interferer: &Interferer, altitude_m: f32) -> f32 {
    let Interferer { x_m, y_m, .. } = *interferer;
    let (q, b) = (square(x_m) + square(y_m), square(altitude_m));
    let root = sqrt(square(q) + square(2.0 * x_m * altitude_m));
    let peak = -2.0 * x_m * b / (q + root);
    let noise = mission.noise_at_a_metre();
    if !(noise > 0.0) {
        return peak;
    }
    let rises = |x: f32| {
        let s = square(x - x_m) + (square(y_m) + b);
        x_m * x - q - x_m * (b / x) - noise * s * s > 0.0
    };
    bisected(0.0, peak, HALVINGS, rises).0
}

/// Returns the largest SIR of the first hop to a relay at `altitude_m`, for any x from Tx to Rx.
///
/// For an interferer at X >= 0, the SIR is largest at x = 0, vertically above Tx (the paper's Lemma 2 and `gamma_0`):
/// anywhere else s / (x^2 + h^2) is smaller. Where s is larger, 1 / (1 + nu s) is smaller too; where s is smaller, s /
/// (1 + nu s) is smaller and x^2 + h^2 is larger. For X < 0 the SIR has a single maximum along x; if that is beyond Rx,
/// the SIR is largest at Rx.
///
/// If the mission gives the interference as a distribution along x, the result is an upper bound. It is the SIR of a
/// relay vertically above Tx with the largest Upsilon of all x. The result is larger at lower altitudes.
pub fn first_hop_ceiling(mission: &Mission, altitude_m: f32) -> f32 {
    let Some(interferer) = mission.interferer() else {
        return mission.tx_gain().value() / square(altitude_m);
    };
    let x_m = if interferer.x_m < 0.0 {
        first_hop_peak(mission, interferer, altitude_m).min(mission.config().distance_m)
    } else {
        0.0
    };
    Sender::transmitter(mission).sir_at(mission, 0.0, Placement::on_line(x_m, altitude_m))
}
