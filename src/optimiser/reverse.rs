//! Reach of a hop in both directions, and the last hop of the way back.
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
//! With the sender of the way there at x0, s0 its squared distance from the interferer, q(s) = s / (1 + nu s) and A' the gain of
//! the receiver's power, B_k = A' q(s0) / l with l = d^2 + b^2 the squared length of the hop. Position x0 is given, so
//!
//! ```text
//! B_k >= r gamma    <=>    d <= sqrt((A' / r) q(s0) / gamma - b^2)
//! ```
//!
//! with noise as without it. For the first hop Tx receives, and K_tx takes the place of A' q(s0): it is the counterpart at Tx of K
//! at Rx. The lengths that meet the target on the way back are an interval from 0, which those that meet it on the way there are
//! not (see [`spacing`](super::spacing)). So the combined reach is not the smaller of the two: it is the largest d up to the limit
//! above that meets the target on the way there, which is [`Hop::reach`](super::spacing::Hop::reach) with that limit as the end.
//! No term cancels: s0 is a sum of squares, and the difference with b^2 has the rounding error of the SIR itself.
//!
//! # Sender that stays away from the interferer
//!
//! With gamma below A' / r the limit x0 + sqrt((A' / r) q(s0) / gamma - b^2) falls with x0 before the interferer and rises beyond: a
//! relay in front of the interferer hears the next one worse than a relay farther back. The way there is always best from the
//! closest position. So of all x0 up to the reach M of that relay, a given x needs the largest from which the way back works: M, or
//! the largest below it. Seen from x this is the problem of the last hop below, with x in place of Rx. On that branch
//! F_k / gamma = (A r / A') q(s) / q(s0), and without noise, at equal altitudes, with c^2 = A' / (r gamma) and the angle v between
//! the directions from the sender to the interferer and to the receiver
//!
//! ```text
//! s / s0 = 1 + c^2 - 2 c cos v
//! ```
//!
//! by the law of cosines. It rises with x0, while x falls. So from the combined reach of M on, x is feasible up to one point, which a
//! bisection finds. It is needed only if the way back limits the reach of M, and ends at once if a little more is infeasible.
//!
//! # Last hop
//!
//! Rx sends, and relay N receives at x. With d = D - x this is a first hop seen from Rx, with the interferer at D - X, the gain
//! A_rx of Rx's power and the target r gamma. In the notation of [`spacing`](super::spacing)
//!
//! ```text
//! f(d) = -e d^2 - 2 u d + C >= 0,    u = D - X
//! ```
//!
//! Relay N may be anywhere up to its reach M, and the way there is best at M. If f(D - M) >= 0, it takes M. Otherwise it *holds*
//! at the largest x below M that the way back allows, hence at the smallest root d above D - M where f rises:
//!
//! | e | u | root |
//! | --- | --- | --- |
//! | > 0 | < 0 | -C / (r - u), the lower one |
//! | > 0 | >= 0 | none: f falls |
//! | <= 0 | >= 0 | (u + r) / -e, the upper one |
//! | <= 0 | < 0 | C / (u - r), the upper one |
//!
//! with r = sqrt(rho u^2 + e H) as there, and none if the discriminant is negative. In each row both terms of the denominator have
//! the same sign. With noise the root is the last one of the mirrored function g(-d), which the search of
//! [`spacing`](super::spacing) finds. The other relays stop at that x too if their reaches are beyond it.
//!
//! If relay N - 1 does not reach that x on the way there, relay N goes to the largest x below that it does reach, and so on.
//!
//! Accuracy: `host-tests/tests/both_ways` compares chains with a grid search in f64.

use super::spacing::{Hop, MOST_RATIO, NoisyHop};
use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Station};
use crate::root::sqrt;
use crate::sir::{Sender, in_noise, square, transmitter_gain};

/// Maximum squared length of a hop in the computation, m^2, which prevents infinite numbers.
const MOST_SQUARED: f32 = 1e18;

/// Backward hop, for the traffic from Rx to Tx, prepared for many targets and lengths.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Back {
    /// Gain of the backward hop over r, the required ratio of backward to forward SIR. The hop's SIR is the gain
    /// times inverse interference over squared length. For a hop to Tx the gain, m^2, includes the interference at
    /// Tx.
    gain: f32,
    /// True if Tx is the receiver of this hop, false if a relay is.
    to_tx: bool,
    /// Position X of the interferer along x, m.
    interferer_x_m: f32,
    /// Squared distance of the receiver from the interferer perpendicular to x, m^2.
    aside_squared: f32,
    /// Receiver noise over the interferer's power received at 1 m: nu, 1/m^2.
    noise: f32,
}

impl Back {
    /// Returns the backward hop from a relay of `power_w` watts to a relay at `to`, or to Tx. `None` for a mission of
    /// one direction.
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

    /// Returns SIR / r of a backward hop received at `x_m`, times its squared length, m^2. r is the required ratio of
    /// backward to forward SIR. Divided by a target, the result is the hop's maximum squared length.
    pub(super) fn hears(&self, x_m: f32) -> f32 {
        if self.to_tx {
            return self.gain;
        }
        let squared = square(self.interferer_x_m - x_m) + self.aside_squared;
        self.gain * in_noise(squared, self.noise)
    }

    /// Returns the maximum length of the backward hop along x, m, for its receiver at `x_m`. `across_squared` is its
    /// squared length across the line, m^2. `None` if no length meets the target.
    pub(super) fn reach(&self, target: f32, x_m: f32, across_squared: f32) -> Option<f32> {
        let squared = (self.hears(x_m) / target).min(MOST_SQUARED) - across_squared;
        (squared >= 0.0).then(|| sqrt(squared))
    }

    /// Returns the backward hop for `target` from a sender at `x_m`, as a function of its length along x.
    /// `across_squared` is its squared length across the line, m^2.
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

    /// Returns the distance along x from the interferer below which a receiver misses `target`, m. The backward hop
    /// has the squared length `squared`, m^2. `None` if every receiver misses the target.
    pub(super) fn zone(&self, target: f32, squared: f32) -> Option<f32> {
        let needed = target * squared / self.gain;
        let left = 1.0 - self.noise * needed;
        (left > 0.0).then(|| sqrt((needed / left).min(MOST_SQUARED) - self.aside_squared))
    }
}

/// Hop from Rx to the last relay: the first hop of the traffic from Rx to Tx.
pub(super) struct FromRx {
    /// Hop from Rx in a mirrored frame: x is the distance from Rx.
    hop: Hop,
    reverse: f32,
    distance_m: f32,
}

impl FromRx {
    /// Returns the hop from Rx to the last relay, `own`. `None` for a mission of one direction.
    pub(super) fn new(mission: &Mission, own: Station) -> Option<Self> {
        let (reverse, distance_m) = (mission.reverse(), mission.config().distance_m);
        if !(reverse > 0.0) {
            return None;
        }
        let interferer = mission.known_source()?;
        let mirrored = Interferer {
            x_m: distance_m - interferer.x_m,
            ..interferer
        };
        let hop = Hop::free(
            &mirrored,
            mission.noise_at_a_metre(),
            Sender::receiver(mission),
            own.cross_section,
            distance_m,
        );
        Some(Self {
            hop,
            reverse,
            distance_m,
        })
    }

    fn at(&self, target: f32) -> NoisyHop {
        self.hop.noisy(target * self.reverse, 0.0)
    }

    /// Returns the SIR margin of the hop from Rx to the last relay at `x_m`: (SIR / required SIR - 1) D, m.
    ///
    /// `target` determines the required SIR. The factor D, the distance from Tx to Rx, makes the margin a length like
    /// the other slacks. It is below 0 if the hop misses `target`, and continuous in `target`.
    pub(super) fn margin(&self, target: f32, x_m: f32) -> f32 {
        let hop = self.at(target);
        let d = self.distance_m - x_m;
        let s = square(d - hop.ahead) + hop.aside_squared;
        let needed = hop.ratio * (square(d) + hop.across_squared) * (1.0 + hop.noise * s);
        (self.distance_m * ((s - needed) / needed)).min(1e9)
    }

    /// Returns the largest x in [`least_m`, `x_m`] at which the last relay receives Rx well enough, m. The backward
    /// SIR has to meet `target`. `None` if there is no such x. Only for an `x_m` at which the last relay misses the
    /// target.
    pub(super) fn hold(&self, target: f32, least_m: f32, x_m: f32) -> Option<f32> {
        let least = self.distance_m - x_m;
        let d = closest(&self.at(target), least, self.distance_m - least_m)?;
        let place = before(self.distance_m, d);
        (place >= least_m && place < x_m).then_some(place)
    }
}

/// Returns `x_m` - `d`, rounded so that it is at least `d` from `x_m`.
pub(super) fn before(x_m: f32, d: f32) -> f32 {
    let place = x_m - d;
    if x_m - place < d {
        place.next_down()
    } else {
        place
    }
}

/// Returns the shortest length from `least` to `most`, m, at which `hop` meets its target, or `None`.
///
/// The hop must not meet the target at `least`.
pub(super) fn closest(hop: &NoisyHop, least: f32, most: f32) -> Option<f32> {
    if !(hop.ratio <= MOST_RATIO) {
        return None;
    }
    let d = if cfg!(feature = "noise") && hop.noise > 0.0 {
        let mirrored = NoisyHop {
            ahead: -hop.ahead,
            ..*hop
        };
        -mirrored.last(-hop.through_noise()?.min(most), -least)?
    } else {
        rising_root(hop)?
    };
    (d >= least && d <= most).then_some(d)
}

/// Returns the length, m, at which a noise-free hop begins to meet its target as it gets longer. `None` if there is
/// none; the length may be negative. The hop's margin to its target is 0 there, and rises.
fn rising_root(hop: &NoisyHop) -> Option<f32> {
    let (u, e) = (hop.ahead, hop.excess);
    let h = hop.base - e * hop.across_squared;
    let c = square(u) + h;
    let discriminant = hop.ratio * square(u) + e * h;
    if discriminant < 0.0 {
        return None;
    }
    let r = sqrt(discriminant);
    match (e > 0.0, u >= 0.0) {
        (true, true) => None,
        (true, false) => Some(-c / (r - u)),
        (false, true) => Some((u + r) / -e),
        (false, false) => Some(c / (u - r)),
    }
}

#[cfg(all(test, feature = "reverse"))]
mod tests {
    use super::{FromRx, NoisyHop, closest};
    use crate::mission::tests::paper;
    use crate::mission::{Interference, Interferer, Mission, MissionConfig, Profile};

    /// Returns the smallest hop length at which `hop` meets its target, m, by trial in fine steps. The test compares
    /// [`closest`] with it.
    fn scanned(hop: &NoisyHop, least: f32, most: f32) -> Option<f32> {
        let step = (most - least) / 20_000.0;
        (0..=20_000_u16)
            .map(|i| least + f32::from(i) * step)
            .find(|d| hop.is_met(*d))
    }

    #[test]
    fn the_closest_distance_agrees_with_a_scan() {
        let noises: &[f32] = if cfg!(feature = "noise") {
            &[0.0, 1e-7, 1e-5, 1e-3]
        } else {
            &[0.0]
        };
        let mut found = 0;
        for ratio in [0.01_f32, 0.3, 0.99, 1.0, 1.01, 3.0, 40.0] {
            for ahead in [-300.0, -1.0, 0.0, 20.0, 400.0] {
                for (aside, across) in [(10.0_f32, 0.0_f32), (10.0, 30.0), (200.0, 20.0)] {
                    for (&noise, least) in noises
                        .iter()
                        .flat_map(|noise| [5.0_f32, 100.0, 300.0].map(|m| (noise, m)))
                    {
                        let (aside_squared, across_squared) = (aside * aside, across * across);
                        let hop = NoisyHop {
                            ratio,
                            excess: ratio - 1.0,
                            ahead,
                            aside_squared,
                            across_squared,
                            base: aside_squared - across_squared,
                            noise,
                        };
                        if hop.is_met(least) {
                            continue;
                        }
                        let ours = closest(&hop, least, 1000.0);
                        let theirs = scanned(&hop, least, 1000.0);
                        let far = ours.zip(theirs).map(|(a, b)| (a - b).abs());
                        let agrees =
                            ours.is_some() == theirs.is_some() && far.is_none_or(|far| far < 0.06);
                        assert!(agrees, "{ours:?} {theirs:?} of {hop:?}");
                        found += u32::from(ours.is_some());
                    }
                }
            }
        }
        assert!(found > 12, "{found}");
    }

    /// Checks that the last relay is placed farther from Rx, at an x at which it receives Rx well enough. At x = 650
    /// m, where the search begins, a strong interferer at x = 700 m prevents that. Rx is at x = 1000 m.
    #[test]
    fn the_last_relay_holds_where_it_hears_rx_again() {
        let common = Profile {
            altitude_m: 20.0,
            power_w: 1.0,
        };
        let interferer = Interferer {
            power_w: 10.0,
            x_m: 700.0,
            y_m: 30.0,
        };
        let mission = Mission::try_new(MissionConfig {
            interference: Interference::Source(interferer),
            reverse: 0.5,
            rx_power_w: 5.0,
            common,
            ..paper(3)
        })
        .unwrap();
        let hop = FromRx::new(&mission, common.on_line()).unwrap();
        let target = 0.1;
        assert!(hop.margin(target, 650.0) < 0.0);
        let place = hop.hold(target, 0.0, 650.0).unwrap();
        assert!(hop.margin(target, place) >= 0.0, "{place}");
        assert!(hop.margin(target, place + 0.1) < 0.0, "{place}");
        assert!(hop.margin(target, 950.0) > 0.0);
        assert_eq!(hop.hold(target, place + 1.0, 650.0), None);
    }
}
