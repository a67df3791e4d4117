//! Best position of one relay: the paper's Algorithm 3, printed and corrected, and brute force.

use super::link::StochasticLink;

/// Result of Algorithm 3, which places a single relay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Single {
    /// Position of the relay along the line from Tx, m.
    pub x_m: f64,
    /// SIR (linear): the target SIR, or the first hop's expected SIR if this is smaller.
    pub sir: f64,
    /// Number of target SIRs tried.
    pub iterations: usize,
}

impl StochasticLink {
    /// Runs Algorithm 3 as printed: it stops at the first target SIR that the first hop meets.
    ///
    /// The first target is the largest SIR of the second hop; each further one is lower by `step`. If the first hop
    /// meets no target, the result is the best position tried. `None` unless the link has exactly one relay.
    pub fn algorithm3_printed(&self, step: f64) -> Option<Single> {
        self.descend(step, |here, _, gamma| (here.sir >= gamma).then_some(here))
    }

    /// Runs the corrected Algorithm 3: it stops when no lower target SIR can give a better position.
    ///
    /// Returns the best position tried. In even interference it can belong to a target one `step` away from that of the
    /// printed algorithm; its SIR is at least as high. `None` unless the link has exactly one relay.
    pub fn algorithm3(&self, step: f64) -> Option<Single> {
        self.descend(step, |_, best, gamma| {
            (best.sir >= gamma - step).then_some(best)
        })
    }

    /// Lowers the target SIR by `step` until the closure `end` returns `Some`, and returns its value.
    ///
    /// The arguments of `end` are the relay's position for this target, the best position so far, and the target. If
    /// `end` never returns `Some`, the result is the best position.
    fn descend(
        &self,
        step: f64,
        end: impl Fn(Single, Single, f64) -> Option<Single>,
    ) -> Option<Single> {
        let [_] = self.relays.as_slice() else {
            return None;
        };
        let mut gamma = self.ceiling();
        let mut best: Option<Single> = None;
        let mut iterations = 1;
        while gamma > 0.0 {
            if let Some(&[x_m]) = self.backward(gamma).as_deref() {
                let here = Single {
                    x_m,
                    sir: self.hop_sirs(&[x_m]).first()?.min(gamma),
                    iterations,
                };
                let leader = best.filter(|best| best.sir >= here.sir).unwrap_or(here);
                best = Some(leader);
                if let Some(end) = end(here, leader, gamma) {
                    return Some(Single { iterations, ..end });
                }
                if x_m <= 0.0 {
                    break;
                }
            }
            gamma -= step;
            iterations += 1;
        }
        best.map(|best| Single { iterations, ..best })
    }

    /// Returns the best position, m, and its expected SIR (linear) for one relay, by brute force.
    ///
    /// In each interval of the interference table it tries about `points` positions, and refines the best one four
    /// times. `None` unless the link has exactly one relay.
    pub fn single_optimum(&self, points: u32) -> Option<(f64, f64)> {
        let [_] = self.relays.as_slice() else {
            return None;
        };
        let d = self.distance_m;
        let mut ends: Vec<f64> = self.upsilon.iter().map(|(x, _)| x.clamp(0.0, d)).collect();
        ends.extend([0.0, d]);
        ends.sort_by(f64::total_cmp);
        let mut best = (0.0, 0.0);
        for piece in ends.windows(2) {
            let &[mut low, mut high] = piece else {
                continue;
            };
            let mut here = (low, 0.0);
            for _ in 0..5 {
                let step = (high - low) / f64::from(points);
                for k in 0..=points {
                    let x = low + step * f64::from(k);
                    let sir = self.chain_sir(&[x]);
                    if sir > here.1 {
                        here = (x, sir);
                    }
                }
                (low, high) = (f64::max(here.0 - step, low), f64::min(here.0 + step, high));
            }
            if here.1 > best.1 {
                best = here;
            }
        }
        Some(best)
    }
}
