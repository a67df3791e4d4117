//! The best target of a chain, by bisection, and the paper's fixed-step schedule.

use super::hop::Hop;
use super::link::Link;

/// Relative width of the interval at which the bisection for the best target SIR ends.
const TOLERANCE: f64 = 1e-13;

const LEAST_TARGET: f64 = 1e-250;

impl Link {
    /// Returns the best SIR (linear) of all chains, the largest target that a chain meets. Accurate to 1e-13
    /// relative.
    ///
    /// `None` without relays, or if every chain has an SIR of zero. Uses greedy chains if all relays share one
    /// altitude, the exact sets otherwise. About 50 to 60 chains.
    pub fn optimum(&self) -> Option<f64> {
        let mut heights = self.relays.iter().map(|relay| relay.altitude_m);
        let first = heights.next()?;
        if heights.all(|h| h.total_cmp(&first).is_eq()) {
            self.farthest_optimum()
        } else {
            self.largest_target(|target| self.placement(target).is_some())
        }
    }

    /// Returns the target SIR (linear) above which the greedy [`Link::feasible`] fails, to 1e-13 relative. `None` as
    /// for [`Link::optimum`].
    ///
    /// The optimum itself if all relays share one altitude. Otherwise at most the optimum, and only one of the
    /// targets at which the greedy chain fails: it may fail at a target and succeed at a larger one.
    pub fn farthest_optimum(&self) -> Option<f64> {
        self.largest_target(|target| self.feasible(target).is_some())
    }

    pub(super) fn largest_target(&self, feasible: impl Fn(f64) -> bool) -> Option<f64> {
        // No chain is better than the best SIR of its first hop.
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

    /// Returns the first target (linear) of the paper's fixed-step schedule. It is the lesser of the first hop's SIR
    /// with relay 1 straight above Tx and the last hop's SIR with relay N straight above Rx.
    ///
    /// With the interferer behind Tx (X < 0) hop 1 is better farther out, and its best SIR over [0, D] replaces the
    /// one above Tx.
    fn first_target(&self) -> Option<f64> {
        let hop = Hop::new(self, 1, 0.0)?;
        let near = if self.x_i < 0.0 {
            hop.peak(0.0, self.distance_m)
        } else {
            hop.sir(0.0)
        };
        Some(near.min(self.sir_rx(self.distance_m)?))
    }

    /// Runs the paper's fixed-step schedule. Returns the number of targets tried, the feasible one included, and that
    /// target (linear).
    ///
    /// The targets are `gamma_0` - i `epsilon`, i = 0, 1, ...; `gamma_0` is the lesser of the SIRs above Tx and above
    /// Rx (for X < 0, of hop 1's best over [0, D] and the SIR above Rx), `epsilon` the step (linear, > 0). `None` if
    /// no target is feasible. Costs one greedy chain per target, at most `gamma_0` / `epsilon`.
    pub fn fixed_step(&self, epsilon: f64) -> Option<(u32, f64)> {
        let first = self.first_target()?;
        (0..u32::MAX)
            .map(|i| (i + 1, first - f64::from(i) * epsilon))
            .take_while(|&(_, target)| epsilon > 0.0 && target > 0.0)
            .find(|&(_, target)| self.feasible(target).is_some())
    }
}
