//! Signal-to-interference ratio (SIR) of every kind of hop. These formulas are defined only here.
//!
//! With receiver noise N the ratio is the SINR, signal over I + N. A relay at the squared distance s, m^2, from the
//! interferer receives I = P / (eta s). So I + N = P (1 + nu s) / (eta s) with nu = N eta / P. So [`quiet`] becomes s /
//! (1 + nu s), and nothing else changes. In an interference field the factor Upsilon includes the noise (see
//! [`Field`](crate::field::Field)); for the hop to Rx the factor K does.
//!
//! The SIR of a chain is that of its worst hop: `SIR_S` = min over hops (paper, section "Position planning for multiple
//! UAVs"). All SIRs are linear power ratios. Accuracy against f64 is asserted by `hop_sirs_agree_with_the_reference` in
//! `host-tests/tests/placement/main.rs`.

use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement, Station};
use crate::root::{PowerRatio, bisected, sqrt};

/// Returns the inverse interference at `at`, a factor of the SIR. Interferer: `s / (1 + nu s)`,
/// `s = (X - x)^2 + (Y - y)^2 + h^2`, m^2. Field: `Upsilon(x) / Upsilon_max`, with noise.
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

/// Returns the inverse of interference plus noise, `s / (1 + nu s)`, m^2.
pub(crate) const fn in_noise(s: f32, nu: f32) -> f32 {
    if nu > 0.0 { s / (1.0 + nu * s) } else { s }
}

/// Sender of a hop: lateral offset, altitude, and gain.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sender {
    pub(crate) cross_section: CrossSection,
    pub(crate) gain: PowerRatio,
}

impl Sender {
    /// Returns Tx, node 0, as a sender.
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

    /// Returns Rx, node N + 1, as a sender.
    pub fn receiver(mission: &Mission) -> Self {
        let config = mission.config();
        let relative = f64::from(config.rx_power_w) / f64::from(config.tx_power_w);
        Self {
            cross_section: CrossSection::on_line(0.0),
            gain: PowerRatio::new(mission.tx_gain().wide() * relative),
        }
    }

    /// Returns the linear SIR at `to`, with this sender at `from_m`, m. Infinite if both are at the same position.
    /// Without noise, with the relay at (x, y, h), the interferer at (X, Y, 0), and the sender, of gain A, at (x0, y0,
    /// h0):
    ///
    /// ```text
    /// SIR = A ((X - x)^2 + (Y - y)^2 + h^2) / L^2
    /// L^2 = (x - x0)^2 + (y - y0)^2 + (h - h0)^2
    /// ```
    ///
    /// With y = y0 = 0 this is the paper's `SIR_1` for h0 = 0 and A = `p_t` / `p_MSI`. It is `SIR_i` for A = (`p_u` /
    /// `p_MSI`)(eta / `mu_los`).
    ///
    /// In a field the expected SIR is p Upsilon(x) / (eta L^2) from Tx, p Upsilon(x) / (`mu_los` L^2) from a relay. p
    /// is the sender's power, W.
    pub fn sir_at(&self, mission: &Mission, from_m: f32, to: Placement) -> f32 {
        let step = to.x_m - from_m;
        let across = to.cross_section().apart_squared(self.cross_section);
        self.gain.value() * quiet(mission, to) / (square(step) + across)
    }
}

/// Returns the SIR at Rx, the paper's `SIR_{N+1}`. It is [`Mission::receiver_gain`] / squared distance.
pub fn at_receiver(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let distance = mission.config().distance_m - from.x_m;
    let across = square(from.y_m) + square(from.altitude_m);
    mission.receiver_gain(power_w) / (square(distance) + across)
}

/// Returns the SIR at Tx; 0 while the interferer is unknown.
pub fn at_transmitter(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let across = square(from.y_m) + square(from.altitude_m);
    transmitter_gain(mission, power_w) / (square(from.x_m) + across)
}

/// Returns the factor K, m^2: SIR at Tx = K / squared length.
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

/// Number of bisection steps for the best x.
const HALVINGS: u8 = 32;

/// Returns the x of the largest first-hop SIR, m, for X < 0. The slope has the sign of `X x - q - X h^2 / x - nu s^2`,
/// which falls with x. `s = (X - x)^2 + Y^2 + h^2`, `q = X^2 + Y^2`. With noise it is closer to Tx.
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

/// Returns the largest SIR of the first hop at `altitude_m`, over all x. For X >= 0 it is at x = 0 (Lemma 2,
/// `gamma_0`): elsewhere `s / (x^2 + h^2)` is smaller. Noise: larger s has a smaller `1 / (1 + nu s)`; smaller s a
/// smaller `s / (1 + nu s)` and larger `x^2 + h^2`. For X < 0 there is one maximum, at most at Rx. In a field it is an
/// upper bound. It is larger at lower altitudes.
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
