//! Judge of chains with a way back: a grid search in f64, refined. It shares no code with the crate.

/// Chain of the tests' reference model: relays at one altitude above the line from Tx (x = 0) to Rx.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Chain {
    /// Distance from Tx to Rx, m.
    pub(crate) distance_m: f64,
    /// Powers of Tx, of the relays from Tx on, and of Rx, W.
    pub(crate) powers_w: Vec<f64>,
    /// Altitude of all relays, m; used if `altitudes_m` is empty.
    pub(crate) altitude_m: f64,
    /// Altitudes of the relays from Tx on, m. Empty if all relays have the common altitude.
    pub(crate) altitudes_m: Vec<f64>,
    /// Least distance between two neighbouring relays, m.
    pub(crate) apart_m: f64,
    /// Interferer: its power in W, and its x and y in m.
    pub(crate) interferer: [f64; 3],
    /// Further interferers, each with its power in W, and its x and y in m.
    pub(crate) others: Vec<[f64; 3]>,
    /// Field of interference, as points: x in m, and Upsilon = E[1/I] in 1/W; I is the interference power.
    ///
    /// The field replaces the interferer. The list is empty if there is an interferer.
    pub(crate) field: Vec<[f64; 2]>,
    /// Path-loss factors, 1/m^2. First the factor of links with a drone at one or both ends; second that of links on the ground.
    pub(crate) loss: [f64; 2],
    /// Noise power of every receiver, W.
    pub(crate) noise_w: f64,
    /// Required ratio of backward SIR (toward Tx) to forward SIR (toward Rx), above 0.
    pub(crate) reverse: f64,
}

/// Number of equal intervals in the grid with which the search begins.
const GRID: usize = 300;

/// Number of grid points with which the search refines a relay's position.
///
/// It is odd, so that the present position is one of the grid points.
const WINDOW: usize = 15;

impl Chain {
    /// Returns the number of relays in the chain.
    pub(crate) fn relays(&self) -> usize {
        self.powers_w.len() - 2
    }

    /// Returns the altitude of `node`, m; 0 for Tx and Rx.
    fn height_m(&self, node: usize) -> f64 {
        if node == 0 || node > self.relays() {
            return 0.0;
        }
        let own = self.altitudes_m.get(node - 1);
        own.copied().unwrap_or(self.altitude_m)
    }

    /// Returns the power of interference plus noise that `node` receives at x = `x`, W.
    fn disturbance_w(&self, node: usize, x: f64) -> f64 {
        if let [first, .., last] | [first @ last] = self.field.as_slice() {
            // With noise, the field is 1 / (I + N) at each point, and linear between the points.
            let heard = |upsilon: f64| 1.0 / (1.0 / upsilon + self.noise_w);
            let around = self
                .field
                .windows(2)
                .find(|pair| x >= pair[0][0] && x <= pair[1][0]);
            let upsilon = match around {
                Some([[x0, a], [x1, b]]) => {
                    heard(*a) + (heard(*b) - heard(*a)) * (x - x0) / (x1 - x0)
                }
                _ if x < first[0] => heard(first[1]),
                _ => heard(last[1]),
            };
            return 1.0 / upsilon;
        }
        let on_ground = node == 0 || node > self.relays();
        let (h, loss) = if on_ground {
            (0.0, self.loss[1])
        } else {
            (self.height_m(node), self.loss[0])
        };
        let sources = [self.interferer]
            .into_iter()
            .chain(self.others.iter().copied());
        let each = sources
            .map(|[power_w, xi, yi]| power_w / (loss * ((x - xi).powi(2) + yi * yi + h * h)));
        each.sum::<f64>() + self.noise_w
    }

    /// Returns a hop's two-way SIR: the smaller of its forward SIR and backward SIR / `reverse`.
    ///
    /// The hop goes from x = `from` to x = `to`, m, and ends at `node` (0 is Tx, N + 1 is Rx). The result is 0 if two
    /// relays are too close.
    pub(crate) fn hop(&self, node: usize, from: f64, to: f64) -> f64 {
        let climb = self.height_m(node) - self.height_m(node - 1);
        let squared = (to - from).powi(2) + climb * climb;
        let is_between = node > 1 && node <= self.relays();
        if is_between && squared.sqrt() < self.apart_m - 1e-7 * self.distance_m {
            return 0.0;
        }
        let gain = 1.0 / (self.loss[0] * squared);
        let there = self.powers_w[node - 1] * gain / self.disturbance_w(node, to);
        let back = self.powers_w[node] * gain / self.disturbance_w(node - 1, from);
        there.min(back / self.reverse)
    }

    /// Returns the two-way SIR of a chain's worst hop, with the relays at `x`.
    ///
    /// The two-way SIR of a hop is the smaller of its forward SIR and its backward SIR divided by `reverse`.
    pub(crate) fn value(&self, x: &[f64]) -> f64 {
        let mut from = 0.0;
        let mut worst = f64::INFINITY;
        for (node, &to) in (1..).zip(x.iter().chain([&self.distance_m])) {
            worst = worst.min(self.hop(node, from, to));
            from = to;
        }
        worst
    }

    /// Returns the positions with the best SIR of the worst hop, with relay k at a point of `grids[k - 1]`.
    ///
    /// The SIR of a hop is the smaller of forward SIR and backward SIR / `reverse`. The points of a grid are in
    /// ascending order.
    fn best_on(&self, grids: &[Vec<f64>]) -> Vec<f64> {
        let first = grids[0].iter().map(|&x| self.hop(1, 0.0, x));
        let mut best: Vec<f64> = first.collect();
        let mut before: Vec<Vec<usize>> = Vec::new();
        for (node, pair) in (2..).zip(grids.windows(2)) {
            let step = |&to: &f64| {
                let mut found = (f64::NEG_INFINITY, 0);
                for (at, (&from, &sofar)) in pair[0].iter().zip(&best).enumerate() {
                    if from > to {
                        break;
                    }
                    if sofar > found.0 {
                        let value = sofar.min(self.hop(node, from, to));
                        if value > found.0 {
                            found = (value, at);
                        }
                    }
                }
                found
            };
            let next: Vec<(f64, usize)> = pair[1].iter().map(step).collect();
            best = next.iter().map(|(value, _)| *value).collect();
            before.push(next.iter().map(|(_, at)| *at).collect());
        }
        let last = grids.last().unwrap();
        let ends = last.iter().zip(&best);
        let ends = ends.map(|(&x, &v)| v.min(self.hop(grids.len() + 1, x, self.distance_m)));
        let at = ends
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap()
            .0;
        let mut ats = vec![at];
        for table in before.iter().rev() {
            ats.push(table[*ats.last().unwrap()]);
        }
        let places = grids.iter().zip(ats.iter().rev());
        places.map(|(grid, &at)| grid[at]).collect()
    }

    /// Returns the x values of the grid with which the search begins, m.
    ///
    /// The grid is dense near the interferer, Tx and Rx.
    fn grid(&self) -> Vec<f64> {
        let d = self.distance_m;
        // The minimum separation is a whole number of steps.
        let step = self.apart_m / (self.apart_m * GRID as f64 / d).ceil().max(1.0);
        let step = if step > 0.0 { step } else { d / GRID as f64 };
        let even = (0..).map(|i| step * f64::from(i)).take_while(|x| *x <= d);
        let mut points: Vec<f64> = even.collect();
        for about in [0.0, d, self.interferer[1]] {
            for i in 0..24 {
                let off = d * 1e-4 * 1.35_f64.powi(i);
                points.extend([about - off, about, about + off]);
            }
        }
        points.retain(|x| (0.0..=d).contains(x));
        points.sort_by(f64::total_cmp);
        points.dedup();
        points
    }

    /// Improves the positions `start` by grid searches around each position. When a grid gives no improvement, a finer grid follows.
    ///
    /// Returns the SIR of the worst hop, and the positions. The SIR of a hop is the smaller of forward SIR and
    /// backward SIR / `reverse`.
    pub(crate) fn refined(&self, start: &[f64]) -> (f64, Vec<f64>) {
        let mut x = start.to_vec();
        let mut value = self.value(&x);
        let mut width = self.distance_m / 50.0;
        let mut tries = 0;
        while width > 1e-7 * self.distance_m && tries < 400 {
            tries += 1;
            let half = WINDOW as f64 / 2.0;
            let around = |&at: &f64| -> Vec<f64> {
                let point = |i: usize| at + width * (i as f64 + 0.5 - half) / half;
                (0..WINDOW)
                    .map(|i| point(i).clamp(0.0, self.distance_m))
                    .collect()
            };
            let grids: Vec<Vec<f64>> = x.iter().map(around).collect();
            let next = self.best_on(&grids);
            let better = self.value(&next);
            let gained = better > value * (1.0 + 1e-3 * (width / self.distance_m).min(1e-2));
            if better > value {
                (x, value) = (next, better);
            }
            if !gained {
                width *= 0.6;
            }
        }
        (value, x)
    }

    /// Returns the best SIR of the worst hop, and the relays' positions, by grid search and refinement.
    ///
    /// The SIR of a hop is the smaller of forward SIR and backward SIR / `reverse`.
    pub(crate) fn best(&self) -> (f64, Vec<f64>) {
        let grid = self.grid();
        let start = self.best_on(&vec![grid; self.relays()]);
        self.refined(&start)
    }
}

#[cfg(test)]
mod tests {
    use super::Chain;

    #[test]
    fn without_interference_relays_between_equal_ends_are_even() {
        let chain = Chain {
            distance_m: 1000.0,
            powers_w: vec![1.0; 6],
            altitude_m: 1e-3,
            altitudes_m: Vec::new(),
            apart_m: 0.0,
            interferer: [1e-9, 0.0, 1e6],
            others: Vec::new(),
            field: Vec::new(),
            loss: [1.0, 1.0],
            noise_w: 1e-3,
            reverse: 1.0,
        };
        let (value, x) = chain.best();
        assert!((value / (1.0 / 40.0) - 1.0).abs() < 1e-4, "{value} {x:?}");
    }
}
