//! An f64 judge of plans against interference that is known by its distribution alone.
//!
//! Nothing of `uav-relay` is used. The expected SIR of a hop is its received signal power times Upsilon = E[1/I] where it
//! ends; [`upsilon_by_mgf`] finds Upsilon for any distribution, and [`StochasticLink`] judges whole chains, by the paper's
//! fixed-step algorithms and by brute force.

use super::{Station, received_w};

mod backward;
mod single;

pub use backward::Backward;
pub use single::Single;

/// Upsilon = E[1/I] in 1/W, as the integral of the moment-generating function `m` over the negative half line.
///
/// `m`(t) = E[exp(t I)] for t <= 0, I > 0 in W. With y = e^z the integrand is analytic and falls off exponentially on both
/// sides, so the trapezoidal rule is good to about 1e-13. `None` where the integral has no end in f64: E[1/I] infinite, or
/// nearly so (a Beta distribution with alpha below about 1.1). At most some 4000 evaluations of `m`.
pub fn upsilon_by_mgf(m: impl Fn(f64) -> f64) -> Option<f64> {
    const STEP: f64 = 0.25;
    // Somewhere about 1 / I: where the function has fallen to a half.
    let centre = (-1000..=1000)
        .map(|k| f64::from(k) * 0.69)
        .find(|z| m(-z.exp()) < 0.5)?;
    let (mut sum, mut last, mut quiet) = (0.0, 0.0, 0);
    for k in 0.. {
        let y = (centre - 40.0 + STEP * f64::from(k)).exp();
        if !y.is_finite() {
            return None;
        }
        let term = y * m(-y);
        sum += term;
        // What is left, if the terms go on falling as from the last one to this.
        let ratio = term / last;
        let left = if ratio < 1.0 {
            term * ratio / (1.0 - ratio)
        } else {
            f64::INFINITY
        };
        quiet = if term <= 0.0 || left < 1e-14 * sum {
            quiet + 1
        } else {
            0
        };
        if quiet > 40 {
            return Some(sum * STEP);
        }
        last = term;
    }
    None
}

/// A chain of relays between Tx at (0, 0) and Rx at (D, 0) under interference with a known Upsilon(x).
#[derive(Debug, Clone, PartialEq)]
pub struct StochasticLink {
    /// Tx-Rx distance D, metres, > 0.
    pub distance_m: f64,
    /// Transmit power of Tx, watts, > 0.
    pub tx_w: f64,
    /// Path-loss factor between two relays, 1/m^2, > 0.
    pub mu_los: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2, > 0.
    pub eta: f64,
    /// Places, metres, strictly rising, with Upsilon there, 1/W: straight lines between them, held beyond the ends.
    pub upsilon: Vec<(f64, f64)>,
    /// The relays from Tx to Rx; their number is N.
    pub relays: Vec<Station>,
}

impl StochasticLink {
    /// Upsilon at `x` metres, 1/W; NaN for an empty table.
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

    /// Expected SIR (linear) of the N+1 hops with relay k at `x[k-1]` metres; empty if the numbers of the two differ or
    /// there is no relay. Infinite where two relays share one place.
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

    /// Expected SIR (linear) of the chain: that of its worst hop; 0 where [`StochasticLink::hop_sirs`] is empty.
    pub fn chain_sir(&self, x: &[f64]) -> f64 {
        self.hop_sirs(x).into_iter().reduce(f64::min).unwrap_or(0.0)
    }

    /// The best expected SIR of relays that are all alike where Upsilon is the same everywhere, from the equation that says
    /// that all hops are equal and as long as the distance; about 2000 evaluations of it at most.
    ///
    /// `None` without relays, or where relays or Upsilon differ. Never above the SIR of the weaker outer hop with the outer
    /// relays straight above Tx and Rx.
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

impl StochasticLink {
    /// SIR (linear) of the worst hop of the best chain of relays that are all as the first one, in any field, no least separation:
    /// relays may stand back from where they could stand.
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
            // Convex where the first hop's square is above 0, which is where it counts.
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
