//! Signal-to-interference ratio of every kind of hop: the one place these formulas live.
//!
//! The chain is as good as its worst hop: `SIR_S` = min over hops (paper, section "Position planning for multiple UAVs").
//! All SIRs are linear power ratios. Accuracy against f64 is asserted by `hop_sirs_agree_with_the_reference` in
//! `host-tests/tests/placement.rs`.

use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement, Station};
use crate::power_ratio::PowerRatio;
use crate::root::sqrt;

/// How little is heard of the interference at `at`, as a relay there sees it: the one term in which kinds of it differ.
///
/// (X - x)^2 + (Y - y)^2 + h^2 in m^2 for an interferer; Upsilon(x) / `Upsilon_max`, 0 to 1, in a field. The SIR of a hop into
/// that place is the sender's gain times this, over the squared length of the hop.
pub fn quiet(mission: &Mission, at: Placement) -> f32 {
    match mission.interferer() {
        Some(interferer) => {
            square(interferer.x_m - at.x_m)
                + square(interferer.y_m - at.y_m)
                + square(at.altitude_m)
        }
        None => mission
            .field()
            .map_or(1.0, |field| field.upsilon(at.x_m) / field.largest()),
    }
}

/// A node that feeds a hop: where it stands and what its power is worth against the interference.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sender {
    pub(crate) at: CrossSection,
    pub(crate) gain: PowerRatio,
}

impl Sender {
    /// The ground transmitter, node 0.
    pub const fn transmitter(mission: &Mission) -> Self {
        Self {
            at: CrossSection::on_line(0.0),
            gain: mission.tx_gain(),
        }
    }

    /// A relay.
    pub const fn relay(mission: &Mission, relay: Station) -> Self {
        Self {
            at: relay.at,
            gain: mission.relay_gain(relay.power_w),
        }
    }

    /// SIR at a relay at `to`, fed by this node standing at `from_m` along x; infinite when both share one place.
    ///
    /// With s = X - x0: A ((s - d)^2 + (Y - y)^2 + h^2) / (d^2 + (y - y0)^2 + (h - h0)^2), which with y = y0 = 0 is the paper's
    /// `SIR_1` for h0 = 0 and A = `p_t` / `p_MSI`, and its `SIR_i` for A = (`p_u` / `p_MSI`)(eta / `mu_los`). In a field it is the expected SIR,
    /// p Upsilon(x) / (eta d^2) and p Upsilon(x) / (`mu_los` d^2).
    pub fn sir_at(&self, mission: &Mission, from_m: f32, to: Placement) -> f32 {
        let step = to.x_m - from_m;
        let across = to.cross_section().apart_squared(self.at);
        self.gain.value() * quiet(mission, to) / (square(step) + across)
    }
}

/// SIR at the ground receiver, fed by a relay of `power_w` watts at `from`: K / (d^2 + y^2 + h^2), the paper's `SIR_{N+1}`.
pub fn at_receiver(mission: &Mission, from: Placement, power_w: f32) -> f32 {
    let distance = mission.config().distance_m - from.x_m;
    let across = square(from.y_m) + square(from.altitude_m);
    mission.receiver_gain(power_w) / (square(distance) + across)
}

/// How SIR_1 behaves along x beyond Tx, x >= 0, at one altitude: the paper's Lemma 2, for any place of the interferer.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Extremum {
    /// It falls up to there, m, the paper's Psi^x, and rises beyond: the interferer is ahead of Tx (X > 0).
    Valley(f32),
    /// It rises up to there, m, and falls beyond: the interferer is behind Tx (X < 0).
    Hill(f32),
    /// It falls for good: X = 0.
    Falls,
    /// It is the same everywhere: the interferer stands at Tx, X = Y = 0.
    Level,
}

/// Where SIR_1 of a relay at `altitude_m` turns along x.
///
/// The stationary points of SIR_1 are (q +- sqrt(q^2 + 4 X^2 h^2)) / 2X with q = X^2 + Y^2, of which one lies beyond Tx; for
/// X < 0 it is written without cancellation. Accuracy: `turns_agree_with_a_scan` in `host-tests/tests/theorems/`.
pub fn first_hop_turn(interferer: &Interferer, altitude_m: f32) -> Extremum {
    let x = interferer.x_m;
    let q = square(x) + square(interferer.y_m);
    let root = sqrt(square(q) + square(2.0 * x * altitude_m));
    if x > 0.0 {
        Extremum::Valley((q + root) / (2.0 * x))
    } else if x < 0.0 {
        Extremum::Hill(-2.0 * x * square(altitude_m) / (q + root))
    } else if q > 0.0 {
        Extremum::Falls
    } else {
        Extremum::Level
    }
}

/// The largest SIR that a relay at `altitude_m` can have on the first hop, over all x in [0, D].
///
/// At x = 0 for an interferer at X >= 0 (the paper's Lemma 2 and `gamma_0`), for X < 0 at the hill of [`first_hop_turn`]. In a
/// field it is a bound: the quietest place right above the transmitter. The lower the altitude, the larger it is.
pub fn first_hop_ceiling(mission: &Mission, altitude_m: f32) -> f32 {
    let Some(interferer) = mission.interferer() else {
        return mission.tx_gain().value() / square(altitude_m);
    };
    let x_m = match first_hop_turn(interferer, altitude_m) {
        Extremum::Hill(peak) => peak.min(mission.config().distance_m),
        _ => 0.0,
    };
    Sender::transmitter(mission).sir_at(mission, 0.0, Placement::on_line(x_m, altitude_m))
}

pub(crate) const fn square(x: f32) -> f32 {
    x * x
}

#[cfg(test)]
mod tests {
    use super::{Placement, Sender, first_hop_ceiling};
    use crate::mission::tests::paper;
    use crate::mission::{Interference, Interferer, Mission, MissionConfig};

    #[test]
    fn the_ceiling_of_the_first_hop_is_never_below_what_a_scan_finds() {
        for (x_m, y_m, altitude_m) in [
            (500.0, 400.0, 20.0),
            (-10.0, 0.0, 50.0),
            (-300.0, 200.0, 80.0),
            (-1e5, 3.0, 900.0),
        ] {
            let interferer = Interferer {
                power_w: 80.0,
                x_m,
                y_m,
            };
            let mission = Mission::try_new(MissionConfig {
                interference: Interference::Source(interferer),
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
                "{x_m} {y_m} {altitude_m}: {ceiling} against {best}"
            );
            assert!(ceiling >= best * (1.0 - 1e-6));
        }
    }
}
