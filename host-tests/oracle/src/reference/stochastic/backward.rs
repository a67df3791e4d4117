//! Chains built from Rx toward Tx, each hop as long as a target allows: the paper's Algorithm 4 and what it should find.

use super::link::StochasticLink;
use crate::reference::link::Station;

/// A chain built backward, and the target it was built for.
#[derive(Debug, Clone, PartialEq)]
pub struct Backward {
    /// Target that all hops but the first were stretched to, linear.
    pub gamma: f64,
    /// Places of the relays from Tx to Rx, metres.
    pub places: Vec<f64>,
    /// Targets tried, this one included.
    pub iterations: usize,
}

impl StochasticLink {
    /// Expected SIR at Rx with the tail straight above it: no chain is better, and the backward search starts here.
    pub fn ceiling(&self) -> f64 {
        self.relays.last().map_or(0.0, |tail| {
            tail.power_w * self.upsilon_at(self.distance_m)
                / (self.eta * tail.altitude_m * tail.altitude_m)
        })
    }

    /// The places of the relays when every hop but the first is as long as `gamma` allows, cut off above Tx.
    ///
    /// `None` where even the shortest hop would not do.
    pub fn backward(&self, gamma: f64) -> Option<Vec<f64>> {
        let tail = self.relays.last()?;
        let d = self.distance_m;
        let reach = |power: f64, factor: f64, upsilon: f64, climb: f64| {
            let squared = power * upsilon / (factor * gamma) - climb * climb;
            // A hop just as long as the altitude is one, whatever rounding makes of the difference.
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

    /// What the backward chain for `gamma` is worth: the lesser of `gamma` and the first hop's expected SIR; 0 without one.
    pub fn backward_sir(&self, gamma: f64) -> f64 {
        self.backward(gamma)
            .and_then(|places| self.hop_sirs(&places).first().map(|sir| sir.min(gamma)))
            .unwrap_or(0.0)
    }

    /// The paper's Algorithm 4: targets from [`StochasticLink::ceiling`] down in steps of `step`, until the first hop of
    /// the backward chain meets one. The last hop follows the target and no relay stands before Tx, both unlike printed.
    ///
    /// `None` if no target above 0 is met, as with a step larger than the optimum.
    pub fn algorithm4(&self, step: f64) -> Option<Backward> {
        let mut gamma = self.ceiling();
        let mut iterations = 1;
        // What is left of 0 after many steps is rounding.
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

    /// The largest value of [`StochasticLink::backward_sir`] over all targets: `points` of them down to 1e-8 of the
    /// ceiling, evenly spaced in their logarithm, and as many again around the best, four times.
    ///
    /// For fields where that value has several hills; it may miss one narrower than the spacing.
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

    /// The paper's problem 1 for relays like the first: the fewest, at most `most`, with which the backward chain for
    /// `gamma` closes. `iterations` is their number.
    pub fn fewest(&self, gamma: f64, most: usize) -> Option<Backward> {
        let like: Station = *self.relays.first()?;
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
