//! Chains built from Rx toward Tx with hops as long as a target allows. The paper's Algorithm 4 and its optimum.

use super::link::StochasticLink;
use crate::reference::link::Relay;

/// Chain of relays built from Rx back toward Tx, and the target SIR that it meets.
#[derive(Debug, Clone, PartialEq)]
pub struct Backward {
    /// Target SIR (linear). Every hop except the first is as long as this target allows.
    pub gamma: f64,
    /// Positions of the relays from Tx to Rx, m.
    pub places: Vec<f64>,
    /// Number of target SIRs tried, including the final one. In the result of [`StochasticLink::fewest`] it is the
    /// number of relays.
    pub iterations: usize,
}

impl StochasticLink {
    /// Returns the expected SIR (linear) at Rx with the last relay straight above Rx.
    ///
    /// It is an upper bound for every chain; Algorithm 4 starts with this target.
    pub fn ceiling(&self) -> f64 {
        self.relays.last().map_or(0.0, |tail| {
            tail.power_w * self.upsilon_at(self.distance_m)
                / (self.eta * tail.altitude_m * tail.altitude_m)
        })
    }

    /// Returns the positions, m, of the chain built backward from Rx. Every hop but the first is as long as the
    /// target SIR `gamma` allows; no relay is before Tx.
    ///
    /// `None` if even the shortest hop misses the target.
    pub fn backward(&self, gamma: f64) -> Option<Vec<f64>> {
        let tail = self.relays.last()?;
        let d = self.distance_m;
        let reach = |power: f64, factor: f64, upsilon: f64, climb: f64| {
            let squared = power * upsilon / (factor * gamma) - climb * climb;
            // Tolerates rounding for a hop exactly as long as the altitude.
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

    /// Returns the first hop's expected SIR in the chain built backward for `gamma`, but at most `gamma`. 0 without a
    /// chain.
    pub fn backward_sir(&self, gamma: f64) -> f64 {
        self.backward(gamma)
            .and_then(|places| self.hop_sirs(&places).first().map(|sir| sir.min(gamma)))
            .unwrap_or(0.0)
    }

    /// Runs the paper's Algorithm 4: lowers the target SIR by `step` until the first hop meets it. The first target
    /// is [`StochasticLink::ceiling`].
    ///
    /// In two points it differs from the printed algorithm: the last hop follows the target, and no relay is before
    /// Tx. `None` if no target above 0 is met, as with a step larger than the optimum.
    pub fn algorithm4(&self, step: f64) -> Option<Backward> {
        let mut gamma = self.ceiling();
        let mut iterations = 1;
        // A remainder below this is rounding.
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

    /// Returns the best [`StochasticLink::backward_sir`] that a search over the target SIR finds.
    ///
    /// It tries `points` targets down to 1e-8 of the ceiling, evenly spaced in their logarithm, and then four times
    /// as many targets around the best target. This search is for interference with which the SIR has several maxima.
    /// A maximum narrower than the spacing may be missed.
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

    /// Solves the paper's problem 1: the fewest relays that meet the target SIR `gamma` if built backward.
    ///
    /// All relays are like the first relay; there are at most `most` relays. The result's `iterations` is the number
    /// of relays. `None` if more relays are needed, or if the target cannot be met.
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
