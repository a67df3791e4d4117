//! Hop from Rx to the last relay: the largest x at which this relay receives Rx well enough.
//!
//! Rx sends, and relay N receives at x. With d = D - x this is a first hop seen from Rx, with the interferer at D - X, the gain
//! A_rx of Rx's power and the target r gamma, in the notation of [`reverse`](super::reverse). With e, C and H of [`spacing`](super::spacing)
//!
//! ```text
//! f(d) = -e d^2 - 2 u d + C >= 0,    u = D - X
//! ```
//!
//! Relay N may be anywhere up to its reach M. Data toward Rx are received best if it is at M. If f(D - M) >= 0, it
//! takes M. Otherwise it *holds* at the largest x below M at which it receives Rx well enough. That is the smallest
//! root d above D - M where f rises:
//!
//! | e | u | root |
//! | --- | --- | --- |
//! | > 0 | < 0 | -C / (r - u), the lower one |
//! | > 0 | >= 0 | none: f falls |
//! | <= 0 | >= 0 | (u + r) / -e, the upper one |
//! | <= 0 | < 0 | C / (u - r), the upper one |
//!
//! with r = sqrt(rho u^2 + e H) as there, none if the discriminant is negative. In each row both terms of the denominator have
//! the same sign. With noise the root is the last one of the mirrored function g(-d), which the search of
//! [`noisy_hop`](super::noisy_hop) finds. The other relays stay at that x too if their reaches are beyond it.
//!
//! If relay N - 1 does not reach that x with data toward Rx, relay N goes to the largest x below that it does reach,
//! and so on.
//!
//! Accuracy: `host-tests/tests/both_ways` compares chains with a grid search in f64.

use super::noisy_hop::{NoisyHop, before, closest};
use super::spacing::Hop;
use crate::mission::{Interferer, Mission};
use crate::place::Station;
use crate::sir::{Sender, square};

/// Hop from Rx to the last relay: the first hop of the data that flow from Rx to Tx.
pub(super) struct FromRx {
    /// Hop from Rx in a mirrored coordinate frame: x is the distance from Rx.
    hop: Hop,
    reverse: f32,
    distance_m: f32,
}

impl FromRx {
    /// Returns the hop from Rx to the last relay, `own`. `None` for a mission without data from Rx to Tx.
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

    /// Returns the margin of the hop from Rx to the last relay at `x_m`: (SIR / required SIR - 1) D, m.
    ///
    /// D is the distance from Tx to Rx. The required SIR is `target` times the mission's ratio `reverse`. The margin is
    /// below 0 if the hop misses the required SIR. The margin is a continuous function of `target`.
    pub(super) fn margin(&self, target: f32, x_m: f32) -> f32 {
        let hop = self.at(target);
        let d = self.distance_m - x_m;
        let s = square(d - hop.ahead) + hop.aside_squared;
        let needed = hop.ratio * (square(d) + hop.across_squared) * (1.0 + hop.noise * s);
        (self.distance_m * ((s - needed) / needed)).min(1e9)
    }

    /// Returns the largest x in [`least_m`, `x_m`], m, at which the hop from Rx has the required SIR. The required SIR
    /// is `target` times the mission's ratio `reverse`. The SIR at `x_m` must be below the required one. `None` if
    /// there is no such x.
    pub(super) fn hold(&self, target: f32, least_m: f32, x_m: f32) -> Option<f32> {
        let least = self.distance_m - x_m;
        let d = closest(&self.at(target), least, self.distance_m - least_m)?;
        let place = before(self.distance_m, d);
        (place >= least_m && place < x_m).then_some(place)
    }
}

#[cfg(all(test, feature = "reverse"))]
mod tests {
    use super::FromRx;
    use crate::mission::tests::paper;
    use crate::mission::{Interference, Interferer, Mission, MissionConfig, Profile};

    /// Checks that the last relay gets an x below 650 m if its SIR from Rx is too low at 650 m. A strong interferer is
    /// at x = 700 m, and Rx at x = 1000 m.
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
