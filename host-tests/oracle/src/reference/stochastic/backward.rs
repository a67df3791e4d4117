//! Chains built from Rx toward Tx with the longest hops that a target allows: the paper's Algorithm 4.

use super::link::StochasticLink;
use crate::reference::link::Relay;

/// Chain of relays built from Rx back toward Tx, and the target SIR that it meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Backward {
    /// Target SIR (linear). All hops except the first hop, from Tx, are as long as the target allows.
    pub gamma: f64,
    /// Positions of the relays from Tx to Rx, m.
    pub places: Vec<f64>,
    /// Number of target SIRs tried, including the successful one.
    ///
    /// In a result of [`StochasticLink::fewest`] it is the number of relays instead.
    pub iterations: usize,
}

impl StochasticLink {
    /// Returns the expected SIR (linear) at Rx with the last relay straight above Rx.
    ///
    /// It is an upper bound for every chain, and the first target of Algorithm 4.
    pub fn ceiling(&self) -> f64 {
        self.relays.last().map_or(0.0, |tail| {
            tail.power_w * self.upsilon_at(self.distance_m)
                / (self.eta * tail.altitude_m * tail.altitude_m)
        })
    }

    /// Returns the positions, m, of the chain built from Rx back to Tx for the target SIR `gamma`.
    ///
    /// All hops except the first hop, from Tx, are as long as `gamma` allows. No relay has an x below 0. `None` if even
    /// the shortest possible hop misses `gamma`.
    pub fn backward(&self, gamma: f64) -> Option<Vec<f64>> {
        let tail = self.relays.last()?;
        let d = self.distance_m;
        let reach = |power: f64, factor: f64, upsilon: f64, climb: f64| {
            let squared = power * upsilon / (factor * gamma) - climb * climb;
            // A hop may be exactly as long as the altitude, apart from rounding.
            (squared >= -1e-12 * climb * climb).then(|| squared.max(0.0).sqrt())
        };
        let last = reach(tail.power_w, self.eta, self.upsilon_at(d), tail.altitude_m)?;
        let mut x = (d - last).max(0.0);
        let mut places = vec![x];
        for pair in self.relays.windows(2).rev() {
            if let [from, to] = pair {
                let climb = to.altitude_m - from.altitude_m;
                x = (x - reach(from.power_w, self.mu_los, self.upsilon_at(x), climb)?).max(0.0);
                places.push(x);
            }
        }
        places.reverse();
        Some(places)
    }

    /// Returns the smaller one of `gamma` and the expected SIR of the first hop, from Tx.
    ///
    /// The chain is the one of [`StochasticLink::backward`] for `gamma`. Returns 0 if there is no such chain.
    pub fn backward_sir(&self, gamma: f64) -> f64 {
        self.backward(gamma)
            .and_then(|places| self.hop_sirs(&places).first().map(|sir| sir.min(gamma)))
            .unwrap_or(0.0)
    }

    /// Runs the paper's Algorithm 4: lowers the target SIR by `step` until the first hop meets it.
    ///
    /// The first hop is the one from Tx. The first target is [`StochasticLink::ceiling`]. Unlike in the printed
    /// algorithm, the length of the last hop depends on the target, and no relay has an x below 0. `None` if no target
    /// above 0 is met, for example because `step` is larger than the optimum.
    pub fn algorithm4(&self, step: f64) -> Option<Backward> {
        let mut gamma = self.ceiling();
        let mut iterations = 1;
        // A smaller target is a rounding error.
        while gamma > 1e-6 * step {
            if let Some(places) = self.backward(gamma)
                && self.hop_sirs(&places).first()? >= &gamma
            {
                return Some(Backward {
                    gamma,
                    places,
                    iterations,
                });
            }
            gamma -= step;
            iterations += 1;
        }
        None
    }

    /// Returns the largest value of [`StochasticLink::backward_sir`] that a search over targets finds.
    ///
    /// The search tries about `points` targets from the ceiling down to 1e-8 of it, evenly spaced in their logarithm.
    /// Four further rounds of `points` targets refine the best one. It is useful if the SIR has several maxima over the
    /// target, but may miss a maximum that is narrower than the spacing.
    pub fn backward_best(&self, points: u32) -> f64 {
        let (mut low, mut high) = (1e-8_f64.ln(), 0.0);
        let mut best = (0.0, 0.0);
        for _ in 0..5 {
            let step = (high - low) / f64::from(points);
            for k in 0..=points {
                let log = high - step * f64::from(k);
                let value = self.backward_sir(self.ceiling() * f64::exp(log));
                if value > best.1 {
                    best = (log, value);
                }
            }
            (low, high) = (best.0 - step, f64::min(best.0 + step, 0.0));
        }
        best.1
    }

    /// Solves the paper's problem 1: the fewest relays whose chain built backward from Rx meets `gamma`.
    ///
    /// All relays have the power and altitude of the first relay. `None` if more than `most` relays are needed, or if
    /// the target cannot be met. The field `iterations` of the result is the number of relays.
    pub fn fewest(&self, gamma: f64, most: usize) -> Option<Backward> {
        let like: Relay = *self.relays.first()?;
        (1..=most).find_map(|n| {
            let link = Self {
                relays: vec![like; n],
                ..self.clone()
            };
            let places = link.backward(gamma)?;
            (link.hop_sirs(&places).first()? >= &gamma).then_some(Backward {
                gamma,
                places,
                iterations: n,
            })
        })
    }
}
