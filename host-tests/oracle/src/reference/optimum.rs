//! Best target SIR of a chain: by bisection, and by the paper's fixed steps.

use super::hop::Hop;
use super::link::Link;

/// Relative width of the interval of target SIRs at which the bisection ends.
const TOLERANCE: f64 = 1e-13;

const LEAST_TARGET: f64 = 1e-250;

impl Link {
    /// Returns the best SIR (linear) of all chains: the largest target SIR that a chain meets.
    ///
    /// The relative error is at most 1e-13. `None` without relays, or if every chain has an SIR of zero. About 50 to 60
    /// targets are tried. If all relays share one altitude, it suffices to try the chain with every relay as near to Rx
    /// as possible. Otherwise all possible positions of the relays are computed.
    pub fn optimum(&self) -> Option<f64> {
        let mut heights = self.relays.iter().map(|relay| relay.altitude_m);
        let first = heights.next()?;
        if heights.all(|h| h.total_cmp(&first).is_eq()) {
            self.farthest_optimum()
        } else {
            self.largest_target(|target| self.placement(target).is_some())
        }
    }

    /// Returns the largest target SIR (linear) that a bisection with [`Link::feasible`] finds.
    ///
    /// The relative error is at most 1e-13. If all relays share one altitude, the result is the optimum. Otherwise it
    /// may be lower, because the greedy chain may miss a target although it meets a larger target. `None` without
    /// relays, or if every chain has an SIR of zero.
    pub fn farthest_optimum(&self) -> Option<f64> {
        self.largest_target(|target| self.feasible(target).is_some())
    }

    pub(super) fn largest_target(&self, feasible: impl Fn(f64) -> bool) -> Option<f64> {
        // No chain is better than its first hop at the best position.
        let mut above = 2.0 * Hop::new(self, 1, 0.0)?.peak(0.0, self.distance_m);
        let mut below = above / 16.0;
        while !feasible(below) {
            (above, below) = (below, below / 16.0);
            if below < LEAST_TARGET {
                return None;
            }
        }
        while above - below > TOLERANCE * below {
            // Geometric mean, because the targets span many decades.
            let middle = below * (above / below).sqrt();
            if feasible(middle) {
                below = middle;
            } else {
                above = middle;
            }
        }
        Some(below)
    }

    /// Returns the first target SIR (linear) of the paper's fixed-step search.
    ///
    /// It is the smaller one of two SIRs: the SIR of the first hop with relay 1 straight above Tx, and the SIR of the
    /// last hop with relay N straight above Rx. If the interferer's x is below 0, the largest SIR of the first hop
    /// replaces the former.
    fn first_target(&self) -> Option<f64> {
        let hop = Hop::new(self, 1, 0.0)?;
        let near = if self.x_i < 0.0 {
            hop.peak(0.0, self.distance_m)
        } else {
            hop.sir(0.0)
        };
        Some(near.min(self.sir_rx(self.distance_m)?))
    }

    /// Runs the paper's fixed-step search: lowers the target SIR by `epsilon` until a chain meets it.
    ///
    /// Returns the number of targets tried and the last target (linear). `None` if no target can be met. `epsilon` is
    /// linear, above 0. For each target one chain is computed.
    ///
    /// The first target is the smaller one of two SIRs: the SIR of the first hop with relay 1 straight above Tx, and
    /// the SIR of the last hop with relay N straight above Rx. If the interferer's x is below 0, the largest SIR of the
    /// first hop replaces the former.
    pub fn fixed_step(&self, epsilon: f64) -> Option<(u32, f64)> {
        let first = self.first_target()?;
        (0..u32::MAX)
            .map(|i| (i + 1, first - f64::from(i) * epsilon))
            .take_while(|&(_, target)| epsilon > 0.0 && target > 0.0)
            .find(|&(_, target)| self.feasible(target).is_some())
    }
}
