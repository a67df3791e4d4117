//! How SIR_1 behaves along x beyond Tx, x >= 0, at one altitude: the paper's Lemma 2, for any place of the interferer and with noise.
//!
//! With s = (X - x)^2 + Y^2 + h^2 and q = X^2 + Y^2 the slope of SIR_1 = A s / ((x^2 + h^2)(1 + nu s)) has the sign of
//!
//! ```text
//! X x^2 - q x - X h^2 - nu x s^2
//! ```
//!
//! Without noise that is a quadratic, whose roots are (q +- sqrt(q^2 + 4 X^2 h^2)) / 2X: one of them lies beyond Tx. With noise:
//!
//! - X < 0: it falls with x from -X h^2 > 0 at Tx, so SIR_1 still has one hill, nearer to Tx.
//! - X = 0: it is negative.
//! - X > 0: over x it is phi = X x - q - X h^2 / x - nu s^2, which is concave, for s is convex and not negative, and so is s^2. So
//!   SIR_1 falls up to a valley, rises up to a hill and falls for good, or only falls. No root lies before the noise-free valley,
//!   where the first three terms are negative.
//!
//! The largest SIR_1 in [0, D] for X >= 0 is that right above Tx, as without noise: anywhere else s / (x^2 + h^2) is less; where s is
//! larger, 1 / (1 + nu s) is less too, and where s is smaller, q(s) = s / (1 + nu s) is less and x^2 + h^2 is more.

use super::{Sender, square};
use crate::mission::{Interferer, Mission};
use crate::place::Placement;
use crate::root::sqrt;

/// Halvings of a stretch in which the slope changes its sign.
const HALVINGS: u8 = 32;

/// Doublings until something that falls is below 0.
const DOUBLINGS: u8 = 64;

/// How SIR_1 behaves along x beyond Tx, x >= 0, at one altitude.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extremum {
    /// It falls up to there, m, the paper's Psi^x, and rises beyond: the interferer is ahead of Tx (X > 0).
    Valley(f32),
    /// It falls up to the first, rises up to the second, m, and falls beyond: so it is with noise and the interferer ahead of Tx.
    ValleyAndHill(f32, f32),
    /// It rises up to there, m, and falls beyond: the interferer is behind Tx (X < 0).
    Hill(f32),
    /// It falls for good: X = 0, or the interferer is ahead of Tx and drowned by the noise.
    Falls,
    /// It is the same everywhere: the interferer stands at Tx, X = Y = 0, and there is no noise.
    Level,
}

/// Where SIR_1 of a relay at `altitude_m` turns along x.
///
/// Without noise by the roots of a quadratic, for X < 0 written without cancellation; with it by at most 190 evaluations of the slope.
/// Accuracy: `turns_agree_with_a_scan` in `host-tests/tests/theorems/`.
pub fn first_hop_turn(mission: &Mission, interferer: &Interferer, altitude_m: f32) -> Extremum {
    let x = interferer.x_m;
    let q = square(x) + square(interferer.y_m);
    let root = sqrt(square(q) + square(2.0 * x * altitude_m));
    let slope = Slope {
        x,
        q,
        squared: square(altitude_m),
        aside: square(interferer.y_m) + square(altitude_m),
        noise: mission.noise_at_a_metre(),
    };
    if x > 0.0 {
        slope.turns((q + root) / (2.0 * x))
    } else if x < 0.0 {
        slope.hill(-2.0 * x * square(altitude_m) / (q + root))
    } else if q > 0.0 || slope.noise > 0.0 {
        Extremum::Falls
    } else {
        Extremum::Level
    }
}

/// The slope's sign along x.
struct Slope {
    /// X, m.
    x: f32,
    q: f32,
    /// h^2, m^2.
    squared: f32,
    /// Y^2 + h^2, m^2.
    aside: f32,
    /// nu, 1/m^2.
    noise: f32,
}

impl Slope {
    /// phi at `at` above 0.
    fn sign(&self, at: f32) -> f32 {
        let s = square(at - self.x) + self.aside;
        self.x * at - self.q - self.x * (self.squared / at) - self.noise * s * s
    }

    /// Half the slope of phi, for X > 0: it falls beyond X.
    fn bend(&self, at: f32) -> f32 {
        let s = square(at - self.x) + self.aside;
        0.5 * (self.x + self.x * (self.squared / square(at))) - 2.0 * self.noise * s * (at - self.x)
    }

    /// For X < 0, with the hill that there is without noise.
    fn hill(&self, peak: f32) -> Extremum {
        if !(self.noise > 0.0) {
            return Extremum::Hill(peak);
        }
        Extremum::Hill(last(0.0, peak, |at| self.sign(at) > 0.0))
    }

    /// For X > 0, with the valley that there is without noise.
    fn turns(&self, bottom: f32) -> Extremum {
        if !(self.noise > 0.0) {
            return Extremum::Valley(bottom);
        }
        let rises = |at: f32| self.bend(at) > 0.0;
        if !rises(bottom) {
            return Extremum::Falls;
        }
        let top = last(bottom, beyond(bottom, rises), rises);
        let above = |at: f32| self.sign(at) > 0.0;
        if !above(top) {
            return Extremum::Falls;
        }
        let valley = last(bottom, top, |at| !above(at));
        Extremum::ValleyAndHill(valley, last(top, beyond(top, above), above))
    }
}

/// The last place in [`low`, `high`] at which `holds`, which does at `low` and changes once.
fn last(low: f32, high: f32, holds: impl Fn(f32) -> bool) -> f32 {
    let (mut low, mut high) = (low, high);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// A place beyond `from` at which it does not hold any more.
fn beyond(from: f32, holds: impl Fn(f32) -> bool) -> f32 {
    let mut at = 2.0 * from;
    for _ in 0..DOUBLINGS {
        if !holds(at) {
            break;
        }
        at *= 2.0;
    }
    at
}

/// The largest SIR that a relay at `altitude_m` can have on the first hop, over all x in [0, D].
///
/// At x = 0 for an interferer at X >= 0 (the paper's Lemma 2 and `gamma_0`), for X < 0 at the hill of [`first_hop_turn`]; so it is with noise. In a
/// field it is a bound: the quietest place right above the transmitter. The lower the altitude, the larger it is.
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
