//! Signal-to-interference ratio (SIR) of every kind of hop. These formulas are defined only here.
//!
//! With receiver noise N the ratio is the SINR, signal over I + N. A relay at the squared distance s, m^2, from the interferer
//! receives I = P / (eta s), and I + N = P (1 + nu s) / (eta s) with nu = N eta / P. So [`quiet`] becomes s / (1 + nu s), and
//! nothing else changes. In a field, Upsilon includes the noise (see [`Field`](crate::field::Field)); at Rx, K does.
//!
//! The SIR of a chain is that of its worst hop: `SIR_S` = min over hops (paper, section "Position planning for multiple UAVs").
//! All SIRs are linear power ratios. Accuracy against f64 is asserted by `hop_sirs_agree_with_the_reference` in
//! `host-tests/tests/placement/main.rs`.
//!
//! # Extrema of SIR_1
//!
//! [`first_hop_turn`] returns those along x >= 0 at one altitude: the paper's Lemma 2, for any interferer position and with noise.
//!
//! With s = (X - x)^2 + Y^2 + h^2 and q = X^2 + Y^2 the slope of SIR_1 = A s / ((x^2 + h^2)(1 + nu s)) has the sign of
//!
//! ```text
//! X x^2 - q x - X h^2 - nu x s^2
//! ```
//!
//! Without noise this is a quadratic with the roots (q +- sqrt(q^2 + 4 X^2 h^2)) / 2X, one of which is beyond Tx. With noise:
//!
//! - X < 0: the expression falls with x from -X h^2 > 0 at Tx, so SIR_1 still has a single maximum, closer to Tx.
//! - X = 0: the expression is negative.
//! - X > 0: divided by x it is phi = X x - q - X h^2 / x - nu s^2, which is concave because s is convex and not negative, and so
//!   is s^2. So SIR_1 falls to a minimum, rises to a maximum and then falls, or it only falls. No root is before the noise-free
//!   minimum, where the sum of the first three terms is negative.
//!
//! For X >= 0 the largest SIR_1 in [0, D] is at x = 0, as without noise: anywhere else s / (x^2 + h^2) is smaller. Where s is
//! larger, 1 / (1 + nu s) is smaller too; where s is smaller, s / (1 + nu s) is smaller and x^2 + h^2 is larger.

use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement, Station};
use crate::root::{PowerRatio, Real, bisected, sqrt};

/// Returns the inverse interference at `at`, the factor by which interference enters a hop's SIR.
///
/// The SIR of a hop to a receiver at `at` is the sender's gain times this factor, divided by the squared length of
/// the hop. For an interferer at (X, Y) the factor is s = (X - x)^2 + (Y - y)^2 + h^2, m^2, with noise
/// s / (1 + nu s). In an interference field the factor is Upsilon(x) / `Upsilon_max`, with noise.
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
/// interferer, m^2, and `nu` the noise, 1/m^2.
pub(crate) const fn in_noise(s: f32, nu: f32) -> f32 {
    if nu > 0.0 { s / (1.0 + nu * s) } else { s }
}

/// Sending node of a hop: lateral offset, altitude, and transmit power relative to the interference.
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

/// Returns the SIR at the ground receiver for a relay of `power_w` watts at `from`. This is `SIR_{N+1}` of the paper:
/// [`Mission::receiver_gain`] divided by the squared distance from the relay to Rx.
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

/// Returns the factor K of the hop from a relay to Tx, m^2. The SIR at Tx is K divided by the squared length of the
/// hop.
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

/// Number of bisection steps for the x at which the first hop's SIR has an extremum.
const HALVINGS: u8 = 32;

/// Maximum number of doublings of x in the search for an x beyond an extremum of the first hop's SIR.
const DOUBLINGS: u8 = 64;

/// Shape of SIR_1, the SIR of the first hop, along x >= 0 at one altitude.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extremum {
    /// First hop's SIR along x falls up to this x, m (the paper's Psi^x), and rises beyond. The interferer is ahead
    /// of Tx (X > 0).
    Valley(f32),
    /// First hop's SIR falls up to the first x, m, rises up to the second x, and falls beyond. The interferer is
    /// ahead of Tx (X > 0), with noise.
    ValleyAndHill(f32, f32),
    /// The first hop's SIR rises along x up to this x, m, and falls beyond it. The interferer is behind Tx (X < 0).
    Hill(f32),
    /// First hop's SIR falls with x. The interferer is at X = 0, or the interferer is ahead of Tx and the noise
    /// exceeds the interference.
    Falls,
    /// First hop's SIR is the same at every x: the interferer is at Tx, and there is no noise.
    Level,
}

/// Returns the extrema of SIR_1, the first hop's SIR, along x for a relay at `altitude_m`.
///
/// Without noise they are roots of a quadratic, written without cancellation for X < 0; with noise they take at most 190
/// evaluations of the slope. Accuracy: `turns_agree_with_a_scan` in `host-tests/tests/theorems/`.
pub fn first_hop_turn(mission: &Mission, interferer: &Interferer, altitude_m: f32) -> Extremum {
    let x = interferer.x_m;
    let q = square(x) + square(interferer.y_m);
    let root = sqrt(square(q) + square(2.0 * x * altitude_m));
    let noise = mission.noise_at_a_metre();
    let slope = Slope {
        p: x,
        q,
        a: square(interferer.y_m) + square(altitude_m),
        b: square(altitude_m),
        noise,
        halvings: HALVINGS,
    };
    if x > 0.0 {
        let bottom = (q + root) / (2.0 * x);
        if !(noise > 0.0) {
            return Extremum::Valley(bottom);
        }
        slope
            .valley_and_hill(bottom)
            .map_or(Extremum::Falls, |[valley, hill]| {
                Extremum::ValleyAndHill(valley, hill)
            })
    } else if x < 0.0 {
        let peak = -2.0 * x * square(altitude_m) / (q + root);
        Extremum::Hill(if noise > 0.0 { slope.hill(peak) } else { peak })
    } else if q > 0.0 || noise > 0.0 {
        Extremum::Falls
    } else {
        Extremum::Level
    }
}

/// Function phi(t) with the sign of the slope of the first hop's SIR at t, a position on a line.
///
/// phi(t) = p t - q - p b / t - nu ((t - p)^2 + a)^2. On a line along x p is the X of the interferer.
#[derive(Debug)]
pub struct Slope<T> {
    /// t of the point closest to the interferer, m; 0 is the t of the point closest to Tx.
    pub p: T,
    /// Difference p^2 + a - b, m^2.
    pub q: T,
    /// Squared distance of the line from the interferer, m^2.
    pub a: T,
    /// Squared distance of the line from Tx, m^2.
    pub b: T,
    /// Receiver noise divided by the interferer's power received at 1 m: nu, 1/m^2.
    pub noise: T,
    /// Number of bisection steps for each extremum.
    pub halvings: u8,
}

impl<T: Real> Slope<T> {
    fn rises(&self, t: T) -> bool {
        let Self { p, q, a, b, .. } = *self;
        let s = (t - p) * (t - p) + a;
        p * t - q - p * (b / t) - self.noise * s * s > T::from(0.0)
    }

    /// Returns true if phi rises at `t`, m, for p > 0. Beyond p the derivative of phi falls with t, so phi has at
    /// most one maximum there.
    fn bends_up(&self, t: T) -> bool {
        let Self { p, a, b, .. } = *self;
        let s = (t - p) * (t - p) + a;
        let half = T::from(0.5) * (p + p * (b / (t * t)));
        half - T::from(2.0) * self.noise * s * (t - p) > T::from(0.0)
    }

    /// Returns the t of the SIR's only maximum for p < 0, m. `peak` is the t of the maximum without noise.
    pub fn hill(&self, peak: T) -> T {
        bisected(T::from(0.0), peak, self.halvings, |t| self.rises(t)).0
    }

    /// Returns the t of the SIR's minimum and of its maximum for p > 0, m. `bottom` is the t of the minimum without
    /// noise. `None` if the SIR only falls.
    pub fn valley_and_hill(&self, bottom: T) -> Option<[T; 2]> {
        let bends_up = |t: T| self.bends_up(t);
        if !bends_up(bottom) {
            return None;
        }
        let (top, _) = bisected(bottom, beyond(bottom, bends_up), self.halvings, bends_up);
        let rises = |t: T| self.rises(t);
        if !rises(top) {
            return None;
        }
        let (valley, _) = bisected(bottom, top, self.halvings, |t| !rises(t));
        let (hill, _) = bisected(top, beyond(top, rises), self.halvings, rises);
        Some([valley, hill])
    }
}

fn beyond<T: Real>(from: T, holds: impl Fn(T) -> bool) -> T {
    let mut at = T::from(2.0) * from;
    for _ in 0..DOUBLINGS {
        if !holds(at) {
            break;
        }
        at = T::from(2.0) * at;
    }
    at
}

/// Returns the largest SIR of the first hop to a relay at `altitude_m`, for any x from Tx to Rx.
///
/// For an interferer at X >= 0, the SIR is largest at x = 0, right above Tx (the paper's Lemma 2 and `gamma_0`). For
/// X < 0 the SIR has a single maximum along x, at the x that [`first_hop_turn`] returns; if that is beyond Rx, the
/// SIR is largest at Rx. Both hold with noise as well.
///
/// If the mission gives the interference as a distribution along x, the result is an upper bound. It is the SIR of a
/// relay right above Tx with the largest Upsilon of all x. The result is larger at lower altitudes.
pub fn first_hop_ceiling(mission: &Mission, altitude_m: f32) -> f32 {
    let Some(interferer) = mission.interferer() else {
        return mission.tx_gain().value() / square(altitude_m);
    };
    let x_m = match first_hop_turn(mission, interferer, altitude_m) {
        Extremum::Hill(peak) => peak.min(mission.config().distance_m),
        _ => 0.0,
    };
    Sender::transmitter(mission).sir_at(mission, 0.0, Placement::on_line(x_m, altitude_m))
}

#[cfg(test)]
mod tests {
    use super::{Placement, Sender, first_hop_ceiling};
    use crate::features::NOISE;
    use crate::mission::tests::paper;
    use crate::mission::{Interference, Interferer, Mission, MissionConfig};

    #[test]
    fn the_ceiling_of_the_first_hop_is_never_below_what_a_scan_finds() {
        for (x_m, y_m, altitude_m, noise_w) in [
            (500.0, 400.0, 20.0, 0.0),
            (-10.0, 0.0, 50.0, 0.0),
            (-300.0, 200.0, 80.0, 0.0),
            (-1e5, 3.0, 900.0, 0.0),
            (500.0, 400.0, 20.0, 1e-8),
            (0.0, 0.0, 20.0, 1e-5),
            (-10.0, 0.0, 50.0, 1e-6),
            (-10.0, 0.0, 50.0, 1e-1),
            (-300.0, 200.0, 80.0, 1e-7),
            (-1e5, 3.0, 900.0, 1e-12),
        ] {
            let interferer = Interferer {
                power_w: 80.0,
                x_m,
                y_m,
            };
            let noise_w = if NOISE { noise_w } else { 0.0 };
            let mission = Mission::try_new(MissionConfig {
                interference: Interference::Source(interferer),
                noise_w,
                ..paper(1)
            })
            .unwrap();
            let tx = Sender::transmitter(&mission);
            let best = (0..=10_000_u16)
                .map(|i| {
                    tx.sir_at(
                        &mission,
                        0.0,
                        Placement::on_line(f32::from(i) * 0.1, altitude_m),
                    )
                })
                .fold(0.0, f32::max);
            let ceiling = first_hop_ceiling(&mission, altitude_m);
            assert!(
                (ceiling / best - 1.0).abs() < 1e-4,
                "{x_m} {y_m} {altitude_m} {noise_w}: {ceiling} against {best}"
            );
            assert!(ceiling >= best * (1.0 - 1e-6));
        }
    }
}
