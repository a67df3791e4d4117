//! The best chain of identical relays.

use super::link::StochasticLink;

impl StochasticLink {
    /// Returns the best expected SIR of identical relays with a constant Upsilon.
    ///
    /// Solves the equation that all hops are equal and span the distance; at most about 2000 evaluations. `None` without relays,
    /// or if relays or Upsilon differ. Never above the SIR of the weaker outer hop with the outer relays straight above Tx and
    /// Rx.
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

    /// Returns the SIR (linear) of the worst hop of the best chain of relays like the first, in any field.
    ///
    /// Without a least separation; relays need not be as far out as they could be.
    pub fn best(&self) -> f64 {
        let Some(relay) = self.relays.first() else {
            return 0.0;
        };
        let d = self.distance_m;
        let mut cuts: Vec<f64> = self.upsilon.iter().map(|point| point.0).collect();
        cuts.retain(|x| *x > 0.0 && *x < d);
        cuts.push(d);
        let least = |low: f64, value: &dyn Fn(f64) -> f64| {
            let mut left = low;
            let mut best = value(low);
            for &right in cuts.iter().filter(|cut| **cut > low) {
                let (mut a, mut b) = (left, right);
                for _ in 0..60 {
                    let (p, q) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
                    if value(p) <= value(q) { b = q } else { a = p }
                }
                best = best.min(value(0.5 * (a + b))).min(value(right));
                left = right;
            }
            best
        };
        let met = |target: f64| {
            let h2 = relay.altitude_m.powi(2);
            let last = relay.power_w * self.upsilon_at(d) / (self.eta * target) - h2;
            if last < 0.0 {
                return false;
            }
            let mut low = (d - last.sqrt()).max(0.0);
            let hop =
                |y: f64| y - (relay.power_w * self.upsilon_at(y) / (self.mu_los * target)).sqrt();
            for _ in 1..self.relays.len() {
                low = least(low, &hop).max(0.0).min(low);
            }
            // Convex where the first hop's square is above 0, which is the relevant part.
            let head = |x: f64| x * x + h2 - self.tx_w * self.upsilon_at(x) / (self.eta * target);
            least(low, &head) <= 0.0
        };
        let (mut low, mut high) = (0.0, self.ceiling());
        for k in 0..60 {
            let middle: f64 = if k < 30 && low <= 0.0 {
                high / 10.0
            } else {
                0.5 * (low + high)
            };
            if met(middle) {
                low = middle;
            } else {
                high = middle;
            }
            if high - low < 1e-6 * low {
                break;
            }
        }
        low
    }
}
