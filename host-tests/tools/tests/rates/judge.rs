//! Independent computation of the best data rates.
//!
//! It uses dynamic programming on its own grid in f64, and then moves one relay after the other. It shares no code with
//! the planner or the crate.

/// Data rate of a hop by its SINR, bit/s/Hz.
#[derive(Debug, Clone)]
pub(crate) enum Model {
    /// Shannon's formula log2(1 + SINR / gap). The field is the gap, linear.
    Gap(f64),
    /// Rate steps of a radio: least SINR, linear, and bit/s/Hz of each.
    Steps(Vec<(f64, f64)>),
}

/// Independent model of a chain and its data rate. All relays have one altitude, and y = 0.
#[derive(Debug, Clone)]
pub(crate) struct Chain {
    /// Distance from Tx to Rx, m.
    pub(crate) distance_m: f64,
    /// Common altitude of the relays, m.
    pub(crate) altitude_m: f64,
    /// Minimum distance between neighbouring relays along x, m.
    pub(crate) apart_m: f64,
    /// Transmit powers of Tx, of the relays in order, and of Rx, W.
    pub(crate) powers_w: Vec<f64>,
    /// Interferer: its power in W, and its x and y in m.
    pub(crate) interferer: [f64; 3],
    /// Path-loss factors, 1/m^2: of links with a drone, and of links on the ground.
    pub(crate) loss: [f64; 2],
    /// Noise power of every receiver, W.
    pub(crate) noise_w: f64,
    /// Required data rate to Tx, as a fraction of the data rate to Rx; 0 for one direction.
    pub(crate) reverse: f64,
    /// True if each time slot is as long as its hop needs; false for equal slots.
    pub(crate) fitted: bool,
    /// Data rate of a hop by its SINR.
    pub(crate) model: Model,
}

/// Number of equidistant grid points between Tx and Rx.
///
/// The grid has further points near Tx, Rx and the interferer.
const EVEN: usize = 171;

/// Number of equal cells between Tx and Rx whose edges are also tried, for a radio with rate steps.
const CELLS: usize = 400;

/// Largest number of unfinished chains that are kept for each cell, for a radio with rate steps.
const KEPT: usize = 4;

/// Inverse of the golden ratio, for golden-section search.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Chain {
    /// Returns the number of relays in the chain.
    pub(crate) fn relays(&self) -> usize {
        self.powers_w.len() - 2
    }

    fn bits(&self, sinr: f64) -> f64 {
        match &self.model {
            Model::Gap(gap) => (1.0 + sinr / gap).log2(),
            Model::Steps(steps) => {
                let met = steps.iter().filter(|step| sinr >= step.0);
                met.map(|step| step.1).fold(0.0, f64::max)
            }
        }
    }

    fn disturbance_w(&self, on_ground: bool, x: f64) -> f64 {
        let [power_w, xi, yi] = self.interferer;
        let (h, loss) = if on_ground {
            (0.0, self.loss[1])
        } else {
            (self.altitude_m, self.loss[0])
        };
        power_w / (loss * ((x - xi).powi(2) + yi * yi + h * h)) + self.noise_w
    }

    /// Returns the time for one bit on the hop to `node`, in units of 1 / bandwidth.
    ///
    /// The hop goes from x = `from` to x = `to`, m. Node 0 is Tx, and node `last` is Rx.
    fn time(&self, node: usize, last: usize, from: f64, to: f64) -> f64 {
        let (first, end) = (node == 1, node == last);
        let least = if first || end { 0.0 } else { self.apart_m };
        if to - from < least - 1.2e-7 * self.distance_m {
            return f64::INFINITY;
        }
        let climb = if first || end { self.altitude_m } else { 0.0 };
        let gain = 1.0 / (self.loss[0] * ((to - from).powi(2) + climb * climb));
        let receiver_w = if end {
            self.powers_w[self.powers_w.len() - 1]
        } else {
            self.powers_w[node]
        };
        let there = 1.0 / self.bits(self.powers_w[node - 1] * gain / self.disturbance_w(end, to));
        if self.reverse == 0.0 {
            return there;
        }
        let back = self.reverse / self.bits(receiver_w * gain / self.disturbance_w(first, from));
        if self.fitted {
            there + back
        } else {
            there.max(back)
        }
    }

    fn fold(&self, sofar: f64, hop: f64) -> f64 {
        if self.fitted {
            sofar + hop
        } else {
            sofar.max(hop)
        }
    }

    /// Returns the time for one bit of a chain with relays at `x`, m, in units of 1 / bandwidth.
    ///
    /// With fitted slots it is the sum over all hops, otherwise the time of the slowest hop.
    fn total(&self, x: &[f64]) -> f64 {
        let last = x.len() + 1;
        let mut from = 0.0;
        let mut total = 0.0;
        for (node, &to) in (1..).zip(x.iter().chain([&self.distance_m])) {
            total = self.fold(total, self.time(node, last, from, to));
            from = to;
        }
        total
    }

    /// Returns the data rate of a chain with relays at `x`, m, in bit/s/Hz.
    ///
    /// For data in both directions it is the smaller of two values: the rate to Rx, and the rate to Tx divided by
    /// `reverse`.
    pub(crate) fn rate(&self, x: &[f64]) -> f64 {
        self.rate_of(self.total(x), x.len())
    }

    fn rate_of(&self, total: f64, relays: usize) -> f64 {
        match (self.fitted, self.reverse > 0.0) {
            (true, _) => 1.0 / total,
            (false, false) => 1.0 / total / (relays as f64 + 1.0),
            (false, true) => 0.5 / total / (relays as f64 + 1.0),
        }
    }

    /// Returns a copy of the chain with only the first `relays` relays.
    pub(crate) fn with(&self, relays: usize) -> Self {
        let mut powers_w = self.powers_w[..=relays].to_vec();
        powers_w.extend(self.powers_w.last());
        Self {
            powers_w,
            ..self.clone()
        }
    }

    fn grid(&self) -> Vec<f64> {
        let d = self.distance_m;
        // The points are denser toward both ends.
        let even = (0..EVEN).map(|i| {
            let t = i as f64 / (EVEN - 1) as f64;
            d * (0.5 * t + 0.5 * t * t * (3.0 - 2.0 * t))
        });
        let mut points: Vec<f64> = even.collect();
        for about in [0.0, d, self.interferer[1]] {
            for i in 0..16 {
                let off = 2e-4 * d * 1.6_f64.powi(i);
                points.extend([about - off, about + off]);
            }
        }
        points.retain(|x| (0.0..=d).contains(x));
        points.sort_by(f64::total_cmp);
        points
    }

    /// Returns the x of the relays with the largest rate on the grid.
    ///
    /// There is a list for each number of relays from 1.
    fn on_grid(&self) -> Vec<Vec<f64>> {
        let grid = self.grid();
        let never = usize::MAX - 1;
        let mut best: Vec<f64> = grid.iter().map(|&x| self.time(1, never, 0.0, x)).collect();
        let mut tables: Vec<Vec<usize>> = Vec::new();
        let mut all = Vec::new();
        for relays in 1..=self.relays() {
            if relays > 1 {
                let mut next = vec![f64::INFINITY; grid.len()];
                let mut table = vec![0; grid.len()];
                for (to, &x) in grid.iter().enumerate() {
                    for (from, &y) in grid[..=to].iter().enumerate() {
                        if best[from] >= next[to] {
                            continue;
                        }
                        let time = self.fold(best[from], self.time(relays, never, y, x));
                        if time < next[to] {
                            (next[to], table[to]) = (time, from);
                        }
                    }
                }
                best = next;
                tables.push(table);
            }
            let end = |at: &usize| {
                let last = self.time(relays + 1, relays + 1, grid[*at], self.distance_m);
                self.fold(best[*at], last)
            };
            let ends = (0..grid.len()).min_by(|a, b| end(a).total_cmp(&end(b)));
            let mut path = vec![ends.unwrap()];
            for table in tables.iter().rev() {
                path.push(table[*path.last().unwrap()]);
            }
            all.push(path.iter().rev().map(|at| grid[*at]).collect());
        }
        all
    }

    /// Returns the x of the relays with the largest rate for a radio with rate steps, m.
    ///
    /// There is a list of x for each number of relays from 1. The search extends chains from Tx relay by relay. In each
    /// cell of a grid it keeps the few unfinished chains with the least times; of chains with equal times, the one that
    /// ends farther from Tx. It tries the next relay at all grid points, and at all x at which the time of the hop
    /// changes.
    fn by_changes(&self) -> Vec<Vec<f64>> {
        let mut grid = self.grid();
        grid.extend((0..=CELLS).map(|i| self.distance_m * i as f64 / CELLS as f64));
        grid.sort_by(f64::total_cmp);
        let never = usize::MAX - 1;
        let mut layers: Vec<Vec<(f64, f64, usize)>> = vec![vec![(0.0, 0.0, 0)]];
        let mut all = Vec::new();
        for relays in 1..=self.relays() {
            let mut cells: Vec<Vec<(f64, f64, usize)>> = vec![Vec::new(); grid.len() + 1];
            for (before, &(from, sofar, _)) in layers.last().unwrap().iter().enumerate() {
                let time = |to: f64| self.time(relays, never, from, to);
                let mut offer = |x: f64, hop: f64| {
                    let total = sofar + hop;
                    let cell = &mut cells[grid.partition_point(|edge| *edge <= x)];
                    let excels = |a: (f64, f64), b: (f64, f64)| a.0 >= b.0 && a.1 < b.1 + 1e-12;
                    if !total.is_finite() || cell.iter().any(|c| excels((c.0, c.1), (x, total))) {
                        return;
                    }
                    cell.retain(|c| !excels((x, total), (c.0, c.1)));
                    cell.push((x, total, before));
                    if cell.len() > KEPT {
                        cell.sort_by(|a, b| a.1.total_cmp(&b.1));
                        cell.pop();
                    }
                };
                let first = from + if relays > 1 { self.apart_m } else { 0.0 };
                let mut low = (first, time(first));
                offer(first, low.1);
                for &x in &grid[grid.partition_point(|x| *x <= first)..] {
                    let at = time(x);
                    if at != low.1 {
                        let (mut inside, mut outside) = (low.0, x);
                        while outside - inside > 1e-9 {
                            let middle = f64::midpoint(inside, outside);
                            if time(middle) == low.1 {
                                inside = middle;
                            } else {
                                outside = middle;
                            }
                        }
                        offer(inside, low.1);
                    }
                    offer(x, at);
                    low = (x, at);
                }
            }
            layers.push(cells.into_iter().flatten().collect());
            let end = |label: &(f64, f64, usize)| {
                label.1 + self.time(relays + 1, relays + 1, label.0, self.distance_m)
            };
            let ends = layers.last().unwrap().iter().enumerate();
            let best = ends.min_by(|a, b| end(a.1).total_cmp(&end(b.1)));
            let mut at = best.map_or(usize::MAX, |best| best.0);
            let mut x = Vec::new();
            for layer in layers[1..].iter().rev() {
                let (here, _, before) = layer.get(at).copied().unwrap_or_default();
                x.push(here);
                at = before;
            }
            x.reverse();
            all.push(x);
        }
        all
    }

    /// Returns the x of the relays with the largest rate found.
    ///
    /// There is a list for each number of relays from 1. No initial positions are needed.
    fn searched(&self) -> Vec<Vec<f64>> {
        let mut all = self.on_grid();
        if self.fitted && matches!(self.model, Model::Steps(_)) {
            for (x, other) in all.iter_mut().zip(self.by_changes()) {
                let chain = self.with(x.len());
                if chain.rate(&other) > chain.rate(x) {
                    *x = other;
                }
            }
        }
        all
    }

    /// Improves the x `start` of the relays by golden-section search.
    ///
    /// It moves groups of one to four neighbouring relays together.
    fn improved(&self, start: &[f64]) -> Vec<f64> {
        let mut x = start.to_vec();
        let mut best = self.total(&x);
        let mut span = 0.03 * self.distance_m;
        while span > 1e-6 * self.distance_m {
            let before = best;
            for group in (1..=x.len()).take(4) {
                for first in 0..=x.len() - group {
                    let moved = |by: f64| {
                        let mut moved = x.clone();
                        for x in &mut moved[first..first + group] {
                            *x = (*x + by).clamp(0.0, self.distance_m);
                        }
                        moved
                    };
                    let (mut low, mut high) = (-span, span);
                    for _ in 0..14 {
                        let one = high - GOLDEN * (high - low);
                        let other = low + GOLDEN * (high - low);
                        if self.total(&moved(one)) < self.total(&moved(other)) {
                            high = other;
                        } else {
                            low = one;
                        }
                    }
                    let next = moved(f64::midpoint(low, high));
                    let total = self.total(&next);
                    if total < best {
                        (x, best) = (next, total);
                    }
                }
            }
            if !(best < before * (1.0 - 1e-6)) {
                span *= 0.3;
            }
        }
        x
    }

    /// Returns the largest data rates found by two searches with all relays of the chain, bit/s/Hz.
    ///
    /// The first search starts from its own grid. The second search also starts from the x in `others`, m.
    pub(crate) fn best(&self, others: &[f64]) -> [f64; 2] {
        let grid = self.searched();
        let starts = [grid.last().unwrap().as_slice(), others];
        let rates = starts.map(|start| self.rate(&self.improved(start)));
        [rates[0], rates[0].max(rates[1])]
    }

    /// Returns the largest data rate found with any number of relays, bit/s/Hz, and this number.
    pub(crate) fn best_number(&self) -> (f64, usize) {
        let grid = self.searched();
        let mut starts: Vec<&Vec<f64>> = grid.iter().collect();
        let rate = |x: &[f64]| self.with(x.len()).rate(x);
        starts.sort_by(|a, b| rate(b).total_cmp(&rate(a)));
        let best = starts.iter().take(3).map(|start| {
            let chain = self.with(start.len());
            (chain.rate(&chain.improved(start)), start.len())
        });
        best.fold(
            (0.0, 0),
            |one, other| if other.0 > one.0 { other } else { one },
        )
    }
}
