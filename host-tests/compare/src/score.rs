//! Evaluation of a solver's chain: its SIR by separate formulas, if it satisfies the constraints.

use std::fmt;

use uav_relay_oracle::reference::Link;
use uav_relay_oracle::reference::joint::{Corridor, Place, sir};

use crate::results::{Mark, Solution};

/// Maximum relative difference from the optimum SIR for a good chain.
///
/// The target SIR of this crate's mission has the same tolerance.
pub(crate) const GOOD: f64 = 1e-4;

/// Tolerance of a position, m: 16 times the rounding error of an f32 near 1000 m.
const SLACK_M: f64 = 1e-3;

/// Relative tolerance of a reported SIR: ten times the rounding error of the relays' f32 formulas.
const SIR_SLACK: f64 = 1e-5;

/// Reason why a solver's chain does not count.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Refusal {
    Count(usize),
    /// A relay is not between transmitter and receiver: its index, from 1, and its x, m.
    Outside(usize, f64),
    /// A relay is outside the lateral range: its index, from 1, and its y, m.
    Side(usize, f64),
    /// A relay is outside the altitude range: its index, from 1, and its altitude, m.
    Altitude(usize, f64),
    /// A relay has a smaller x than the previous one: its index, from 1.
    Order(usize),
    /// A relay is too close to the previous one: its index, from 1, and their distance, m.
    Separation(usize, f64),
    /// The reported SIR is wrong: the SIR reported, and the SIR computed from the chain.
    Sir(f64, f64),
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count(relays) => write!(f, "it has {relays} relays"),
            Self::Outside(relay, x_m) => write!(f, "relay {relay} is at x = {x_m} m"),
            Self::Side(relay, y_m) => write!(f, "relay {relay} is at y = {y_m} m"),
            Self::Altitude(relay, h_m) => write!(f, "relay {relay} is at h = {h_m} m"),
            Self::Order(relay) => write!(f, "relay {relay} is behind the one before it"),
            Self::Separation(relay, gap_m) => {
                write!(f, "relay {relay} is {gap_m:.3} m from the one before it")
            }
            Self::Sir(own, judged) => write!(f, "it reports SIR {own:.6}, and has {judged:.6}"),
        }
    }
}

/// Checks a chain against the constraints, and returns the SIR (linear) of its worst hop.
///
/// `room` has the limits of altitude and lateral position. `chain` has [x, y, altitude] of each relay, m.
pub(crate) fn judge(link: &Link, room: Corridor, chain: &[[f64; 3]]) -> Result<f64, Refusal> {
    let count = Refusal::Count(chain.len());
    if chain.len() != link.len() {
        return Err(count);
    }
    // NaN is never within.
    let within =
        |low: f64, value: f64, high: f64| (low - SLACK_M..=high + SLACK_M).contains(&value);
    for (relay, [x_m, y_m, h_m]) in (1..).zip(chain) {
        if !within(0.0, *x_m, link.distance_m) {
            return Err(Refusal::Outside(relay, *x_m));
        }
        if !within(room.left_m, *y_m, room.right_m) {
            return Err(Refusal::Side(relay, *y_m));
        }
        if !within(room.least_m, *h_m, room.most_m) {
            return Err(Refusal::Altitude(relay, *h_m));
        }
    }
    for (relay, (from, to)) in (2..).zip(chain.iter().zip(chain.iter().skip(1))) {
        let ([from_x, from_y, from_h], [x, y, h]) = (from, to);
        let gap_m = (x - from_x).hypot(y - from_y).hypot(h - from_h);
        if x - from_x < -SLACK_M {
            return Err(Refusal::Order(relay));
        }
        if gap_m < link.min_separation_m - SLACK_M {
            return Err(Refusal::Separation(relay, gap_m));
        }
    }
    let place = |&[x_m, y_m, altitude_m]: &[f64; 3]| Place {
        x_m,
        y_m,
        altitude_m,
    };
    let places: Vec<Place> = chain.iter().map(place).collect();
    sir(link, &places).ok_or(count)
}

fn rounded(chain: &[[f64; 3]]) -> Vec<[f64; 3]> {
    #[expect(clippy::cast_possible_truncation, reason = "what this is about")]
    let flown = |place: &[f64; 3]| place.map(|value| f64::from(value as f32));
    chain.iter().map(flown).collect()
}

pub(crate) struct Score {
    pub(crate) sir: f64,
    /// SIR (linear) of the worst hop with positions rounded to f32, as in a relay's setpoints.
    pub(crate) flown: f64,
    /// Processor time until the first good chain, s, if any.
    pub(crate) good_after_s: Option<f64>,
    /// Processor time until the first chain with at least the SIR of this crate's chain, s, if any.
    pub(crate) level_after_s: Option<f64>,
}

/// Scores a solver's result. `level` is the SIR (linear) of this crate's chain.
///
/// The SIR is computed from the solver's chain. The reported times are not checked.
pub(crate) fn score(
    link: &Link,
    room: Corridor,
    optimum: f64,
    level: f64,
    found: &Solution,
) -> Result<Score, Refusal> {
    let sir = judge(link, room, &found.chain)?;
    if !((found.sir / sir - 1.0).abs() <= SIR_SLACK) {
        return Err(Refusal::Sir(found.sir, sir));
    }
    let after = |mark: &Option<Mark>, least: f64| match mark {
        Some(mark) if judge(link, room, &mark.chain)? >= least * (1.0 - 1e-9) => {
            Ok(Some(mark.after_s))
        }
        _ => Ok(None),
    };
    Ok(Score {
        sir,
        flown: judge(link, room, &rounded(&found.chain))?,
        good_after_s: after(&found.good, optimum * (1.0 - GOOD))?,
        level_after_s: after(&found.level, level)?,
    })
}
