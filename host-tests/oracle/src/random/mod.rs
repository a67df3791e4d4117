//! Random scenarios for property tests. Many are close to the values at which formulas break.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | D | log-uniform, 10 m to 100 km |
//! | N | log-uniform over the style's range |
//! | X | 40 % uniform in [0, D]; 10 % each: exactly 0; exactly D; within 1e-6 D to 0.01 D of an end, either side; in [-D, 0]; in [D, 2 D]; 2 D to 100 D away, either side |
//! | Y | 25 % exactly 0; 15 % log-uniform 1e-6 D to 0.01 D; else log-uniform 0.01 D to 3 D |
//! | h | log-uniform 0.002 D to 0.5 D, then bounded to 1 m to 5 km |
//! | Tx, interferer power | log-uniform 0.1 W to 1 kW; equal in 15 % |
//! | relay power | log-uniform 0.01 W to 100 W |
//! | channel | 75 % the paper's (2 GHz); else `mu_los` = 1, `mu_nlos` = log-uniform 1 to 1000 |
//! | eta | a third each: `mu_los`, `mu_nlos`, a uniform mixture |
//! | relays | alike, or each with its own power (0.1 to 10 times) and / or altitude (0.5 to 2 times, bounded as h), by style |
//! | minimum separation | 0 |
//!
//! X = D with Y = 0 (2.5 %) puts the interferer on Rx: the SIR of every chain is 0 and there is no optimum.

pub mod joint;

use std::ops::RangeInclusive;

use rand::{Rng, RngExt};

use crate::reference::{Link, Relay, path_loss_factor};

/// Kind of differences between the relays of a random chain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Chain {
    /// Relays with the same power and altitude.
    Alike,
    /// Relays that differ in power.
    OwnPower,
    /// Relays that differ in altitude.
    OwnAltitude,
    /// Relays that differ in both power and altitude.
    Own,
    /// Random kind for each link: all relays equal with probability 1/2, every other kind with 1/6.
    Any,
}

/// Kind of random links: number of relays, and differences between them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Style {
    /// Smallest and largest number of relays, >= 1.
    pub relays: RangeInclusive<u32>,
    /// Differences between the relays of a random link.
    pub chain: Chain,
}

impl Style {
    /// Links of 1 to 50 equal relays.
    pub const ALIKE: Self = Self {
        relays: 1..=50,
        chain: Chain::Alike,
    };
    /// Links of 1 to 50 relays. The relays of a link have equal or different powers and altitudes.
    pub const ANY: Self = Self {
        relays: 1..=50,
        chain: Chain::Any,
    };
}

/// Draws a random link by the module's table.
pub fn link(rng: &mut impl Rng, style: &Style) -> Link {
    let distance_m = log_uniform(rng, 10.0, 1e5);
    let altitude_m = bounded(log_uniform(rng, 0.002, 0.5) * distance_m);
    let (mu_los, mu_nlos, eta) = channel(rng);
    let tx_w = log_uniform(rng, 0.1, 1e3);
    let interferer_w = if rng.random_bool(0.15) {
        tx_w
    } else {
        log_uniform(rng, 0.1, 1e3)
    };
    let common = Relay {
        altitude_m,
        power_w: log_uniform(rng, 0.01, 100.0),
    };
    Link {
        distance_m,
        min_separation_m: 0.0,
        tx_w,
        interferer_w,
        x_i: along(rng, distance_m),
        y_i: aside(rng) * distance_m,
        mu_los,
        mu_nlos,
        eta,
        noise_w: 0.0,
        relays: relays(rng, style, common),
    }
}

/// Returns `link` with added receiver noise.
///
/// The noise is 1e-6 to 1e4 times the interference power at a random relay position, and at most as large as a mission
/// accepts.
pub fn in_noise(rng: &mut impl Rng, link: &Link) -> Link {
    let place = rng.random_range(0.0..=link.distance_m);
    let altitude_m = link.relays.first().map_or(1.0, |relay| relay.altitude_m);
    let squared = (place - link.x_i).powi(2) + link.y_i.powi(2) + altitude_m.powi(2);
    let arrives_w = link.interferer_w / link.eta / squared;
    let noise_w = arrives_w * log_uniform(rng, 1e-6, 1e4);
    Link {
        noise_w: noise_w.min(1.0).min(9e11 * link.interferer_w / link.eta),
        ..link.clone()
    }
}

/// Returns and prints the seed of a random test.
///
/// It is the environment variable `SEED`. If `SEED` is not a number, the seed is `default`.
pub fn seed(default: u64) -> u64 {
    let seed = std::env::var("SEED")
        .ok()
        .and_then(|text| text.trim().parse().ok())
        .unwrap_or(default);
    println!("SEED={seed}");
    seed
}

/// Returns the number of random problems in a test.
///
/// It is the environment variable `COUNT`. If `COUNT` is not a number, it is `usual`.
pub fn count(usual: usize) -> usize {
    let count = std::env::var("COUNT").ok();
    count.and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// Draws a number between `low` and `high`, both > 0, uniform in its logarithm.
pub fn log_uniform(rng: &mut impl Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low.ln()..=high.ln())
        .exp()
        .clamp(low, high)
}

fn bounded(altitude_m: f64) -> f64 {
    altitude_m.clamp(1.0, 5000.0)
}

fn channel(rng: &mut impl Rng) -> (f64, f64, f64) {
    let (los, nlos) = if rng.random_bool(0.75) {
        (
            path_loss_factor(2e9, 10_f64.powf(0.01)),
            path_loss_factor(2e9, 10_f64.powf(2.1)),
        )
    } else {
        (1.0, log_uniform(rng, 1.0, 1e3))
    };
    let eta = match rng.random_range(0..3) {
        0 => los,
        1 => nlos,
        _ => {
            let share = rng.random_range(0.0..=1.0);
            share * los + (1.0 - share) * nlos
        }
    };
    (los, nlos, eta)
}

fn along(rng: &mut impl Rng, d: f64) -> f64 {
    match rng.random_range(0..10) {
        0 => 0.0,
        1 => d,
        2 => {
            let end = if rng.random() { 0.0 } else { d };
            let side = if rng.random() { 1.0 } else { -1.0 };
            end + side * d * log_uniform(rng, 1e-6, 0.01)
        }
        3 => -d * rng.random_range(0.0..=1.0),
        4 => d * rng.random_range(1.0..=2.0),
        5 => {
            let away = d * log_uniform(rng, 2.0, 100.0);
            if rng.random() { d + away } else { -away }
        }
        _ => d * rng.random_range(0.0..=1.0),
    }
}

/// Draws the interferer's distance from the line Tx-Rx, as a fraction of the distance Tx-Rx.
fn aside(rng: &mut impl Rng) -> f64 {
    match rng.random_range(0..100) {
        0..25 => 0.0,
        25..40 => log_uniform(rng, 1e-6, 0.01),
        _ => log_uniform(rng, 0.01, 3.0),
    }
}

fn relays(rng: &mut impl Rng, style: &Style, common: Relay) -> Vec<Relay> {
    let (fewest, most) = (*style.relays.start(), *style.relays.end());
    let draw = log_uniform(rng, f64::from(fewest), f64::from(most) + 0.999);
    let n = (fewest..=most)
        .rev()
        .find(|&n| f64::from(n) <= draw)
        .unwrap_or(fewest);
    let chain = match style.chain {
        Chain::Any => match rng.random_range(0..6) {
            0 => Chain::OwnPower,
            1 => Chain::OwnAltitude,
            2 => Chain::Own,
            _ => Chain::Alike,
        },
        fixed => fixed,
    };
    (0..n)
        .map(|_| {
            let mut relay = common;
            if matches!(chain, Chain::OwnPower | Chain::Own) {
                relay.power_w *= log_uniform(rng, 0.1, 10.0);
            }
            if matches!(chain, Chain::OwnAltitude | Chain::Own) {
                relay.altitude_m = bounded(relay.altitude_m * log_uniform(rng, 0.5, 2.0));
            }
            relay
        })
        .collect()
}
