//! Farthest position of a relay, and the greedy chain of such positions.

use super::hop::{Hop, bisect};
use super::link::{Link, meets};

impl Link {
    /// Returns the farthest x from `from_x` to Rx, m, at which relay `k` meets the SIR `target`.
    ///
    /// `k` is within 1 to N; `target` is linear and above 0. Relay k-1 is at `from_x` (for k = 1 Tx is at 0). `None` if
    /// no position meets the target. The cost is about 60 evaluations of the SIR, at most about 150.
    pub fn farthest(&self, k: usize, from_x: f64, target: f64) -> Option<f64> {
        let end = self.distance_m;
        if !(0.0..=end).contains(&from_x) {
            return None;
        }
        let hop = Hop::new(self, k, from_x)?;
        let meets = |x: f64| hop.meets(x, target);
        if meets(end) {
            return Some(end);
        }
        // The SIR crosses the target at most once between two extrema. The farthest x follows the last extremum that
        // meets it.
        let mut outside = end;
        for inside in hop.turns(from_x, end).into_iter().rev().chain([from_x]) {
            if meets(inside) {
                return Some(bisect(inside, outside, meets));
            }
            outside = inside;
        }
        None
    }

    /// Returns the largest distance of the last relay from Rx, m, at which the SIR at Rx meets `target`.
    ///
    /// `target` is linear. The result may be larger than the distance from Tx to Rx. `None` if `target` is not
    /// positive, or not met even with the relay straight above Rx. The cost is about 60 evaluations of the SIR.
    pub fn rx_reach(&self, target: f64) -> Option<f64> {
        let sir = |distance: f64| self.sir_rx(self.distance_m - distance);
        let meets = |distance: f64| sir(distance).is_some_and(|sir| meets(sir, target));
        if !(target > 0.0 && meets(0.0)) {
            return None;
        }
        let mut outside = self.distance_m;
        while outside.is_finite() && meets(outside) {
            outside *= 2.0;
        }
        Some(bisect(0.0, outside, meets))
    }

    /// Returns the positions, m, of the greedy chain: each relay is as far toward Rx as `target` allows.
    ///
    /// `target` is a linear SIR. `None` if a relay or Rx cannot meet it. If all relays share one altitude, `None`
    /// proves that no chain meets `target`. For other chains [`Link::placement`] gives this proof. Relays use the same
    /// method in flight. The cost is N calls of [`Link::farthest`].
    pub fn feasible(&self, target: f64) -> Option<Vec<f64>> {
        let mut from = 0.0;
        let mut x = Vec::with_capacity(self.len());
        for k in 1..=self.len() {
            from = self.farthest(k, from, target)?;
            x.push(from);
        }
        meets(self.sir_rx(from)?, target).then_some(x)
    }
}
