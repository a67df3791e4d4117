//! Best chain against the true sum of the interference, for relays at one fixed altitude.

use uav_relay_scenario::hypothetical::{Centre, graded};
use uav_relay_scenario::scene::Scene;

/// Relative width of the interval of target SIRs at which the bisection ends.
const TOLERANCE: f64 = 1e-13;

const LEAST_TARGET: f64 = 1e-250;

/// Relative tolerance of the minimum separation, for rounding.
///
/// Without it a thousand relays that just fit between Tx and Rx could be rejected.
const ROUNDING: f64 = 1e-12;

/// Best chain of relays at one altitude: their positions and its SIR.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    /// Positions (x, altitude) of the relays from Tx to Rx, m.
    ///
    /// x is between 0 (Tx) and the distance to Rx. From one relay to the next it rises by the minimum separation or
    /// more, except for rounding (1e-12 of the separation).
    pub places: Vec<(f64, f64)>,
    /// SIR of the worst hop, linear, by [`Scene::hop_sirs`].
    pub sir: f64,
    /// SIR of the best chain without a minimum separation, linear.
    ///
    /// This SIR equals `sir` if the separation does not restrict the chain.
    pub free_sir: f64,
}

impl Chain {
    /// Returns true if the minimum separation between relays costs more than a millionth of the SIR.
    pub fn separation_binds(&self) -> bool {
        self.sir < self.free_sir * (1.0 - 1e-6)
    }
}

/// Returns the best chain of relays at one common altitude; exact except for rounding.
///
/// The powers of the relays may differ. If the minimum separation restricts the chain, the result is the best of the
/// chains that keep it. Without a minimum separation, two relays may have the same position.
///
/// `None` if there are no relays or no interferers, if altitudes differ, if the relays do not fit between Tx and Rx,
/// and if no chain has an SIR above zero (an interferer at Rx).
///
/// Tested to 1e-9 against the reference for one interferer and to 1e-6 against brute force for several
/// (`for_one_source_the_optimum_is_that_of_the_reference`, `brute_force_finds_the_same` in
/// `host-tests/tests/multi_interferer`).
///
/// Work: about 50 target SIRs, twice with a minimum separation. For each target: some thousand points between Tx and Rx
/// per change of power along the chain, and a few intervals per relay.
pub fn optimum(scene: &Scene) -> Option<Chain> {
    let altitude_m = scene.relays.first()?.altitude_m;
    let same = |other: f64| other.total_cmp(&altitude_m).is_eq();
    let alike = scene.relays.iter().all(|relay| same(relay.altitude_m));
    alike.then(|| at_altitude(scene, altitude_m)).flatten()
}

/// Returns the best chain with all relays at `altitude_m` (> 0). The altitudes in `scene` are ignored.
pub(super) fn at_altitude(scene: &Scene, altitude_m: f64) -> Option<Chain> {
    let line = Line::new(scene, altitude_m);
    let apart = scene.min_separation_m * (1.0 - ROUNDING);
    let target = best_target(&line, apart, TOLERANCE)?;
    let xs = Stages::new(&line, target, apart)?.chain()?;
    let places: Vec<(f64, f64)> = xs.into_iter().map(|x| (x, altitude_m)).collect();
    let sir = scene.chain_sir(&places);
    let free_sir = if apart > 0.0 {
        best_target(&line, 0.0, TOLERANCE)?.max(sir)
    } else {
        sir
    };
    Some(Chain {
        places,
        sir,
        free_sir,
    })
}

/// Returns the SIR of the best chain at `altitude_m` that keeps the minimum separation, linear.
///
/// `tolerance` is relative. `None` if there are no relays or no interferers, if the relays do not fit between Tx and
/// Rx, or if no chain has an SIR above 0.
pub(super) fn best_at_altitude(scene: &Scene, altitude_m: f64, tolerance: f64) -> Option<f64> {
    let apart = scene.min_separation_m * (1.0 - ROUNDING);
    best_target(&Line::new(scene, altitude_m), apart, tolerance)
}

fn best_target(line: &Line, apart: f64, tolerance: f64) -> Option<f64> {
    let scene = line.scene;
    let gaps = scene.relays.len().checked_sub(1)? as f64;
    if scene.sources.is_empty() || gaps * apart > scene.distance_m {
        return None;
    }
    let met = |target: f64| Stages::new(line, target, apart).is_some_and(|found| found.is_met());
    // No chain is better than its first hop at the best position.
    let whole = Span {
        low: 0.0,
        high: scene.distance_m,
    };
    let mut above = 2.0 * line.first_sir(line.best_first(&[whole])?);
    let mut below = above / 16.0;
    while !met(below) {
        (above, below) = (below, below / 16.0);
        if below < LEAST_TARGET {
            return None;
        }
    }
    while above - below > tolerance * below {
        // Geometric mean, because the targets span many decades.
        let middle = below * (above / below).sqrt();
        if met(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    Some(below)
}

/// Number of intervals of altitude in the first scan.
///
/// The range of altitudes is divided twice: into intervals of equal length, and into intervals with an equal ratio of
/// their limits.
const SCANNED: u32 = 24;

const TOPS: usize = 3;

/// Number of golden-section steps that refine the best altitude.
///
/// They reduce the interval to 6e-6 of its length. The loss in SIR falls with the square of the interval's length.
const STEPS: u32 = 25;

const COMMON_TOLERANCE: f64 = 1e-11;

/// Returns the best chain whose relays share one permitted altitude.
///
/// It is never worse than at the lowest or the highest altitude. The range is scanned, and the three highest maxima are
/// refined. A maximum that is narrower than the distance of two scanned altitudes may be missed. `None` as for
/// [`optimum`](super::optimum()), if a relay has a fixed altitude, or if no altitude is permitted. The cost is about
/// 120 times that of [`optimum`](super::optimum()).
pub fn best_common_altitude(scene: &Scene) -> Option<Chain> {
    let band = scene.band;
    if scene.relays.iter().any(|relay| relay.holds) || !(band.least_m <= band.most_m) {
        return None;
    }
    let reached = |h: f64| best_at_altitude(scene, h, COMMON_TOLERANCE).unwrap_or(0.0);
    let scanned: Vec<(f64, f64)> = altitudes(band.least_m, band.most_m)
        .into_iter()
        .map(|h| (h, reached(h)))
        .collect();
    let mut tops: Vec<(f64, f64, f64)> = Vec::new();
    for (at, &(h, sir)) in scanned.iter().enumerate() {
        let left = at.checked_sub(1).and_then(|at| scanned.get(at));
        let right = scanned.get(at + 1);
        let is_top = [left, right]
            .into_iter()
            .flatten()
            .all(|side| side.1 <= sir);
        if is_top {
            let end = |side: Option<&(f64, f64)>| side.map_or(h, |side| side.0);
            tops.push((sir, end(left), end(right)));
        }
    }
    tops.sort_by(|a, b| b.0.total_cmp(&a.0));
    let refined = tops
        .iter()
        .take(TOPS)
        .map(|&(_, low, high)| golden(low, high, STEPS, reached));
    let best = scanned
        .iter()
        .copied()
        .chain(refined)
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    at_altitude(scene, best.0)
}

/// Returns the altitudes to scan from `least` to `most`, m, ascending; one if the limits are equal.
fn altitudes(least: f64, most: f64) -> Vec<f64> {
    let shares = (0..=SCANNED).map(|i| f64::from(i) / f64::from(SCANNED));
    let mut altitudes: Vec<f64> = shares
        .flat_map(|share| {
            [
                least + share * (most - least),
                least * (most / least).powf(share),
            ]
        })
        .map(|h| h.clamp(least, most))
        .collect();
    altitudes.sort_by(f64::total_cmp);
    altitudes.dedup();
    altitudes
}

/// Maximises `f` on [`low`, `high`] by golden-section search. Returns the best argument and its value.
pub(super) fn golden(
    mut low: f64,
    mut high: f64,
    steps: u32,
    f: impl Fn(f64) -> f64,
) -> (f64, f64) {
    let ratio = (5_f64.sqrt() - 1.0) / 2.0;
    let at = |x: f64| (x, f(x));
    let (mut a, mut b) = (
        at(high - ratio * (high - low)),
        at(low + ratio * (high - low)),
    );
    for _ in 0..steps {
        if a.1 < b.1 {
            (low, a) = (a.0, b);
            b = at(low + ratio * (high - low));
        } else {
            (high, b) = (b.0, a);
            a = at(high - ratio * (high - low));
        }
    }
    if a.1 < b.1 { b } else { a }
}

// Positions of each relay from which the rest of the chain can reach Rx, for one target SIR and altitude.
//
// For a receiver at y the SIR of a hop depends only on its length. The sender may therefore be anywhere in [y - d(y), y
// - s]: d(y) is the longest hop at the target, and s the minimum separation. From Rx backward, the feasible positions
// of relay k are the union of these intervals over the positions of relay k + 1.
//
// Over an interval of y with d(y) >= s this union is again an interval, from the least y - d(y) on, so each set is a
// few intervals. With s = 0 it is one, [l_k, D]. A lower target only widens the sets, so the best target can be found
// by bisection.

/// Group of feasible hops: an interval of x for the sender, and one for the receiver.
///
/// A sender at any x in `from` has at least one x in `to` at which the receiver meets the target SIR.
#[derive(Debug, Clone, Copy)]
struct Step {
    from: Span,
    to: Span,
    /// x, m, of the receiver in `to` that allows the smallest x of the sender, the lower end of `from`.
    farthest: f64,
}

struct Stage {
    stride: Stride,
    steps: Vec<Step>,
}

/// Intervals of x of each relay, from which all hops from this relay to Rx can meet one target SIR.
///
/// They are computed from Rx to Tx. The hop from Tx to the first relay is not checked.
pub(super) struct Stages<'a> {
    line: &'a Line<'a>,
    apart: f64,
    target: f64,
    /// Feasible hops from each relay to the next relay: from relay N - 1 first, from relay 1 last.
    before: Vec<Stage>,
    /// Positions of relay 1 from which all hops to Rx can meet the target SIR.
    first: Vec<Span>,
}

/// Feasible hops for one target SIR and one transmit power. Relays of equal power share them.
struct Reach {
    stride: Stride,
    hearing: Vec<Span>,
    minima: Vec<f64>,
}

impl<'a> Stages<'a> {
    /// Computes the feasible positions of each relay for the SIR `target` (linear, > 0).
    ///
    /// The distance of two relays is at least `apart` metres. `None` if a relay has no feasible position. The
    /// sampled positions are scanned once for each group of successive relays with equal power. Each relay adds the
    /// work for a few intervals.
    pub(super) fn new(line: &'a Line<'a>, target: f64, apart: f64) -> Option<Self> {
        let (last, others) = line.scene.relays.split_last()?;
        let mut spans = vec![Span {
            low: line.last_from(last.power_w, target)?,
            high: line.scene.distance_m,
        }];
        let mut stages = Vec::with_capacity(others.len());
        let mut reach: Option<Reach> = None;
        for relay in others.iter().rev() {
            let stride = line.stride(relay.power_w, target);
            let reach = match reach.take().filter(|reach| reach.stride == stride) {
                Some(same) => reach.insert(same),
                None => reach.insert(Reach {
                    stride,
                    hearing: line.hearing(stride, apart),
                    minima: line.far_receivers(stride),
                }),
            };
            let steps = steps(line, reach, &spans, apart);
            spans = merged(steps.iter().map(|step| step.from).collect());
            if spans.is_empty() {
                return None;
            }
            stages.push(Stage { stride, steps });
        }
        Some(Self {
            line,
            apart,
            target,
            before: stages,
            first: spans,
        })
    }

    /// Returns true if the whole chain meets the target, including the hop from Tx.
    pub(super) fn is_met(&self) -> bool {
        let best = self.line.best_first(&self.first);
        best.is_some_and(|x| self.line.first_sir(x) >= self.target)
    }

    /// Returns the x of each relay, m, in a chain that meets the target SIR. [`Stages::is_met`] must be true.
    ///
    /// The x rise from Tx to Rx. The lengths of the hops differ as little as the target allows. `None` if the feasible
    /// positions are not connected.
    pub(super) fn chain(&self) -> Option<Vec<f64>> {
        let d = self.line.scene.distance_m;
        let mut hops = self.before.len() as f64 + 2.0;
        let mut x = self.first_place(d / hops)?;
        let mut places = vec![x];
        for stage in self.before.iter().rev() {
            hops -= 1.0;
            x = self.next_place(stage, x, x + (d - x) / hops)?;
            places.push(x);
        }
        Some(places)
    }

    fn first_place(&self, wish: f64) -> Option<f64> {
        let best = self.line.best_first(&self.first)?;
        let span = self.first.iter().find(|span| span.contains(best))?;
        Some(toward(best, wish.clamp(span.low, span.high), |x| {
            self.line.first_sir(x) >= self.target
        }))
    }

    /// Returns the feasible x of the next relay that is nearest to `wish`.
    ///
    /// The sender is at `x`, and `stage` has its feasible hops. `None` if no feasible hop starts at `x`.
    fn next_place(&self, stage: &Stage, x: f64, wish: f64) -> Option<f64> {
        let steps = stage.steps.iter().filter(|step| step.from.contains(x));
        let places = steps.map(|step| {
            let near = x + self.apart;
            // `sure` receives the sender at x: it is close enough, or it is the receiver with the longest hop.
            let sure = step.farthest.max(near).min(step.to.high);
            let wish = wish.clamp(step.to.low.max(near).min(sure), step.to.high);
            toward(sure, wish, |y| self.line.heard_from(stage.stride, y) <= x)
        });
        places.min_by(|a, b| (a - wish).abs().total_cmp(&(b - wish).abs()))
    }
}

/// Returns the feasible hops from a relay to the next relay, which is in an interval of `spans`.
///
/// Each hop meets the target SIR, and is at least `apart` metres long. `reach` is for the sender's power.
fn steps(line: &Line, reach: &Reach, spans: &[Span], apart: f64) -> Vec<Step> {
    let receivers = common(spans, &reach.hearing);
    receivers
        .into_iter()
        .filter_map(|to| {
            let inside = reach.minima.iter().filter(|&&y| to.contains(y));
            let (farthest, least) = [to.low, to.high]
                .iter()
                .chain(inside)
                .map(|&y| (y, line.heard_from(reach.stride, y)))
                .min_by(|a, b| a.1.total_cmp(&b.1))?;
            let from = Span {
                low: least.max(0.0),
                high: to.high - apart,
            };
            (from.low <= from.high).then_some(Step { from, to, farthest })
        })
        .collect()
}

/// Returns the last point on the way from `sure` to `wish` up to which `holds` returns true.
///
/// `holds` must be true at `sure`.
fn toward(sure: f64, wish: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if holds(wish) {
        wish
    } else {
        boundary(sure, wish, holds)
    }
}

/// Distance between samples of the interference, relative to the distance to the nearest interferer.
const STEP: f64 = 0.02;

const CELLS: f64 = 500.0;

/// Possible relay positions at one altitude above the line Tx-Rx, with samples of the interference.
///
/// The samples are dense enough to show every minimum and maximum of the interference.
pub(super) struct Line<'a> {
    pub(super) scene: &'a Scene,
    pub(super) altitude_m: f64,
    nodes: Vec<f64>,
    /// Longest hop to each sampled position, divided by a factor: (I + N)^(-1/2), in W^(-1/2).
    ///
    /// I and N are the powers of interference and noise at the receiver, W. The factor is a [`Stride`].
    quiet: Vec<f64>,
    slope: Vec<f64>,
    tops: Vec<f64>,
}

/// Factor of the longest hop, for one target SIR and one transmit power.
///
/// The longest hop, m, is this factor times (I + N)^(-1/2), with the powers I and N of interference and noise at the
/// receiver, W.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Stride(f64);

impl<'a> Line<'a> {
    pub(super) fn new(scene: &'a Scene, altitude_m: f64) -> Self {
        let mut centres: Vec<Centre> = scene
            .sources
            .iter()
            .map(|source| Centre {
                at: source.x_m,
                width: source.y_m.hypot(altitude_m),
            })
            .collect();
        // The interference from an area has a kink at each corner, and at each crossing of its boundary with the line
        // Tx-Rx.
        for area in scene.areas.values() {
            let corners = area.corners();
            for ([x, y], [to_x, to_y]) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                let width = area.distance_m([*x, 0.0]).hypot(altitude_m);
                centres.push(Centre { at: *x, width });
                if (*y > 0.0) != (*to_y > 0.0) {
                    let at = x + y / (y - to_y) * (to_x - x);
                    let width = altitude_m;
                    centres.push(Centre { at, width });
                }
            }
        }
        centres.push(Centre {
            at: 0.0,
            width: altitude_m,
        });
        let d = scene.distance_m;
        let nodes = graded(0.0, d, &centres, STEP, d / CELLS);
        let mut line = Self {
            scene,
            altitude_m,
            nodes,
            quiet: Vec::new(),
            slope: Vec::new(),
            tops: Vec::new(),
        };
        let sampled = line.nodes.iter().map(|&x| line.quiet_and_slope(x));
        (line.quiet, line.slope) = sampled.unzip();
        let rises: Vec<f64> = line.nodes.iter().map(|&x| line.first_rise(x)).collect();
        let turns = crossings(&line.nodes, &rises, 0.0, |x| line.first_rise(x));
        line.tops = falling(&turns);
        line
    }

    fn quiet_and_slope(&self, x: f64) -> (f64, f64) {
        let (mut power, mut change) = (self.scene.noise_w, 0.0);
        for (power_w, [dx, dy]) in self.scene.offsets(x, 0.0) {
            let squared = dx * dx + dy * dy + self.altitude_m * self.altitude_m;
            let received = power_w / (self.scene.eta * squared);
            power += received;
            change -= received * 2.0 * dx / squared;
        }
        let quiet = 1.0 / power.sqrt();
        (quiet, -0.5 * quiet * change / power)
    }

    /// Returns half of the derivative of ln(SIR) by x, 1/m, for the hop from Tx to a relay at `x`.
    fn first_rise(&self, x: f64) -> f64 {
        let (quiet, slope) = self.quiet_and_slope(x);
        slope / quiet - x / (x * x + self.altitude_m * self.altitude_m)
    }

    pub(super) fn first_sir(&self, x: f64) -> f64 {
        self.scene.sir_at(self.scene.tx(), (x, self.altitude_m))
    }

    /// Returns the x in `spans` with the largest SIR of the hop from Tx; `None` if there are no spans.
    pub(super) fn best_first(&self, spans: &[Span]) -> Option<f64> {
        let ends = spans.iter().flat_map(|span| [span.low, span.high]);
        let inside = |x: &&f64| spans.iter().any(|span| span.contains(**x));
        ends.chain(self.tops.iter().filter(inside).copied())
            .max_by(|&a, &b| self.first_sir(a).total_cmp(&self.first_sir(b)))
    }

    /// Returns the factor of the longest hop from a relay of `power_w` W at the SIR `target` (linear, > 0).
    pub(super) fn stride(&self, power_w: f64, target: f64) -> Stride {
        Stride((power_w / (self.scene.mu_los * target)).sqrt())
    }

    /// Returns the smallest x of a sender, m, from which a receiver at `x` has the target SIR.
    ///
    /// `stride` is the factor for the target SIR and the sender's power. The result may be below 0, the x of Tx.
    pub(super) fn heard_from(&self, stride: Stride, x: f64) -> f64 {
        x - stride.0 * self.quiet_and_slope(x).0
    }

    /// Returns the receivers' x, m, at which the smallest possible x of the sender has a minimum.
    ///
    /// The smallest x of the sender is [`Line::heard_from`].
    pub(super) fn far_receivers(&self, stride: Stride) -> Vec<f64> {
        // The slope of `heard_from` is 1 - stride x slope of `quiet`.
        let level = 1.0 / stride.0;
        falling(&crossings(&self.nodes, &self.slope, level, |x| {
            self.quiet_and_slope(x).1
        }))
    }

    /// Returns the intervals of x in which a receiver meets the target. Its sender is `apart` metres nearer to Tx.
    pub(super) fn hearing(&self, stride: Stride, apart: f64) -> Vec<Span> {
        let level = apart / stride.0;
        let turns = crossings(&self.nodes, &self.quiet, level, |x| {
            self.quiet_and_slope(x).0
        });
        let hears = |x: f64| self.quiet_and_slope(x).0 >= level;
        let mut spans = Vec::new();
        let mut low = hears(0.0).then_some(0.0);
        for turn in turns {
            if turn.rising {
                low = Some(turn.at);
            } else if let Some(low) = low.take() {
                spans.push(Span { low, high: turn.at });
            }
        }
        let high = self.scene.distance_m;
        spans.extend(low.map(|low| Span { low, high }));
        spans
    }

    /// Returns the smallest x, m, from which the last relay meets the SIR `target` at Rx; at least 0.
    ///
    /// The relay has `power_w` watts; `target` is linear and above 0. `None` if a relay vertically above Rx misses the
    /// target, too.
    pub(super) fn last_from(&self, power_w: f64, target: f64) -> Option<f64> {
        let scene = self.scene;
        let squared = power_w / (scene.eta * target * (scene.interference_rx_w() + scene.noise_w));
        let across = squared - self.altitude_m * self.altitude_m;
        (across >= 0.0).then(|| (scene.distance_m - across.sqrt()).max(0.0))
    }
}

/// Returns the positions of those crossings in `turns` at which the function falls.
fn falling(turns: &[Crossing]) -> Vec<f64> {
    let falling = turns.iter().filter(|turn| !turn.rising);
    falling.map(|turn| turn.at).collect()
}

/// Closed interval [low, high] of x, m; a single point if the two limits are equal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Span {
    pub(super) fn contains(&self, x: f64) -> bool {
        (self.low..=self.high).contains(&x)
    }
}

/// Returns the union of `spans` as disjoint intervals in rising order.
pub(super) fn merged(mut spans: Vec<Span>) -> Vec<Span> {
    spans.sort_by(|a, b| a.low.total_cmp(&b.low));
    let mut union: Vec<Span> = Vec::with_capacity(spans.len());
    for span in spans {
        match union.last_mut() {
            Some(last) if span.low <= last.high => last.high = last.high.max(span.high),
            _ => union.push(span),
        }
    }
    union
}

/// Returns the intersection of two lists of disjoint intervals in rising order.
pub(super) fn common(a: &[Span], b: &[Span]) -> Vec<Span> {
    let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
    pairs
        .map(|(a, b)| Span {
            low: a.low.max(b.low),
            high: a.high.min(b.high),
        })
        .filter(|span| span.low <= span.high)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Span, common, merged};

    fn spans(ends: &[(f64, f64)]) -> Vec<Span> {
        ends.iter().map(|&(low, high)| Span { low, high }).collect()
    }

    #[test]
    fn overlaps_and_touches_are_merged() {
        let union = merged(spans(&[(4.0, 5.0), (0.0, 3.0), (1.0, 2.0), (5.0, 6.0)]));
        assert_eq!(union, spans(&[(0.0, 3.0), (4.0, 6.0)]));
        assert_eq!(merged(Vec::new()), Vec::new());
    }

    #[test]
    fn points_may_be_common() {
        let (a, b) = (
            spans(&[(0.0, 2.0), (3.0, 9.0)]),
            spans(&[(2.0, 4.0), (8.0, 8.0)]),
        );
        assert_eq!(common(&a, &b), spans(&[(2.0, 2.0), (3.0, 4.0), (8.0, 8.0)]));
    }
}

/// Largest number of bisection steps. Any f64 interval in metres shrinks to two adjacent numbers in fewer steps.
const HALVINGS: u32 = 200;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    pub(super) at: f64,
    /// True if the function rises at this crossing of the level; false if it falls.
    pub(super) rising: bool,
}

/// Returns the points, ascending, at which the function `exact` crosses `level`.
///
/// `nodes` are arguments in ascending order, and `values` the function's values there. Two crossings between
/// neighbouring nodes are missed. The cost is about 60 evaluations for each crossing.
pub(super) fn crossings(
    nodes: &[f64],
    values: &[f64],
    level: f64,
    exact: impl Fn(f64) -> f64,
) -> Vec<Crossing> {
    let samples = nodes.iter().zip(values);
    let cells = samples.clone().zip(samples.skip(1));
    cells
        .filter(|((_, left), (_, right))| (**left < level) != (**right < level))
        .map(|((&low, &left), (&high, _))| {
            let below = left < level;
            Crossing {
                at: boundary(low, high, |x| (exact(x) < level) == below),
                rising: below,
            }
        })
        .collect()
}

/// Returns the last point from `inside` towards `outside` at which `holds` is still true.
///
/// `outside` may be lower or higher than `inside`. `holds` must be true at `inside` and false at `outside`; if its
/// value changes more than once in between, one of the changes is found.
pub(super) fn boundary(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..HALVINGS {
        let middle = inside.midpoint(outside);
        if middle.total_cmp(&inside).is_eq() || middle.total_cmp(&outside).is_eq() {
            break;
        }
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}
