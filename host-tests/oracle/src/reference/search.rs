//! Brute-force search over the positions of one or two relays, without target SIRs.

use super::link::Link;

/// Number of golden-section steps in a cell of the grid.
///
/// These steps shrink the searched interval to about 2e-9 of the cell's width.
const STEPS: usize = 42;

const PEAKS: usize = 4;

impl Link {
    /// Returns the best SIR (linear) of all chains that keep the minimum separation, by brute force.
    ///
    /// The search tries `points` (>= 16) positions for each relay, and refines the best ones. Returns 0 if there is no
    /// such chain. The result may be below the optimum, because the search may miss it, but never above it, except for
    /// rounding. The cost is about (4 `points` + 170)^N SIR evaluations: use it for N of 1 or 2.
    pub fn optimum_by_search(&self, points: u32) -> f64 {
        self.best_from(1, 0.0, points)
    }

    /// Returns the best SIR of the worst of the hops `k` to N+1, over the positions of relays `k` to N.
    ///
    /// Relay k-1 is fixed at `from_x`; `points` is the number of grid points per relay.
    fn best_from(&self, k: usize, from_x: f64, points: u32) -> f64 {
        let worst_hop = |x: f64| {
            let here = self.sir_relay(k, from_x, x).unwrap_or(0.0);
            let rest = if k < self.len() {
                self.best_from(k + 1, x, points)
            } else {
                self.sir_rx(x).unwrap_or(0.0)
            };
            here.min(rest)
        };
        let from = from_x + self.least_advance(k, self.min_separation_m);
        maximum(&self.grid(from, points), worst_hop)
    }

    /// Returns the x from `from_x` to Rx, m, that the search tries for a relay.
    ///
    /// About `points` of them are evenly spaced. The others are denser the closer they are to `from_x`, Rx or the
    /// interferer.
    fn grid(&self, from_x: f64, points: u32) -> Vec<f64> {
        let span = self.distance_m - from_x;
        let steps = f64::from(points);
        let mut x = vec![from_x, self.distance_m];
        for i in 1..points {
            let share = f64::from(i) / steps;
            let close = 10_f64.powf(-8.0 * share) * span;
            x.extend([
                from_x + share * span,
                from_x + close,
                self.distance_m - close,
                self.x_i - close,
                self.x_i + close,
            ]);
        }
        x.retain(|x| (from_x..=self.distance_m).contains(x));
        x.sort_by(f64::total_cmp);
        x
    }
}

/// Returns the largest value of `f` found.
///
/// `f` is evaluated at the sorted points `x`, and then around the best local maxima.
fn maximum(x: &[f64], f: impl Fn(f64) -> f64) -> f64 {
    let samples: Vec<(f64, f64)> = x.iter().map(|&x| (x, f(x))).collect();
    let place = |i: Option<usize>| i.and_then(|i| samples.get(i)).copied();
    let mut peaks = Vec::new();
    for (i, &(x, value)) in samples.iter().enumerate() {
        let (left, right) = (place(i.checked_sub(1)), place(Some(i + 1)));
        if left.is_none_or(|left| left.1 <= value) && right.is_none_or(|right| right.1 <= value) {
            peaks.push((
                value,
                left.map_or(x, |left| left.0),
                right.map_or(x, |right| right.0),
            ));
        }
    }
    peaks.sort_by(|a, b| b.0.total_cmp(&a.0));
    peaks
        .iter()
        .take(PEAKS)
        .fold(0.0, |best, &(value, low, high)| {
            best.max(value).max(golden(low, high, &f))
        })
}

fn golden(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let ratio = (5_f64.sqrt() - 1.0) / 2.0;
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    let mut best = fa.max(fb);
    for _ in 0..STEPS {
        if fa < fb {
            (low, a, fa) = (a, b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        } else {
            (high, b, fb) = (b, a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        }
        best = best.max(fa).max(fb);
    }
    best
}
