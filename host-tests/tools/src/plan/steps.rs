//! Positions for fitted slots of a radio with rate steps, by a search over exact positions.
//!
//! A rate step is a data rate of the radio, with the least SINR that it requires. The time of a hop is constant between
//! two steps. The hops of the best chain may therefore be exactly as long as their steps allow, and a grid misses such
//! a chain by a millimetre. This search extends chains hop by hop. It tries the next relay at the farthest position of
//! each step, forward (to Rx) and backward (to Tx):
//!
//! ```text
//! forward     largest y with  P(k) g(y - x) / (I(y) + N) >= step      I at the receiver y: a scan of a table, then bisection
//! backward    largest y with  P(k + 1) g(y - x) / (I(x) + N) >= step  I at the receiver x: closed form
//! ```
//!
//! A chain is dropped if another chain of as many relays takes no more time, ends farther from Tx, and receives the
//! next relay from as far away in the backward direction at each step. In one direction only, the farther end is always
//! better. For both directions, a relay before an interferer may be better farther away from it, so points of a grid
//! are tried there, too.
//!
//! A chain is also dropped if a lower bound on the time of its remaining hops excludes a gain. For the bound the line
//! Tx-Rx is divided into cells. A hop between two cells counts with their smallest distance and least interference.
//! Times for one bit are in s Hz: the time in s for a bandwidth of 1 Hz.

use std::rc::Rc;

use uav_relay_scenario::number::narrow;

use super::path::{Hop, Point, Times};

/// Number of equal cells between Tx and Rx.
const CELLS: u16 = 800;

/// Smallest relative decrease of a chain's time for one bit that the search looks for.
const GAIN: f64 = 2e-5;

/// Largest relative difference of two chains' times for one bit that count as equal.
///
/// If two chains have equal times, the search keeps the one whose last relay is farther from Tx.
const SAME: f64 = 1e-4;

/// Largest gain in hop length toward Tx that the search neglects, as a fraction of the distance Tx-Rx.
const SLIGHT: f64 = 1e-6;

/// Number of bisection steps in a cell for the farthest x at which a hop has the SINR of a rate step.
const HALVINGS: u8 = 40;

/// Beginning of a chain: the hops from Tx to the relay at `point`. Together they need `time` for one bit, s Hz.
#[derive(Clone, Copy)]
struct Label {
    point: Point,
    time: f64,
    /// Index of the chain without its last hop, in the list of chains that end at the previous relay.
    before: usize,
}

/// Tables of one hop: limits of its sender's x, and its time for one bit.
struct Reaches {
    hop: Hop,
    /// Smallest x of the sender, m, at which the receiver has the SINR that a rate step requires.
    ///
    /// There is a row for each rate step, with a value for each x of the receiver on the grid. Infinite if the hop
    /// would be shorter than the minimum separation.
    nearest: Vec<Vec<f64>>,
    /// Lower bounds on the hop's time for one bit, s Hz.
    ///
    /// There is a row for each cell (interval of x) of the sender, with a value for each cell of the receiver.
    least: Vec<f64>,
}

/// Search for the chain with the least time for one bit, for fitted slots and rate steps.
struct Search<'a> {
    times: &'a Times<'a>,
    /// x of the edges of all cells, m, ascending. Each is exact as an f32.
    grid: Vec<f64>,
    /// Width of a cell, m.
    width: f64,
    /// Upper limit on a chain's time for one bit, s Hz.
    below: f64,
}

/// Returns the x of the relays, m, in the best chain that needs less than `time` for one bit, s Hz.
///
/// `None` if there is no such chain, or if the radio has no rate steps.
pub(super) fn shorter(times: &Times<'_>, time: f64) -> Option<Vec<f64>> {
    let slowest = times.steps.first()?.1;
    // Every chain that carries data needs at most this time.
    let most = (times.relays() + 1) as f64 * (1.0 + times.reverse) / slowest;
    let d = times.scene.distance_m;
    let edge = |cell| f64::from(narrow(d * f64::from(cell) / f64::from(CELLS)));
    let search = Search {
        times,
        grid: (0..=CELLS).map(edge).collect(),
        width: d / f64::from(CELLS),
        below: (time * (1.0 - GAIN)).min(most * (1.0 + GAIN)),
    };
    search.best()
}

impl Search<'_> {
    fn best(&self) -> Option<Vec<f64>> {
        let relays = self.times.relays();
        let mut kinds: Vec<Rc<Reaches>> = Vec::with_capacity(relays);
        for node in 1..=relays {
            let before = Some(node - 1).filter(|from| *from > 0);
            let hop = self.times.hop(before, Some(node));
            let same = kinds.iter().find(|kind| kind.hop == hop).cloned();
            kinds.push(same.unwrap_or_else(|| Rc::new(self.reaches(hop, node))));
        }
        // The largest x of each relay leaves room for the relays after it.
        let mut limit = self.times.scene.distance_m;
        let mut limits: Vec<f64> = Vec::with_capacity(relays);
        for kind in kinds.iter().rev() {
            limits.push(limit);
            limit -= kind.hop.least_m;
        }
        let bounds = self.bounds(&kinds);
        let tx = Label {
            point: self.times.tx(),
            time: 0.0,
            before: 0,
        };
        let mut layers = vec![vec![tx]];
        let hops = kinds.iter().zip(limits.iter().rev()).zip(&bounds);
        for (node, ((kind, limit), bound)) in (1..).zip(hops) {
            let next = self.extended(layers.last()?, node, kind, *limit, bound);
            layers.push(next);
        }
        let (last, rx) = (self.times.hop(Some(relays), None), self.times.rx());
        let total = |label: &Label| label.time + self.times.time(&last, label.point, rx, false);
        let ends = layers.last()?.iter().map(total).enumerate();
        let (mut at, time) = ends.min_by(|one, other| one.1.total_cmp(&other.1))?;
        if !(time < self.below) {
            return None;
        }
        let mut x = Vec::with_capacity(relays);
        for layer in layers.iter().skip(1).rev() {
            let label = layer.get(at)?;
            x.push(label.point.x);
            at = label.before;
        }
        x.reverse();
        Some(x)
    }

    /// Computes the tables of `hop`, whose receiver in the direction to Rx is relay `node`.
    fn reaches(&self, hop: Hop, node: usize) -> Reaches {
        let points: Vec<Point> = self
            .grid
            .iter()
            .map(|&x| self.times.point(node, x))
            .collect();
        let nearest = self.times.steps.iter().map(|(sinr, _)| {
            let from = |to: &Point| nearest(&hop, *sinr, *to);
            points.iter().map(from).collect()
        });
        let nearest = nearest.collect();
        let senders = if node == 1 {
            vec![self.times.tx()]
        } else {
            self.quietest(node - 1)
        };
        let receivers = self.quietest(node);
        let width = self.width;
        let mut least = Vec::with_capacity(senders.len() * receivers.len());
        for from in &senders {
            let from_end = if node == 1 { 0.0 } else { from.x + width };
            for to in &receivers {
                let apart = (to.x - from_end).max(0.0);
                let excluded = to.x < from.x - 0.5 * width
                    || to.x + width - from.x < hop.least_m - 1e-6 * self.times.scene.distance_m;
                let disturbances_w = [from.disturbance_w, to.disturbance_w];
                least.push(if excluded {
                    f64::INFINITY
                } else {
                    self.times.time_at(&hop, apart, disturbances_w, false)
                });
            }
        }
        Reaches {
            hop,
            nearest,
            least,
        }
    }

    /// Returns the smallest x of each cell, and the least interference plus noise of relay `node` there.
    ///
    /// The least interference plus noise, W, is taken as the smaller of the values at the two edges of the cell.
    fn quietest(&self, node: usize) -> Vec<Point> {
        let points: Vec<Point> = self
            .grid
            .iter()
            .map(|&x| self.times.point(node, x))
            .collect();
        let cells = points.iter().zip(points.iter().skip(1));
        let cells = cells.map(|(start, end)| Point {
            x: start.x,
            disturbance_w: start.disturbance_w.min(end.disturbance_w),
        });
        cells.collect()
    }

    /// Returns lower bounds on the time for one bit of all hops after a relay, s Hz.
    ///
    /// There is a row for each relay, with a value for each cell (interval of x) in which the relay may be.
    fn bounds(&self, kinds: &[Rc<Reaches>]) -> Vec<Vec<f64>> {
        let relays = kinds.len();
        let (last, rx) = (self.times.hop(Some(relays), None), self.times.rx());
        let width = self.width;
        let mut after: Vec<f64> = self
            .quietest(relays)
            .iter()
            .map(|from| {
                let apart = (rx.x - from.x - width).max(0.0);
                let disturbances_w = [from.disturbance_w, rx.disturbance_w];
                self.times.time_at(&last, apart, disturbances_w, false)
            })
            .collect();
        let mut bounds = Vec::with_capacity(relays);
        for kind in kinds.iter().skip(1).rev() {
            let rows = kind.least.chunks(after.len());
            let before = rows.map(|row| {
                let sums = row.iter().zip(&after).map(|(hop, after)| hop + after);
                sums.fold(f64::INFINITY, f64::min)
            });
            let before = before.collect();
            bounds.push(std::mem::replace(&mut after, before));
        }
        bounds.push(after);
        bounds.reverse();
        bounds
    }

    fn cell(&self, x: f64) -> usize {
        let cell = (x / self.width).floor();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let cell = cell.clamp(0.0, f64::from(CELLS - 1)) as usize;
        cell
    }

    /// Extends each chain of `labels` by a hop to relay `node`. Returns the chains that may lead to the best chain.
    ///
    /// `limit` is the largest permitted x of relay `node`, m. `bound` has a value for each cell that the relay may be
    /// in: a lower bound on the time for one bit of all hops after the relay, s Hz.
    fn extended(
        &self,
        labels: &[Label],
        node: usize,
        kind: &Reaches,
        limit: f64,
        bound: &[f64],
    ) -> Vec<Label> {
        let backward = Backward::new(self, node);
        let mut found: Vec<Label> = Vec::new();
        let mut at_grid: Vec<Option<Label>> = vec![None; backward.useful.len()];
        let mut ends = Vec::new();
        for (before, label) in labels.iter().enumerate() {
            self.ends(label.point, node, kind, &mut ends);
            let least = label.point.x + kind.hop.least_m;
            let label_at = |x: f64| {
                let point = self.times.point(node, x);
                let time = label.time + self.times.time(&kind.hop, label.point, point, false);
                let rest = bound.get(self.cell(x)).copied().unwrap_or(0.0);
                let promises = time + rest < self.below;
                promises.then_some(Label {
                    point,
                    time,
                    before,
                })
            };
            for end in &ends {
                let x = below(end.min(limit));
                if x >= least - 1e-7 * self.times.scene.distance_m {
                    found.extend(label_at(x));
                }
            }
            for (x, known) in backward.useful.iter().zip(&mut at_grid) {
                if *x < least || *x > limit {
                    continue;
                }
                if let Some(label) = label_at(*x)
                    && known.is_none_or(|other| label.time < other.time)
                {
                    *known = Some(label);
                }
            }
        }
        found.extend(at_grid.into_iter().flatten());
        self.undominated(found, &backward)
    }

    /// Collects in `ends` each x, m, of relay `node` at which its hop just has the SINR of a rate step.
    ///
    /// The hop starts at `from`, and is examined for data toward Rx and for data toward Tx, if any. The x of Rx is
    /// included. The list is not sorted.
    fn ends(&self, from: Point, node: usize, kind: &Reaches, ends: &mut Vec<f64>) {
        ends.clear();
        ends.push(self.times.scene.distance_m);
        let hop = &kind.hop;
        let start = from.x + hop.least_m;
        let first = self.grid.partition_point(|x| *x <= start);
        for ((sinr, _), row) in self.times.steps.iter().zip(&kind.nearest) {
            let is_met = |x: f64| nearest(hop, *sinr, self.times.point(node, x)) <= from.x;
            let (mut low, mut met) = (start, is_met(start));
            for (x, least) in self.grid.iter().zip(row).skip(first) {
                let meets = *least <= from.x;
                if met && !meets {
                    let (mut inside, mut outside) = (low, *x);
                    for _ in 0..HALVINGS {
                        let middle = f64::midpoint(inside, outside);
                        if is_met(middle) {
                            inside = middle;
                        } else {
                            outside = middle;
                        }
                    }
                    ends.push(inside);
                }
                (low, met) = (*x, meets);
            }
            if self.times.reverse > 0.0 {
                ends.extend(reach(hop, *sinr, from).map(|reach| from.x + reach));
            }
        }
    }

    /// Returns those of `labels` (beginnings of chains) that can lead to the best chain.
    ///
    /// Label a is left out if a label b ends farther from Tx, takes no more time, and at every rate step receives data
    /// toward Tx from a next node at the same or a larger x.
    fn undominated(&self, mut labels: Vec<Label>, backward: &Backward) -> Vec<Label> {
        let share = SAME * self.below / (self.times.relays() + 1) as f64;
        let order = |label: &Label| (label.time / share).floor();
        labels.sort_by(|one, other| {
            let by_time = order(one).total_cmp(&order(other));
            by_time.then(other.point.x.total_cmp(&one.point.x))
        });
        // Intervals of positions that are worse than a kept chain.
        let mut covered: Vec<[f64; 2]> = Vec::new();
        labels.retain(|label| {
            let x = label.point.x;
            if covered.iter().any(|[from, to]| (*from..=*to).contains(&x)) {
                return false;
            }
            let from = backward.dominated_from(self, label.point);
            covered.retain(|[low, high]| *low < from || *high > x);
            covered.push([from, x]);
            true
        });
        labels
    }
}

/// Range of a hop for data toward Tx: the largest x at which a relay can receive the next node.
///
/// The value depends on the relay's x and on the rate step. The search uses the table to compare a relay at a smaller x
/// with one at a larger x.
struct Backward {
    hop: Hop,
    /// Largest x of the next node, m, at which a relay at a grid point receives it at a rate step.
    ///
    /// There is a row for each rate step, with a value for each grid point. The x is at most the x of Rx.
    farthest: Vec<Vec<f64>>,
    /// x of the useful grid points, m.
    ///
    /// A grid point is useful if a relay there can receive, at some rate step, a more distant next node than a relay at
    /// some grid point with a larger x.
    useful: Vec<f64>,
}

impl Backward {
    /// Creates the table of the hop that relay `node` receives in the direction to Tx.
    ///
    /// Its sender is the next relay, or Rx. The table is empty for data to Rx only.
    fn new(search: &Search<'_>, node: usize) -> Self {
        let times = search.times;
        let next = Some(node + 1).filter(|next| *next <= times.relays());
        let hop = times.hop(Some(node), next);
        let mut backward = Self {
            hop,
            farthest: Vec::new(),
            useful: Vec::new(),
        };
        if !(times.reverse > 0.0) {
            return backward;
        }
        let points = || search.grid.iter().map(|&x| times.point(node, x));
        let steps = times.steps.iter();
        let steps = steps.map(|(sinr, _)| points().map(|point| backward.at(search, *sinr, point)));
        backward.farthest = steps.map(Iterator::collect).collect();
        let slight = SLIGHT * times.scene.distance_m;
        for row in &backward.farthest {
            let mut least = f64::INFINITY;
            for (x, reach) in search.grid.iter().zip(row).rev() {
                if *reach > least + slight {
                    backward.useful.push(*x);
                }
                least = least.min(*reach);
            }
        }
        backward.useful.sort_by(f64::total_cmp);
        backward.useful.dedup();
        backward
    }

    fn at(&self, search: &Search<'_>, sinr: f64, point: Point) -> f64 {
        let end = search.times.scene.distance_m;
        reach(&self.hop, sinr, point).map_or(f64::NEG_INFINITY, |reach| (point.x + reach).min(end))
    }

    /// Returns the smallest x, m, from which on no position up to `point` is better than `point`.
    ///
    /// A position is better if a relay there receives the next node at a larger x, at some rate step of the data toward
    /// Tx.
    fn dominated_from(&self, search: &Search<'_>, point: Point) -> f64 {
        let below = search.grid.partition_point(|x| *x < point.x);
        let slight = SLIGHT * search.times.scene.distance_m;
        let mut from: f64 = 0.0;
        for ((sinr, _), row) in search.times.steps.iter().zip(&self.farthest) {
            let own = self.at(search, *sinr, point) + slight;
            let mut before = row.iter().take(below);
            if let Some(farther) = before.rposition(|reach| *reach > own) {
                from = from.max(
                    search
                        .grid
                        .get(farther + 1)
                        .map_or(point.x, |x| x.min(point.x)),
                );
            }
        }
        from
    }
}

/// Returns the smallest x of a hop's sender, m, at which the receiver at `to` has the SINR `sinr`.
///
/// The sender is the node nearer to Tx. Infinite if the hop would be shorter than the minimum separation.
fn nearest(hop: &Hop, sinr: f64, to: Point) -> f64 {
    let squared = hop.powers_w[0] / (hop.factor * sinr * to.disturbance_w) - hop.climb_squared;
    if squared < hop.least_m * hop.least_m {
        return f64::INFINITY;
    }
    to.x - squared.sqrt()
}

/// Returns the largest distance along x, m, at which `to` receives the next node with the SINR `sinr`.
///
/// `None` if the next node is too weak at any x.
fn reach(hop: &Hop, sinr: f64, to: Point) -> Option<f64> {
    let squared = hop.powers_w[1] / (hop.factor * sinr * to.disturbance_w) - hop.climb_squared;
    (squared >= 0.0).then(|| squared.sqrt())
}

/// Returns the largest f32 number that is at most `x`.
fn below(x: f64) -> f64 {
    let near = narrow(x);
    if f64::from(near) > x {
        near.next_down().into()
    } else {
        near.into()
    }
}
