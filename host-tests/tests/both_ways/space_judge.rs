//! Judge of chains with a way back and free altitudes and lateral offsets, in f64. It shares no code with the crate.
//!
//! The judge has candidate positions for each relay. Dynamic programming over the hops finds the combination with the
//! best worst hop. The first candidates are a grid over the whole space. Then they are randomly shifted windows around
//! the best positions, which shrink when they no longer help. Chains at one altitude are refined as well. Relays may be
//! in any order along the line.

use rand::{Rng, RngExt};

use super::judge::Chain;

/// Position of a relay, m: x along the line Tx-Rx, lateral offset y, and altitude h.
pub(crate) type Place = [f64; 3];

/// Chain whose relays may take any position within limits of x, lateral offset and altitude.
#[derive(Debug, Clone)]
pub(crate) struct Space {
    /// Chain with the powers, the interferer, the noise and r. r is the required ratio of backward to forward SIR.
    /// The common altitude of the chain is not used.
    pub(crate) chain: Chain,
    /// Lowest and highest lateral offset of the relays, m.
    pub(crate) lateral_m: [f64; 2],
    /// Lowest and highest altitude of the relays, m.
    pub(crate) band_m: [f64; 2],
}

/// Numbers of grid points along x, y and h with which the search begins.
///
/// The first row is for relays that may have lateral offsets, the second row for relays without.
const GRID: [[usize; 3]; 2] = [[36, 9, 5], [64, 1, 10]];

/// Numbers of grid points along x, y and h with which the search refines a position.
///
/// The first row is for relays that may have lateral offsets, the second row for relays without.
const WINDOW: [[usize; 3]; 2] = [[5, 5, 5], [7, 1, 7]];

impl Space {
    fn relays(&self) -> usize {
        self.chain.relays()
    }

    fn is_flat(&self) -> bool {
        self.lateral_m[0] >= self.lateral_m[1]
    }

    /// Returns the power of interference plus noise that `node` receives at the position (x, y, h), W.
    fn disturbance_w(&self, node: usize, [x, y, h]: Place) -> f64 {
        let [power_w, xi, yi] = self.chain.interferer;
        let is_on_ground = node == 0 || node > self.relays();
        let loss = self.chain.loss[usize::from(is_on_ground)];
        power_w / (loss * ((x - xi).powi(2) + (y - yi).powi(2) + h * h)) + self.chain.noise_w
    }

    /// Returns a hop's two-way SIR: the smaller of its forward SIR and its backward SIR / r. r is the required ratio of backward to forward
    /// SIR. The hop leads from `from` to `to`, the position of `node` (0 is Tx, N + 1 is Rx).
    fn hop(&self, node: usize, from: Place, to: Place) -> f64 {
        let squared: f64 = (0..3).map(|i| (to[i] - from[i]).powi(2)).sum();
        let gain = 1.0 / (self.chain.loss[0] * squared.max(1e-9));
        let there = self.chain.powers_w[node - 1] * gain / self.disturbance_w(node, to);
        let back = self.chain.powers_w[node] * gain / self.disturbance_w(node - 1, from);
        there.min(back / self.chain.reverse)
    }

    /// Returns the two-way SIR of the worst hop, with the relays at `places`. The two-way SIR is the smaller of
    /// forward SIR and backward SIR / r; r is the required ratio of backward to forward SIR.
    pub(crate) fn value(&self, places: &[Place]) -> f64 {
        let rx = [self.chain.distance_m, 0.0, 0.0];
        let ends = places.iter().chain([&rx]);
        let starts = [[0.0; 3]].into_iter().chain(places.iter().copied());
        (1..)
            .zip(starts.zip(ends))
            .map(|(node, (from, to))| self.hop(node, from, *to))
            .fold(f64::INFINITY, f64::min)
    }

    /// Returns the best positions of all relays, each from the list of its `candidates`. Best is the highest two-way
    /// SIR of the worst hop. The two-way SIR of a hop is the smaller of its forward SIR and its backward SIR / r.
    fn best_on(&self, candidates: &[Vec<Place>]) -> Vec<Place> {
        let first = candidates[0].iter().map(|to| self.hop(1, [0.0; 3], *to));
        let mut best: Vec<f64> = first.collect();
        let mut before: Vec<Vec<usize>> = Vec::new();
        for (node, pair) in (2..).zip(candidates.windows(2)) {
            let mut order: Vec<usize> = (0..best.len()).collect();
            order.sort_by(|a, b| best[*b].total_cmp(&best[*a]));
            let step = |to: &Place| {
                let mut found = (f64::NEG_INFINITY, 0);
                for &at in &order {
                    if best[at] <= found.0 {
                        break;
                    }
                    let value = best[at].min(self.hop(node, pair[0][at], *to));
                    if value > found.0 {
                        found = (value, at);
                    }
                }
                found
            };
            let next: Vec<(f64, usize)> = pair[1].iter().map(step).collect();
            best = next.iter().map(|(value, _)| *value).collect();
            before.push(next.iter().map(|(_, at)| *at).collect());
        }
        let rx = [self.chain.distance_m, 0.0, 0.0];
        let ends = candidates.last().unwrap().iter().zip(&best);
        let ends = ends.map(|(from, value)| value.min(self.hop(candidates.len() + 1, *from, rx)));
        let last = ends.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        let mut ats = vec![last.unwrap().0];
        for table in before.iter().rev() {
            ats.push(table[*ats.last().unwrap()]);
        }
        let chosen = candidates.iter().zip(ats.iter().rev());
        chosen.map(|(places, &at)| places[at]).collect()
    }

    fn grid(&self) -> Vec<Place> {
        let [nx, ny, nh] = GRID[usize::from(self.is_flat())];
        let share = |i: usize, n: usize| i as f64 / (n.max(2) - 1) as f64;
        let between = |[low, high]: [f64; 2], share: f64| low + share * (high - low);
        let mut points = Vec::new();
        for (i, j, k) in (0..nx * ny * nh).map(|p| (p / ny / nh, p / nh % ny, p % nh)) {
            points.push([
                self.chain.distance_m * share(i, nx),
                between(self.lateral_m, share(j, ny)),
                between(self.band_m, share(k, nh).powi(2)),
            ]);
        }
        points
    }

    /// Returns positions to try around `at`: a randomly shifted grid, about `width` metres to each side.
    fn window(&self, at: Place, width: f64, rng: &mut impl Rng) -> Vec<Place> {
        let counts = WINDOW[usize::from(self.is_flat())];
        let jitter: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.2..0.2));
        let limits = [[0.0, self.chain.distance_m], self.lateral_m, self.band_m];
        let axis = |a: usize| -> Vec<f64> {
            let n = counts[a];
            let off = |i: usize| (i as f64 / (n.max(2) - 1) as f64 * 2.0 - 1.0 + jitter[a]) * width;
            let off = (0..n).map(|i| if n == 1 { 0.0 } else { off(i) });
            off.map(|off| (at[a] + off).clamp(limits[a][0], limits[a][1]))
                .collect()
        };
        let [xs, ys, hs] = [axis(0), axis(1), axis(2)];
        let mut points = vec![at];
        for x in xs {
            for &y in &ys {
                points.extend(hs.iter().map(|&h| [x, y, h]));
            }
        }
        points
    }

    /// Improves the positions `start` by searches in a window around each position.
    ///
    /// Returns the worst hop's two-way SIR (smaller of forward SIR and backward SIR / r), and the positions. Windows
    /// first extend `width` metres to each side; when they give no improvement, smaller windows follow.
    pub(crate) fn refined(
        &self,
        start: &[Place],
        mut width: f64,
        rng: &mut impl Rng,
    ) -> (f64, Vec<Place>) {
        let d = self.chain.distance_m;
        let (mut places, mut value) = (start.to_vec(), self.value(start));
        for _ in 0..300 {
            if width <= 1e-6 * d {
                break;
            }
            let windows: Vec<_> = places
                .iter()
                .map(|at| self.window(*at, width, rng))
                .collect();
            let next = self.best_on(&windows);
            let better = self.value(&next);
            let is_gain = better > value * (1.0 + (1e-2 * width / d).max(2e-6));
            if better > value {
                (places, value) = (next, better);
            }
            if !is_gain {
                width *= 0.6;
            }
        }
        (value, places)
    }

    /// Returns the best two-way SIR of the worst hop that the whole search finds, and its positions. The two-way SIR
    /// of a hop is the smaller of its forward SIR and its backward SIR / r.
    pub(crate) fn best(&self, rng: &mut impl Rng) -> (f64, Vec<Place>) {
        let (relays, d) = (self.relays(), self.chain.distance_m);
        let start = self.best_on(&vec![self.grid(); relays]);
        let mut best = self.refined(&start, 0.03 * d, rng);
        let middle = 0.5 * (self.band_m[0] + self.band_m[1]);
        let away = if self.chain.interferer[2] > 0.0 {
            0.6 * self.lateral_m[0]
        } else {
            0.6 * self.lateral_m[1]
        };
        for (y, h) in [(0.0, middle), (away, middle), (0.0, self.band_m[0])] {
            let even = |k: usize| [d * k as f64 / (relays + 1) as f64, y, h];
            let start: Vec<Place> = (1..=relays).map(even).collect();
            let other = self.refined(&start, 0.06 * d, rng);
            if other.0 > best.0 {
                best = other;
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::{Chain, Space};
    use host_tests::placing::generator;

    /// Checks that hops of equal length on the line are best with strong noise and a far, weak interferer.
    #[test]
    fn relays_in_noise_alone_are_even_and_on_the_line() {
        let space = Space {
            chain: Chain {
                distance_m: 1000.0,
                powers_w: vec![1.0; 5],
                altitude_m: 0.0,
                altitudes_m: Vec::new(),
                apart_m: 0.0,
                interferer: [1e-9, 0.0, 1e6],
                loss: [1.0, 1.0],
                noise_w: 1e-3,
                field: Vec::new(),
                others: Vec::new(),
                reverse: 1.0,
            },
            lateral_m: [-100.0, 100.0],
            band_m: [1e-3, 100.0],
        };
        let (best, _) = space.best(&mut generator(1));
        assert!((best * 62.5 - 1.0).abs() < 1e-4, "{best}");
    }
}
