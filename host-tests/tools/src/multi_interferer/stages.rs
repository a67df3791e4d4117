//! Exact sets of positions from which each relay's part of the chain can reach Rx. They belong to one target SIR and altitude.
//!
//! For a receiver at y the SIR of a hop depends only on its length, so the sender may be anywhere in [y - d(y), y - s]: d(y) the
//! hop range at the target, s the least separation. Backwards from Rx, the feasible positions of relay k are the union of these
//! intervals over those of relay k + 1. Over an interval of y with d(y) >= s this union is again an interval, from the least y -
//! d(y) on, so each set is a few intervals. With s = 0 it is one, [l_k, D]. A lower target only widens the sets, so the best
//! target can be bisected.

use super::crossing::boundary;
use super::line::{Line, Stride};
use super::spans::{Span, common, merged};

/// A feasible hop: for a relay anywhere in `from`, some position of the next relay in `to` works.
#[derive(Debug, Clone, Copy)]
struct Step {
    from: Span,
    to: Span,
    /// The receiver position in `to` with the farthest reach back.
    farthest: f64,
}

struct Stage {
    stride: Stride,
    steps: Vec<Step>,
}

/// A target that every hop except the first can meet.
pub(super) struct Stages<'a> {
    line: &'a Line<'a>,
    apart: f64,
    target: f64,
    /// Relays N - 1 down to 1.
    before: Vec<Stage>,
    /// Positions of relay 1 that are feasible for the hops after it.
    first: Vec<Span>,
}

/// Hop ranges for one stride, computed once for consecutive relays of equal power.
struct Reach {
    stride: Stride,
    hearing: Vec<Span>,
    minima: Vec<f64>,
}

impl<'a> Stages<'a> {
    /// Computes the sets for `target` (linear, > 0) and a separation of `apart` metres. `None` if one is empty.
    ///
    /// Work: a scan of the line's nodes for every change of power along the chain, and a few intervals per relay.
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

    /// Returns true if the first hop meets the target as well.
    pub(super) fn is_met(&self) -> bool {
        let best = self.line.best_first(&self.first);
        best.is_some_and(|x| self.line.first_sir(x) >= self.target)
    }

    /// Returns a chain that meets the target if [`Stages::is_met`], rising in x. `None` if the sets are not connected.
    ///
    /// Each relay is as near to an even division of the remaining distance as the target allows.
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

    /// Returns the position of the next relay nearest to `wish` that hears a relay at `x`.
    fn next_place(&self, stage: &Stage, x: f64, wish: f64) -> Option<f64> {
        let steps = stage.steps.iter().filter(|step| step.from.contains(x));
        let places = steps.map(|step| {
            let near = x + self.apart;
            // `sure` hears x: either it is close enough, or it is the position with the farthest reach back.
            let sure = step.farthest.max(near).min(step.to.high);
            let wish = wish.clamp(step.to.low.max(near).min(sure), step.to.high);
            toward(sure, wish, |y| self.line.heard_from(stage.stride, y) <= x)
        });
        places.min_by(|a, b| (a - wish).abs().total_cmp(&(b - wish).abs()))
    }
}

/// Returns the positions from which the next relay, somewhere in `spans`, can be reached.
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

/// Returns `wish` if `holds` is true there. Otherwise returns the last such point on the way from `sure`, where it is true.
fn toward(sure: f64, wish: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if holds(wish) {
        wish
    } else {
        boundary(sure, wish, holds)
    }
}
