//! The SIR of every hop, from received powers; with noise, the SINR.

use super::hop::Hop;
use super::link::{Link, received_w};

impl Link {
    /// SIR (linear) of hop `k` in 1..=N measured at relay `k` standing at `x` metres, its sender at `from_x` metres.
    ///
    /// Hop 1 is sent by Tx, which stands at 0: `from_x` is then not looked at. `None` for any other `k`. Infinite when sender
    /// and receiver coincide.
    pub fn sir_relay(&self, k: usize, from_x: f64, x: f64) -> Option<f64> {
        Hop::new(self, k, from_x).map(|hop| hop.sir(x))
    }

    /// SIR (linear) of hop N+1, measured at Rx, the last relay standing at `x` metres; `None` without relays.
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

    /// SIR (linear) of the N+1 hops of a chain whose relay k stands at `x[k-1]` metres.
    ///
    /// Empty when `x` does not hold exactly one place per relay, or there is no relay.
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

    /// SIR (linear) of the chain: that of its worst hop; 0 where [`Link::sir_hops`] is empty.
    pub fn chain_sir(&self, x: &[f64]) -> f64 {
        self.sir_hops(x).into_iter().reduce(f64::min).unwrap_or(0.0)
    }
}
