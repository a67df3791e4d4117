//! Positions on the line Tx-Rx with the largest data rate, as a shortest path.
//!
//! In fitted slots one bit takes the sum of the times of all hops. A chain for both directions carries r bits back for
//! each bit to Rx. In equal slots, and with a frequency for each hop, only the worst hop counts. The time for one bit,
//! in units of 1 / bandwidth, is
//!
//! ```text
//! fitted             sum over hops of  1 / b(F) + r / b(B)
//! slots, channels    max over hops of  max(1 / b(F), r / b(B))
//! ```
//!
//! The search minimises this time. Each term depends only on the positions of two neighbours, so the best positions on
//! a grid are found by dynamic programming. One [`Table`] has the results for all numbers of relays. The search is then
//! repeated in ever narrower windows around the positions found (`refined`). The grid is dense near Tx, Rx and the
//! interferers, because the best positions are often there.
//!
//! With the rate steps of a radio, times are constant between two thresholds. The search adds a very small time that
//! falls with the SIR (`Times::guide`), so that of equal times the one closer to the next threshold is better. Results
//! are compared by the true times.

use uav_relay_scenario::link::{Access, Radio, RateModel};
use uav_relay_scenario::number::{factor, narrow};
use uav_relay_scenario::scene::{Relay, Scene};

/// Number of equal intervals of the first grid of x.
///
/// If the minimum separation exceeds half an interval, the interval is the separation or a whole fraction of it.
const EVEN: f64 = 700.0;

/// Largest number of equally spaced points in the first grid of x.
const MOST_EVEN: u32 = 1_402;

/// Number of dense grid points on each side of Tx, Rx and every interferer.
const DENSE: i32 = 22;
/// Ratio of the distances of two successive dense grid points from Tx, Rx or an interferer.
const RATIO: f64 = 1.4;

/// Distance of the nearest dense grid point from Tx, Rx or an interferer, relative to Tx-Rx.
const NEAREST: f64 = 1e-4;

/// Number of grid points in the window around a relay's position; odd, to include the position.
const WINDOW: i32 = 9;

/// Largest number of searches in windows around the relays' positions.
const MOST_WINDOWS: u32 = 260;

/// Distance from a relay to the edges of its first search window, as a fraction of the distance Tx-Rx.
const WIDEST: f64 = 0.02;
/// Distance from a relay to its window's edges at which the search ends, relative to Tx-Rx.
const NARROWEST: f64 = 1e-7;

/// Rounding error allowed in the distance of two positions, as a fraction of the distance Tx-Rx.
const ROUNDING: f64 = 1.2e-7;

/// Weight of a very small extra time that falls as the SIR rises.
///
/// Hops at the same rate step of a radio have equal times. The extra time makes the search prefer the higher SIR.
const GUIDE: f64 = 1e-3;

/// Times that the hops of a chain need for one bit of data to Rx.
///
/// The unit is s Hz: the time in s for a bandwidth of 1 Hz.
#[derive(Clone, Debug)]
pub struct Times<'a> {
    pub(super) scene: &'a Scene,
    radio: &'a Radio,
    pub(super) reverse: f64,
    /// Rate steps of the radio: least SINR, linear, and bit/s/Hz of each. Empty for Shannon's formula.
    pub(super) steps: Vec<(f64, f64)>,
}

/// Possible position of a node: its x, m, and the interference plus noise there, W.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) disturbance_w: f64,
}

impl<'a> Times<'a> {
    /// Creates the times of a chain.
    ///
    /// `reverse` is the required rate to Tx, as a fraction of the rate to Rx; 0 for one direction.
    pub fn new(scene: &'a Scene, radio: &'a Radio, reverse: f64) -> Self {
        let steps = match &radio.link.model {
            RateModel::Shannon { .. } => Vec::new(),
            RateModel::Steps(steps) => steps
                .iter()
                .map(|step| (factor(step.sinr_db), step.bits_per_hz))
                .collect(),
        };
        Self {
            scene,
            radio,
            reverse,
            steps,
        }
    }

    fn add(&self, before: f64, hop: f64) -> f64 {
        match self.radio.link.access {
            Access::Fitted => before + hop,
            Access::Slots | Access::Channels => before.max(hop),
        }
    }

    pub(super) const fn relays(&self) -> usize {
        self.scene.relays.len()
    }

    fn relay(&self, node: usize) -> Option<&Relay> {
        self.scene.relays.get(node.checked_sub(1)?)
    }

    /// Returns the position `x`, m, and the interference plus noise there.
    ///
    /// `node` is 0 for Tx, and above N for Rx.
    pub(super) fn point(&self, node: usize, x: f64) -> Point {
        let interference_w = match self.relay(node) {
            Some(relay) => self.scene.interference_w((x, relay.altitude_m)),
            None => self.scene.interference_on_ground_w(x),
        };
        Point {
            x,
            disturbance_w: interference_w + self.scene.noise_w,
        }
    }

    pub(super) fn tx(&self) -> Point {
        self.point(0, 0.0)
    }

    pub(super) fn rx(&self) -> Point {
        self.point(usize::MAX, self.scene.distance_m)
    }

    /// Returns the hop from relay `from` to relay `to`, counted from 1; `None` stands for Tx or Rx.
    pub(super) fn hop(&self, from: Option<usize>, to: Option<usize>) -> Hop {
        let [low, high] = [from, to].map(|node| node.and_then(|node| self.relay(node)));
        let climb =
            low.map_or(0.0, |relay| relay.altitude_m) - high.map_or(0.0, |relay| relay.altitude_m);
        let both = low.is_some() && high.is_some();
        let apart = self.scene.min_separation_m;
        Hop {
            powers_w: [
                low.map_or(self.scene.tx_w, |relay| relay.power_w),
                high.map_or(self.scene.rx_w, |relay| relay.power_w),
            ],
            factor: if both {
                self.scene.mu_los
            } else {
                self.scene.eta
            },
            levels_m: [low, high].map(|end| end.map_or(0.0, |relay| relay.altitude_m)),
            climb_squared: climb * climb,
            least_m: if both {
                libm::sqrt((apart * apart - climb * climb).max(0.0))
            } else {
                0.0
            },
        }
    }

    /// Returns the time of a hop for one bit, s Hz; infinite if the hop carries nothing or is too short.
    ///
    /// With `guide` a very small time that falls as the SIR rises is added for a radio with rate steps. Otherwise all
    /// hops at the same rate step have equal times.
    pub(super) fn time(&self, hop: &Hop, from: Point, to: Point, guide: bool) -> f64 {
        let apart = to.x - from.x;
        if apart < hop.least_m - ROUNDING * self.scene.distance_m || apart < 0.0 {
            return f64::INFINITY;
        }
        self.time_at(hop, apart, [from.disturbance_w, to.disturbance_w], guide)
    }

    /// Returns the time of a hop for one bit, s Hz, as [`Times::time`] does.
    ///
    /// `apart` is the hop's length along x, m. `disturbances_w` are interference plus noise at the hop's two nodes, W.
    pub(super) fn time_at(
        &self,
        hop: &Hop,
        apart: f64,
        disturbances_w: [f64; 2],
        guide: bool,
    ) -> f64 {
        let gain = 1.0 / (hop.factor * (apart * apart + hop.climb_squared));
        let [there_w, back_w] = hop.powers_w;
        let there = self.one_way(there_w * gain / disturbances_w[1], guide);
        if !(self.reverse > 0.0) {
            return there;
        }
        let back = self.reverse * self.one_way(back_w * gain / disturbances_w[0], guide);
        match self.radio.link.access {
            Access::Fitted => there + back,
            Access::Slots | Access::Channels => there.max(back),
        }
    }

    fn one_way(&self, sir: f64, guide: bool) -> f64 {
        if self.steps.is_empty() {
            return 1.0 / self.radio.link.model.bits_per_hz(sir);
        }
        let met = self.steps.iter().rfind(|(sinr, _)| sir >= *sinr);
        let time = 1.0 / met.map_or(0.0, |(_, bits)| *bits);
        if guide { time + Self::guide(sir) } else { time }
    }

    /// Returns a very small time that falls as the SIR rises, s Hz.
    ///
    /// It is added to the time for one bit. If two chains have equal times, the chain with the higher SIR is then
    /// preferred.
    fn guide(sir: f64) -> f64 {
        GUIDE / libm::log1p(sir)
    }

    /// Returns the time of a chain for one bit, s Hz, with the relays at `x`, m.
    ///
    /// It is infinite if the chain carries nothing, or if relays are closer than the minimum separation less a rounding
    /// error.
    pub fn total(&self, x: &[f64]) -> f64 {
        self.along(x, false)
    }

    fn along(&self, x: &[f64], guide: bool) -> f64 {
        let mut from = self.tx();
        let mut total = 0.0;
        for (node, &x) in (1..).zip(x) {
            let to = self.point(node, x);
            let hop = self.hop(Some(node - 1).filter(|from| *from > 0), Some(node));
            total = self.add(total, self.time(&hop, from, to, guide));
            from = to;
        }
        let last = self.hop(Some(x.len()), None);
        self.add(total, self.time(&last, from, self.rx(), guide))
    }

    /// Returns the first grid of x, m, ascending. It is denser near Tx, Rx and the interferers.
    fn grid(&self) -> Vec<f64> {
        let d = self.scene.distance_m;
        // The best distance between relays is often exactly the minimum separation, so it is a whole number of steps.
        let apart = self.scene.min_separation_m;
        let parts = (apart * EVEN / d).ceil();
        let step = if apart * EVEN > 0.5 * d {
            apart / parts
        } else {
            d / EVEN
        };
        let mut points: Vec<f64> = (0..MOST_EVEN)
            .map(|at| step * f64::from(at))
            .take_while(|x| *x < d)
            .collect();
        let sources = self.scene.sources.iter().map(|source| source.x_m);
        for about in sources.chain([0.0, d]) {
            for step in 0..DENSE {
                let off = d * NEAREST * RATIO.powi(step);
                points.extend([about - off, about, about + off]);
            }
        }
        points.retain(|x| (0.0..=d).contains(x));
        points.sort_by(f64::total_cmp);
        points.dedup();
        points
    }

    /// Improves the positions `start` by repeated searches in windows around all relays.
    ///
    /// The windows shrink when a search no longer reduces the time. Returns the time of the best chain, s Hz, and its
    /// positions.
    pub fn refined(&self, start: &[f64]) -> (f64, Vec<f64>) {
        let d = self.scene.distance_m;
        let mut x = start.to_vec();
        let mut time = self.along(&x, true);
        // The relays' positions are f32, and the rate step of a hop may depend on the last digit.
        let rounded = |x: &[f64]| -> Vec<f64> { x.iter().map(|x| narrow(*x).into()).collect() };
        let first = rounded(&x);
        let mut best = (self.total(&first), first);
        let mut width = WIDEST * d;
        for _ in 0..MOST_WINDOWS {
            if !(width > NARROWEST * d) {
                break;
            }
            let half = f64::from(WINDOW / 2);
            let around = |at: &f64| -> Vec<f64> {
                let point = |step: i32| at + width * (f64::from(step) - half) / half;
                (0..WINDOW).map(|step| point(step).clamp(0.0, d)).collect()
            };
            let grids: Vec<Vec<f64>> = x.iter().map(around).collect();
            let next = self.best_on(&grids);
            let better = self.along(&next, true);
            let gained = better < time * (1.0 - 1e-3 * (width / d).min(1e-2));
            if better < time {
                (x, time) = (next, better);
                let flown = rounded(&x);
                let total = self.total(&flown);
                if total < best.0 {
                    best = (total, flown);
                }
            }
            if !gained {
                width *= 0.6;
            }
        }
        best
    }

    /// Returns the x of the relays, m, with the least time, if relay k is at a point of `grids[k - 1]`.
    fn best_on(&self, grids: &[Vec<f64>]) -> Vec<f64> {
        let mut layers = Layers::new(self);
        for (node, grid) in (1..).zip(grids) {
            let points = grid.iter().map(|&x| self.point(node, x)).collect();
            layers.add(points, None);
        }
        layers.path(layers.last().1)
    }
}

/// Constants of a hop that do not depend on the x of its nodes.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Hop {
    /// Transmit powers of the node nearer to Tx and of the node nearer to Rx, W.
    pub(super) powers_w: [f64; 2],
    pub(super) factor: f64,
    levels_m: [f64; 2],
    pub(super) climb_squared: f64,
    /// Least distance of the two nodes along x, m, because of the minimum separation.
    pub(super) least_m: f64,
}

/// Least time of a chain from Tx to a grid point, and the index of the previous relay's grid point.
#[derive(Clone, Copy)]
struct Best {
    time: f64,
    before: usize,
}

/// State of the dynamic programming: the best chain from Tx to each grid point of each relay.
struct Layers<'a> {
    times: &'a Times<'a>,
    layers: Vec<(Vec<Point>, Vec<Best>)>,
}

impl<'a> Layers<'a> {
    const fn new(times: &'a Times<'a>) -> Self {
        Self {
            times,
            layers: Vec::new(),
        }
    }

    /// Adds the next relay, which may be at `points`.
    ///
    /// `known` has the times of the hops from every point of the previous relay to every point in `points`, if they are
    /// already computed.
    fn add(&mut self, points: Vec<Point>, known: Option<&[f64]>) {
        let node = self.layers.len() + 1;
        let times = self.times;
        let bests = match self.layers.last() {
            None => {
                let (hop, tx) = (times.hop(None, Some(1)), times.tx());
                let first = points.iter().map(|to| Best {
                    time: times.time(&hop, tx, *to, true),
                    before: 0,
                });
                first.collect()
            }
            Some((before, sofar)) => {
                let hop = times.hop(Some(node - 1), Some(node));
                let best = |(column, to): (usize, &Point)| {
                    let mut found = Best {
                        time: f64::INFINITY,
                        before: 0,
                    };
                    for (row, (from, best)) in before.iter().zip(sofar).enumerate() {
                        if !(best.time < found.time) {
                            continue;
                        }
                        let own = known.and_then(|known| known.get(row * points.len() + column));
                        let hop_time = own
                            .copied()
                            .unwrap_or_else(|| times.time(&hop, *from, *to, true));
                        let time = times.add(best.time, hop_time);
                        if time < found.time {
                            found = Best { time, before: row };
                        }
                    }
                    found
                };
                points.iter().enumerate().map(best).collect()
            }
        };
        self.layers.push((points, bests));
    }

    /// Returns the least time of a whole chain to Rx, and the index of the last relay's grid point.
    fn last(&self) -> (f64, usize) {
        let hop = self.times.hop(Some(self.layers.len()), None);
        let rx = self.times.rx();
        let Some((points, bests)) = self.layers.last() else {
            return (f64::INFINITY, 0);
        };
        let totals = points.iter().zip(bests).map(|(from, best)| {
            let time = self.times.time(&hop, *from, rx, true);
            self.times.add(best.time, time)
        });
        let (at, time) = totals
            .enumerate()
            .min_by(|one, other| one.1.total_cmp(&other.1))
            .unwrap_or((0, f64::INFINITY));
        (time, at)
    }

    /// Returns the x of all relays, m, in the best chain whose last relay is at its grid point `at`.
    fn path(&self, mut at: usize) -> Vec<f64> {
        let mut x: Vec<f64> = Vec::with_capacity(self.layers.len());
        for (points, bests) in self.layers.iter().rev() {
            x.push(points.get(at).map_or(0.0, |point| point.x));
            at = bests.get(at).map_or(0, |best| best.before);
        }
        x.reverse();
        x
    }
}

/// Table of the best chains on a grid, one for each number of relays from 1.
#[derive(Clone, Debug)]
pub struct Table {
    /// Best chain for each number of relays from 1: its time, s Hz, and the relays' x, m.
    starts: Vec<(f64, Vec<f64>)>,
}

impl Table {
    /// Computes the best chains on the grid, for 1 relay up to all relays of the chain.
    pub fn new(times: &Times<'_>) -> Self {
        let grid = times.grid();
        let mut layers = Layers::new(times);
        let mut known: Option<(Hop, Vec<f64>)> = None;
        let mut starts = Vec::new();
        for node in 1..=times.relays() {
            let points: Vec<Point> = grid.iter().map(|&x| times.point(node, x)).collect();
            let hop = times.hop(Some(node - 1).filter(|from| *from > 0), Some(node));
            // Equal relays have the same times between grid points.
            let is_known = known.as_ref().is_some_and(|(other, _)| *other == hop);
            if node > 1 && !is_known {
                let before = layers.layers.last().map(|(points, _)| points.clone());
                let rows = before.unwrap_or_default();
                let all = rows
                    .iter()
                    .flat_map(|from| points.iter().map(|to| times.time(&hop, *from, *to, true)));
                known = Some((hop, all.collect()));
            }
            layers.add(points, known.as_ref().map(|(_, times)| times.as_slice()));
            let (time, at) = layers.last();
            starts.push((time, layers.path(at)));
        }
        Self { starts }
    }

    /// Returns the largest number of relays whose time per bit on the grid is close to the least time.
    ///
    /// The time is at most 1 + `loss` times the least time of all numbers of relays. Returns 0 if no time is finite.
    pub fn largest_within(&self, loss: f64) -> u16 {
        let times = || self.starts.iter().map(|(time, _)| *time);
        let best = times().fold(f64::INFINITY, f64::min);
        let is_near = |time: f64| time.is_finite() && time <= best * (1.0 + loss);
        let last = times().rposition(is_near).map_or(0, |at| at + 1);
        u16::try_from(last).unwrap_or(u16::MAX)
    }

    /// Returns the x of `relays` relays, m, in their best chain on the grid; `None` without a chain.
    pub fn start(&self, relays: u16) -> Option<&[f64]> {
        let at = usize::from(relays).checked_sub(1)?;
        self.starts.get(at).map(|(_, x)| x.as_slice())
    }
}
