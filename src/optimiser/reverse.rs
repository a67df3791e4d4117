//! Hop for data from Rx to Tx (the way back), and the combined reach of a hop in both directions.
//!
//! On the way back from Rx to Tx hop k is sent by node k and received by node k - 1, so another power and the interference at
//! another position count. With node 0 = Tx, node N + 1 = Rx, the path gain g and the noise N
//!
//! ```text
//! F_k = P_(k-1) g / (I_k + N),    B_k = P_k g / (I_(k-1) + N),    SIR of the chain = min over k of min(F_k, B_k / r)
//! ```
//!
//! A target gamma is met if F_k >= gamma and B_k >= r gamma on every hop.
//!
//! # Combined reach
//!
//! With the forward sender at x0, s0 its squared distance from the interferer, q(s) = s / (1 + nu s) and A' the gain of
//! the receiver's power, B_k = A' q(s0) / l with l = d^2 + b^2 the squared length of the hop. Position x0 is given, so
//!
//! ```text
//! B_k >= r gamma    <=>    d <= sqrt((A' / r) q(s0) / gamma - b^2)
//! ```
//!
//! with noise as without it. For the first hop Tx receives, and K_tx takes the place of A' q(s0): it is the counterpart
//! at Tx of K at Rx. The lengths that meet the target backward are an interval from 0. Those that meet it forward are
//! not (see [`spacing`](super::spacing)). So the combined reach is not the smaller of the two: it is the largest d up
//! to the limit above that meets the target forward, which is [`Hop::reach`](super::spacing::Hop::reach) with that
//! limit as the end. No term cancels: s0 is a sum of squares, and the difference with b^2 has the rounding error of the
//! SIR itself.
//!
//! # Sender that stays away from the interferer
//!
//! With gamma below A' / r the limit x0 + sqrt((A' / r) q(s0) / gamma - b^2) falls with x0 before the interferer and
//! rises beyond: a relay in front of the interferer receives the next one worse than a relay farther back does. The
//! forward SIR is always best from the closest position. So of all x0 up to the reach M of the sender, a given x needs
//! the largest at which the sender receives the backward hop: M, or the largest below it. Seen from x this is the
//! problem of the [last hop](super::from_rx), with x in place of Rx. On that branch F_k / gamma = (A r / A') q(s) /
//! q(s0), and without noise, at equal altitudes, with c^2 = A' / (r gamma) and the angle v between the directions from
//! the sender to the interferer and to the receiver
//!
//! ```text
//! s / s0 = 1 + c^2 - 2 c cos v
//! ```
//!
//! by the law of cosines. It rises with x0, while x falls. So from the combined reach of M on, x is feasible up to one point, which a
//! bisection finds. It is needed only if the way back limits the reach of M, and ends at once if a little more is infeasible.
//!
//! Accuracy: `host-tests/tests/both_ways` compares chains with a grid search in f64.

use super::noisy_hop::NoisyHop;
use crate::mission::Mission;
use crate::place::CrossSection;
use crate::root::sqrt;
use crate::sir::{in_noise, square, transmitter_gain};

/// Limit of the squared length of a hop in the computation, m^2, so that no number becomes infinite.
const MOST_SQUARED: f32 = 1e18;

/// Backward hop, for data from Rx to Tx, prepared for many targets and lengths.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Back {
    /// Gain of the backward hop, divided by r, the required ratio of backward to forward SIR. The hop's SIR is the
    /// gain times the inverse interference, divided by the squared length. For a hop to Tx the gain, m^2, includes
    /// the interference at Tx.
    gain: f32,
    /// True if Tx is the receiver of this hop, false if a relay is.
    to_tx: bool,
    /// Position X of the interferer along x, m.
    interferer_x_m: f32,
    /// Squared distance of the receiver from the interferer perpendicular to x, m^2.
    aside_squared: f32,
    /// Receiver noise divided by the interferer's power received at 1 m: nu, 1/m^2.
    noise: f32,
}

impl Back {
    /// Returns the backward hop from a relay of `power_w` watts to a relay at `to`, or to Tx. `None` for a mission
    /// without data from Rx to Tx.
    #[inline(never)] // keeps a sweep without a way back small
    pub(super) fn new(
        mission: &Mission,
        to: CrossSection,
        power_w: f32,
        to_tx: bool,
    ) -> Option<Self> {
        let reverse = mission.reverse();
        if !(reverse > 0.0) {
            return None;
        }
        let interferer = mission.known_source()?;
        let gain = if to_tx {
            transmitter_gain(mission, power_w)
        } else {
            mission.relay_gain(power_w).value()
        };
        Some(Self {
            gain: gain / reverse,
            to_tx,
            interferer_x_m: interferer.x_m,
            aside_squared: square(interferer.y_m - to.y_m) + square(to.altitude_m),
            noise: mission.noise_at_a_metre(),
        })
    }

    /// Returns the target SIR times the squared maximum length of a backward hop, m^2. The receiver of the hop is at
    /// `x_m`. The product does not depend on the target.
    pub(super) fn hears(&self, x_m: f32) -> f32 {
        if self.to_tx {
            return self.gain;
        }
        let squared = square(self.interferer_x_m - x_m) + self.aside_squared;
        self.gain * in_noise(squared, self.noise)
    }

    /// Returns the maximum length of the backward hop along x, m, for its receiver at `x_m`. `across_squared` is the
    /// squared distance of the hop's ends perpendicular to x, m^2. `None` if no length meets `target`.
    pub(super) fn reach(&self, target: f32, x_m: f32, across_squared: f32) -> Option<f32> {
        let squared = (self.hears(x_m) / target).min(MOST_SQUARED) - across_squared;
        (squared >= 0.0).then(|| sqrt(squared))
    }

    /// Returns the backward hop for `target` from a sender at `x_m`, as a function of its length along x.
    /// `across_squared` is the squared distance of the hop's ends perpendicular to x, m^2.
    pub(super) fn from(&self, target: f32, x_m: f32, across_squared: f32) -> NoisyHop {
        let ratio = target / self.gain;
        NoisyHop {
            ratio,
            excess: ratio - 1.0,
            ahead: x_m - self.interferer_x_m,
            aside_squared: self.aside_squared,
            across_squared,
            base: self.aside_squared - across_squared,
            noise: self.noise,
        }
    }

    /// Returns the distance along x from the interferer, m, within which a receiver misses `target`. `None` if the
    /// receiver misses the target at every distance. The backward hop to the receiver has the squared length `squared`,
    /// m^2.
    pub(super) fn zone(&self, target: f32, squared: f32) -> Option<f32> {
        zone(target * squared / self.gain, self.noise, self.aside_squared)
    }
}

/// Returns the distance along x from the interferer, m, within which q is less than `needed`, m^2.
///
/// q = s / (1 + `noise` s) is the inverse of interference plus noise at a receiver. s is the squared distance from the
/// interferer to the receiver, m^2; `aside_squared` is its part perpendicular to x. `None` if q is less than `needed`
/// at any distance, because of the noise.
pub(super) fn zone(needed: f32, noise: f32, aside_squared: f32) -> Option<f32> {
    let left = 1.0 - noise * needed;
    (left > 0.0).then(|| sqrt((needed / left).min(MOST_SQUARED) - aside_squared))
}
