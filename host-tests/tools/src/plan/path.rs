//! Positions along the line with the largest data rate: a shortest path.
//!
//! In fitted slots a bit of data takes the time of all hops, and a chain that is planned for both directions carries r bits back for
//! each bit to Rx. In equal slots, and with a frequency for each hop, the worst hop counts. In units of 1 / bandwidth
//!
//! ```text
//! fitted             sum over hops of  1 / b(F) + r / b(B)
//! slots, channels    max over hops of  max(1 / b(F), r / b(B))
//! ```
//!
//! is the smallest. Each term depends on the positions of two neighbours only, so the best positions on a grid are found by dynamic
//! programming over the relays, one table for all numbers of relays ([`Table`]). Then the same is repeated in windows about the
//! positions found, which become narrower (`refined`). The grid has dense points near Tx, Rx and the interferers, where the best
//! positions for rates gather.
//!
//! Steps of a radio make the times constant between thresholds. So that ties are decided toward the next threshold, the search adds a
//! small share of a time that falls everywhere (`Times::guide`). The result is compared by the true times.

use uav_relay_scenario::link::{Access, Radio, RateModel};
use uav_relay_scenario::number::{factor, narrow};
use uav_relay_scenario::scene::{Relay, Scene};

/// Least number of even parts of the grid.
const EVEN: f64 = 700.0;

/// Largest number of even points.
const MOST_EVEN: u32 = 1_402;

/// Points at each side of the ends and interferers, and the ratio of their distances.
const DENSE: i32 = 22;
const RATIO: f64 = 1.4;

/// Distance of the nearest of them, as a fraction of the line.
const NEAREST: f64 = 1e-4;

/// Points of a window, odd.
const WINDOW: i32 = 9;

/// Largest number of windows in the refinement.
const MOST_WINDOWS: u32 = 260;

/// Half of the first window and of the last one, as fractions of the line.
const WIDEST: f64 = 0.02;
const NARROWEST: f64 = 1e-7;

/// Rounding error of a distance between two positions, as a fraction of the line.
const ROUNDING: f64 = 1.2e-7;

/// Share of the guiding time.
const GUIDE: f64 = 1e-3;

/// Times of the hops of a scene for one bit of data to Rx, s Hz.
#[derive(Clone, Debug)]
pub struct Times<'a> {
    scene: &'a Scene,
    radio: &'a Radio,
    reverse: f64,
    /// Least SINR (linear) and bit/s/Hz of each step of the radio, if it has steps.
    steps: Vec<(f64, f64)>,
}

/// Position of a node, m, and the interference plus noise there, W.
#[derive(Clone, Copy, Debug)]
struct Point {
    x: f64,
    disturbance_w: f64,
}

impl<'a> Times<'a> {
    /// Creates the times of a scene. `reverse` is r, 0 if only the way to Rx counts.
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

    const fn relays(&self) -> usize {
        self.scene.relays.len()
    }

    fn relay(&self, node: usize) -> Option<&Relay> {
        self.scene.relays.get(node.checked_sub(1)?)
    }

    /// Returns the point of `node`, where `relays` is the number of relays.
    fn point(&self, node: usize, x: f64) -> Point {
        let interference_w = match self.relay(node) {
            Some(relay) => self.scene.interference_w((x, relay.altitude_m)),
            None => self.scene.interference_on_ground_w(x),
        };
        Point {
            x,
            disturbance_w: interference_w + self.scene.noise_w,
        }
    }

    fn tx(&self) -> Point {
        self.point(0, 0.0)
    }

    fn rx(&self) -> Point {
        self.point(usize::MAX, self.scene.distance_m)
    }

    /// Returns a hop between relays `from` and `to`, from 1; `None` for Tx or Rx.
    fn hop(&self, from: Option<usize>, to: Option<usize>) -> Hop {
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

    /// Returns the time of a hop; infinite if it carries nothing. With `guide` it is a little more, which falls with
    /// every SIR.
    fn time(&self, hop: &Hop, from: Point, to: Point, guide: bool) -> f64 {
        let apart = to.x - from.x;
        if apart < hop.least_m - ROUNDING * self.scene.distance_m || apart < 0.0 {
            return f64::INFINITY;
        }
        let gain = 1.0 / (hop.factor * (apart * apart + hop.climb_squared));
        let [there_w, back_w] = hop.powers_w;
        let there = self.one_way(there_w * gain / to.disturbance_w, guide);
        if !(self.reverse > 0.0) {
            return there;
        }
        let back = self.reverse * self.one_way(back_w * gain / from.disturbance_w, guide);
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

    /// Returns a small time that falls with every SIR.
    fn guide(sir: f64) -> f64 {
        GUIDE / libm::log1p(sir)
    }

    /// Returns the time of a chain with relays at `x`, m. It is infinite if it carries nothing, or relays are too
    /// close.
    ///
    /// Distances may be less than the least separation by the rounding of positions.
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

    /// Returns the grid of the first search, ascending.
    fn grid(&self) -> Vec<f64> {
        let d = self.scene.distance_m;
        // Relays that gather keep exactly their least separation: it is a whole number of steps.
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

    /// Improves positions in windows about all of them, narrower ones when that no longer helps.
    ///
    /// Returns them with their time.
    pub fn refined(&self, start: &[f64]) -> (f64, Vec<f64>) {
        let d = self.scene.distance_m;
        let mut x = start.to_vec();
        let mut time = self.along(&x, true);
        // The relays' positions are f32, and a step of a radio may depend on the last digit.
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

    /// Returns the best positions with relay k on `grids[k - 1]`.
    fn best_on(&self, grids: &[Vec<f64>]) -> Vec<f64> {
        let mut layers = Layers::new(self);
        for (node, grid) in (1..).zip(grids) {
            let points = grid.iter().map(|&x| self.point(node, x)).collect();
            layers.add(points, None);
        }
        layers.path(layers.last().1)
    }
}

/// Hop between two nodes without their positions.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Hop {
    /// Powers of the node nearer to Tx and of the other one, W.
    powers_w: [f64; 2],
    factor: f64,
    levels_m: [f64; 2],
    climb_squared: f64,
    /// Least distance along the line, m.
    least_m: f64,
}

/// Best time at a point and the point of the relay before.
#[derive(Clone, Copy)]
struct Best {
    time: f64,
    before: usize,
}

/// Relays whose best positions up to each point are known.
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

    /// Adds the next relay on `points`. `known` has the times between all pairs of points, if they are known.
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

    /// Returns the best time of a chain that ends with the last relay, and its point.
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

    /// Returns the positions that lead to point `at` of the last relay, relay 1 first.
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

/// Best positions on one grid of 1, 2, 3 and more relays.
#[derive(Clone, Debug)]
pub struct Table {
    /// Time on the grid and positions, m, of each number of relays, from 1.
    starts: Vec<(f64, Vec<f64>)>,
}

impl Table {
    /// Computes the best positions on the grid for 1 relay up to all relays of the scene of `times`.
    pub fn new(times: &Times<'_>) -> Self {
        let grid = times.grid();
        let mut layers = Layers::new(times);
        let mut known: Option<(Hop, Vec<f64>)> = None;
        let mut starts = Vec::new();
        for node in 1..=times.relays() {
            let points: Vec<Point> = grid.iter().map(|&x| times.point(node, x)).collect();
            let hop = times.hop(Some(node - 1).filter(|from| *from > 0), Some(node));
            // Equal relays have equal times between the points of the grid.
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

    /// Returns the largest number of relays whose time on the grid is within `loss` of the best one. 0 if no time is
    /// finite.
    pub fn largest_within(&self, loss: f64) -> u16 {
        let times = || self.starts.iter().map(|(time, _)| *time);
        let best = times().fold(f64::INFINITY, f64::min);
        let is_near = |time: f64| time.is_finite() && time <= best * (1.0 + loss);
        let last = times().rposition(is_near).map_or(0, |at| at + 1);
        u16::try_from(last).unwrap_or(u16::MAX)
    }

    /// Returns the positions of `relays` relays, m.
    pub fn start(&self, relays: u16) -> Option<&[f64]> {
        let at = usize::from(relays).checked_sub(1)?;
        self.starts.get(at).map(|(_, x)| x.as_slice())
    }
}
