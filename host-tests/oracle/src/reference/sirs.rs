//! SIR of every hop, from received powers; with noise, the SINR.

use super::hop::Hop;
use super::link::{Link, received_w};

impl Link {
    /// Returns the linear SIR of hop `k`, 1 to N: to relay `k` at `x` from its sender at `from_x`, m.
    ///
    /// For `k` = 1 the sender is Tx at 0, and `from_x` is ignored. `None` for another `k`. The SIR is infinite if
    /// sender and receiver have the same position.
    pub fn sir_relay(&self, k: usize, from_x: f64, x: f64) -> Option<f64> {
        Hop::new(self, k, from_x).map(|hop| hop.sir(x))
    }

    /// Returns the linear SIR at Rx with the last relay at `x`, m; `None` without relays.
    pub fn sir_rx(&self, x: f64) -> Option<f64> {
        let last = self.relays.last()?;
        let signal = received_w(
            last.power_w,
            self.eta,
            self.distance_m - x,
            0.0,
            last.altitude_m,
        );
        let interference = received_w(
            self.interferer_w,
            self.mu_nlos,
            self.distance_m - self.x_i,
            self.y_i,
            0.0,
        );
        Some(signal / (interference + self.noise_w))
    }

    /// Returns the linear SIRs of the N+1 hops of a chain with relay k at `x[k-1]`, m.
    ///
    /// Empty without relays, or if the number of positions in `x` differs from the number of relays.
    pub fn sir_hops(&self, x: &[f64]) -> Vec<f64> {
        if x.len() != self.len() {
            return Vec::new();
        }
        let senders = std::iter::once(&0.0).chain(x);
        let hops = (1..).zip(senders.zip(x));
        let mut sir: Vec<f64> = hops
            .filter_map(|(k, (&from, &to))| self.sir_relay(k, from, to))
            .collect();
        sir.extend(x.last().and_then(|&tail| self.sir_rx(tail)));
        sir
    }

    /// Returns the linear SIR of a chain's worst hop; 0 if [`Link::sir_hops`] is empty.
    pub fn chain_sir(&self, x: &[f64]) -> f64 {
        self.sir_hops(x).into_iter().reduce(f64::min).unwrap_or(0.0)
    }
}
