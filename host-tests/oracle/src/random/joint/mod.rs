//! Random scenarios of the joint problem: relays choose their altitudes within a range.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | D | log-uniform, 100 m to 10 km |
//! | N | half uniform, half log-uniform over the range asked for |
//! | X | 80 % uniform in [0, D]; 10 % within 0.05 D of an end, either side; 5 % each in [-D, 0] and [D, 2 D] |
//! | Y | 70 % log-uniform 0.003 D to 0.1 D; else log-uniform 0.1 D to D |
//! | lowest altitude | log-uniform 0.005 D to 0.05 D |
//! | highest altitude | log-uniform from twice the lowest to 0.5 D |
//! | relay power | log-uniform 0.1 W to 10 W, all relays alike |
//! | Tx power | 80 % log-uniform 0.3 to 10 times a relay's; else 10 to 100 times |
//! | interferer power | log-uniform 1 to 300 times a relay's |
//! | channel | 50 % the paper's (2 GHz) with eta = `mu_los`; else `mu_los` = 1, `mu_nlos` log-uniform 1 to 100, eta log-uniform from 1 to the lesser of 10 and `mu_nlos` |
//! | minimum separation | half 0; else log-uniform 0.01 to 0.1 times D / (N + 1), or 0.03 to 0.3 where asked for |
//!
//! In many scenarios relays gain by different altitudes: Tx is seldom so strong that the first hop does not matter, and
//! the interferer is often close to the line Tx-Rx. In about a third the best chain is more than 1 % better than the
//! best chain at a common altitude.
//!
//! [`in_space`] also draws lateral positions and limits:
//!
//! | quantity | distribution |
//! | --- | --- |
//! | Y | as above, with either sign |
//! | lateral limits | a third: both 0; else left and right independently: 15 % 0; else log-uniform 0.005 D to 0.4 D |
//! | altitudes | with lateral limits, 15 %: only the lowest altitude |
//! | minimum separation | half as in [`ROOMY`], half as in [`CROWDED`] |
//!
//! [`with_own`] lets relays differ:
//!
//! | quantity | distribution |
//! | --- | --- |
//! | powers | in half of the scenarios, for each relay 15 %: log-uniform 0.3 to 3 times the common one |
//! | fixed relays | in half of the scenarios, for each relay 10 %: y and altitude uniform within the limits |

pub mod judged;

use std::ops::RangeInclusive;

use rand::{Rng, RngExt};

use super::log_uniform;
use crate::mission::as_relays_know_it;
use crate::reference::joint::{Corridor, FixedCrossSection};
use crate::reference::{Link, Relay};
use uav_relay_scenario::number::narrow;

/// Random link, and the corridor in which its relays choose positions.
///
/// The corridor limits altitude and lateral position. Before the choice, all relays of the link have the lowest
/// altitude.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Chain of relays with Tx, Rx and interferer.
    pub link: Link,
    /// Altitudes and lateral positions that the relays may choose.
    pub corridor: Corridor,
    /// Relays whose lateral position and altitude are fixed.
    pub held: Vec<FixedCrossSection>,
}

impl Scenario {
    /// Returns the scenario with every number rounded to f32, as a relay stores it.
    #[must_use]
    pub fn as_relays_know_it(&self) -> Self {
        let round = |value: f64| f64::from(narrow(value));
        let held = self.held.iter().map(|hold| FixedCrossSection {
            y_m: round(hold.y_m),
            altitude_m: round(hold.altitude_m),
            ..*hold
        });
        Self {
            link: as_relays_know_it(&self.link),
            corridor: Corridor {
                least_m: round(self.corridor.least_m),
                most_m: round(self.corridor.most_m),
                left_m: round(self.corridor.left_m),
                right_m: round(self.corridor.right_m),
            },
            held: held.collect(),
        }
    }
}

/// Range of minimum separations that seldom limit a chain, as fractions of the equal spacing.
///
/// The equal spacing of N relays is D / (N + 1); D is the distance from Tx to Rx.
pub const ROOMY: (f64, f64) = (0.01, 0.1);

/// Range of minimum separations that limit more chains than [`ROOMY`], as fractions of equal spacing.
///
/// The equal spacing of N relays is D / (N + 1); D is the distance from Tx to Rx. In about a tenth of these scenarios
/// the minimum separation lowers the optimum SIR.
pub const CROWDED: (f64, f64) = (0.03, 0.3);

/// Draws a random scenario by the module's first table.
///
/// `relays` is a range within 1 to 1000; `apart` is [`ROOMY`] or [`CROWDED`].
pub fn scenario(rng: &mut impl Rng, relays: &RangeInclusive<u32>, apart: (f64, f64)) -> Scenario {
    let d = log_uniform(rng, 100.0, 1e4);
    let n = count(rng, relays);
    let (mu_los, mu_nlos, eta) = channel(rng);
    let relay_w = log_uniform(rng, 0.1, 10.0);
    let tx_w = relay_w
        * if rng.random_bool(0.8) {
            log_uniform(rng, 0.3, 10.0)
        } else {
            log_uniform(rng, 10.0, 100.0)
        };
    let interferer_w = relay_w * log_uniform(rng, 1.0, 300.0);
    let least_m = d * log_uniform(rng, 0.005, 0.05);
    let relay = Relay {
        altitude_m: least_m,
        power_w: relay_w,
    };
    let min_separation_m = if rng.random() {
        0.0
    } else {
        d / (f64::from(n) + 1.0) * log_uniform(rng, apart.0, apart.1)
    };
    let link = Link {
        distance_m: d,
        min_separation_m,
        tx_w,
        interferer_w,
        x_i: d * along(rng),
        y_i: d * aside(rng),
        mu_los,
        mu_nlos,
        eta,
        noise_w: 0.0,
        relays: (0..n).map(|_| relay).collect(),
    };
    let most_m = log_uniform(rng, 2.0 * least_m, 0.5 * d);
    let corridor = Corridor::plane(least_m, most_m);
    Scenario {
        link,
        corridor,
        held: Vec::new(),
    }
}

/// Draws a random scenario with lateral positions, by the module's second table.
///
/// `relays` is a range within 1 to 1000.
pub fn in_space(rng: &mut impl Rng, relays: &RangeInclusive<u32>) -> Scenario {
    let apart = if rng.random() { ROOMY } else { CROWDED };
    let mut drawn = scenario(rng, relays, apart);
    if rng.random() {
        drawn.link.y_i = -drawn.link.y_i;
    }
    if rng.random_range(0..3) > 0 {
        let mut side = || {
            if rng.random_bool(0.15) {
                0.0
            } else {
                drawn.link.distance_m * log_uniform(rng, 0.005, 0.4)
            }
        };
        (drawn.corridor.left_m, drawn.corridor.right_m) = (-side(), side());
        if rng.random_bool(0.15) {
            drawn.corridor.most_m = drawn.corridor.least_m;
        }
    }
    drawn
}

/// Returns the scenario with different relays, by the last table of this module's documentation.
///
/// In some scenarios some relays get another power, in some the lateral position and altitude of some relays are fixed.
#[must_use]
pub fn with_own(rng: &mut impl Rng, mut of: Scenario) -> Scenario {
    let (powers, holds): (bool, bool) = (rng.random(), rng.random());
    let room = of.corridor;
    for (relay, station) in of.link.relays.iter_mut().enumerate() {
        if powers && rng.random_bool(0.15) {
            station.power_w *= log_uniform(rng, 0.3, 3.0);
        }
        if holds && rng.random_bool(0.1) {
            of.held.push(FixedCrossSection {
                relay,
                y_m: rng.random_range(room.left_m..=room.right_m),
                altitude_m: rng.random_range(room.least_m..=room.most_m),
            });
        }
    }
    of
}

fn count(rng: &mut impl Rng, relays: &RangeInclusive<u32>) -> u32 {
    if rng.random() {
        return rng.random_range(relays.clone());
    }
    let (fewest, most) = (*relays.start(), *relays.end());
    let draw = log_uniform(rng, f64::from(fewest), f64::from(most) + 0.999);
    relays
        .clone()
        .rev()
        .find(|&n| f64::from(n) <= draw)
        .unwrap_or(fewest)
}

/// Draws the interferer's x as a fraction of the distance from Tx to Rx: from -1 to 2, mostly 0 to 1.
fn along(rng: &mut impl Rng) -> f64 {
    match rng.random_range(0..40) {
        0..32 => rng.random_range(0.0..=1.0),
        32..36 => {
            let end = if rng.random() { 0.0 } else { 1.0 };
            end + rng.random_range(-0.05..=0.05)
        }
        36..38 => rng.random_range(-1.0..=0.0),
        _ => rng.random_range(1.0..=2.0),
    }
}

/// Draws the interferer's distance from the line Tx-Rx, as a fraction of the distance Tx-Rx.
fn aside(rng: &mut impl Rng) -> f64 {
    if rng.random_bool(0.7) {
        log_uniform(rng, 0.003, 0.1)
    } else {
        log_uniform(rng, 0.1, 1.0)
    }
}

fn channel(rng: &mut impl Rng) -> (f64, f64, f64) {
    if rng.random() {
        let Link {
            mu_los, mu_nlos, ..
        } = Link::paper(0);
        return (mu_los, mu_nlos, mu_los);
    }
    let mu_nlos = log_uniform(rng, 1.0, 100.0);
    (1.0, mu_nlos, log_uniform(rng, 1.0, mu_nlos.min(10.0)))
}
