//! Best chain of equal relays if the interference is the same everywhere.

use super::link::StochasticLink;

impl StochasticLink {
    /// Returns the best expected SIR (linear) of equal relays if the interference is the same everywhere.
    ///
    /// All hops then have the same SIR, and together span the distance from Tx to Rx. The SIR is limited by the first
    /// hop with its relay above Tx, and by the last hop with its relay above Rx. The cost is at most about 2000
    /// evaluations. `None` without relays, if the relays differ, or if the table `upsilon` has different values.
    pub fn iid_optimum(&self) -> Option<f64> {
        let (first, (_, u)) = (self.relays.first()?, *self.upsilon.first()?);
        let alike = self.relays.iter().all(|relay| relay == first)
            && self.upsilon.iter().all(|(_, other)| other.eq(&u));
        if !alike {
            return None;
        }
        let h2 = first.altitude_m * first.altitude_m;
        let cap = self.tx_w.min(first.power_w) * u / (self.eta * h2);
        let middle = (self.relays.len() - 1) as f64;
        let span = |g: f64| {
            let outer = |power: f64| (power * u / (self.eta * g) - h2).max(0.0).sqrt();
            outer(self.tx_w)
                + middle * (first.power_w * u / (self.mu_los * g)).sqrt()
                + outer(first.power_w)
        };
        if span(cap) >= self.distance_m {
            return Some(cap);
        }
        let (mut low, mut high) = (0.0, cap);
        for _ in 0..2000 {
            let g: f64 = f64::midpoint(low, high);
            if g.total_cmp(&low).is_eq() || g.total_cmp(&high).is_eq() {
                break;
            }
            if span(g) >= self.distance_m {
                low = g;
            } else {
                high = g;
            }
        }
        Some(low)
    }
}
