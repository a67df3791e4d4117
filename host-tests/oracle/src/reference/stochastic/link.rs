//! A chain of relays under interference with a known Upsilon.

use super::super::link::{Relay, received_w};

/// Chain of relays between Tx at (0, 0) and Rx at (D, 0) in random interference.
///
/// The interference is known as Upsilon(x) = E[1/I]; I is the interference power at x.
#[derive(Debug, Clone, PartialEq)]
pub struct StochasticLink {
    /// Distance D from Tx to Rx, m, > 0.
    pub distance_m: f64,
    /// Transmit power of Tx, W, > 0.
    pub tx_w: f64,
    /// Path-loss factor between two relays, 1/m^2, > 0.
    pub mu_los: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2, > 0.
    pub eta: f64,
    /// Table of Upsilon on the line Tx-Rx: pairs of x, m, in ascending order, and Upsilon(x), 1/W.
    ///
    /// Upsilon = E[1/I], with the interference power I. It is linear between two x of the table, and constant below the
    /// first x and above the last.
    pub upsilon: Vec<(f64, f64)>,
    /// Relays 1 to N from Tx to Rx.
    pub relays: Vec<Relay>,
}

impl StochasticLink {
    /// Returns Upsilon, the mean of 1/I, at `x`, m, in 1/W; I is the interference power.
    ///
    /// It is interpolated in the table `upsilon`; NaN if the table is empty.
    pub fn upsilon_at(&self, x: f64) -> f64 {
        let mut left: Option<(f64, f64)> = None;
        for &(at, value) in &self.upsilon {
            if x < at {
                return left.map_or(value, |(before, old)| {
                    let share = (x - before) / (at - before);
                    old * (1.0 - share) + value * share
                });
            }
            left = Some((at, value));
        }
        left.map_or(f64::NAN, |(_, value)| value)
    }

    /// Returns the expected linear SIRs of the N+1 hops with relay k at `x[k-1]`, m.
    ///
    /// Empty without relays, or if the number of positions in `x` differs from the number of relays. Infinite if two
    /// relays share a position.
    pub fn hop_sirs(&self, x: &[f64]) -> Vec<f64> {
        let (Some(first), Some(last)) = (self.relays.first(), self.relays.last()) else {
            return Vec::new();
        };
        let (Some(&head), Some(&tail)) = (x.first(), x.last()) else {
            return Vec::new();
        };
        if x.len() != self.relays.len() {
            return Vec::new();
        }
        let mut sir = vec![
            received_w(self.tx_w, self.eta, head, 0.0, first.altitude_m) * self.upsilon_at(head),
        ];
        for (pair, at) in self.relays.windows(2).zip(x.windows(2)) {
            if let ([from, to], [from_x, to_x]) = (pair, at) {
                let climb = to.altitude_m - from.altitude_m;
                let signal = received_w(from.power_w, self.mu_los, to_x - from_x, 0.0, climb);
                sir.push(signal * self.upsilon_at(*to_x));
            }
        }
        let d = self.distance_m;
        let signal = received_w(last.power_w, self.eta, d - tail, 0.0, last.altitude_m);
        sir.push(signal * self.upsilon_at(d));
        sir
    }

    /// Returns the expected linear SIR of the worst hop; 0 if [`StochasticLink::hop_sirs`] is empty.
    pub fn chain_sir(&self, x: &[f64]) -> f64 {
        self.hop_sirs(x).into_iter().reduce(f64::min).unwrap_or(0.0)
    }
}
