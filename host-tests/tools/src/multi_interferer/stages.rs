//! For one target: from which places each relay's part of the chain can be continued to Rx, exactly, at one altitude.
//!
//! Heard at y, a hop's SIR depends only on its length, so its sender may stand anywhere in [y - d(y), y - s]: d(y) the longest
//! hop that y hears at the target, s the least separation. From Rx back, the places of relay k from which the rest can be
//! done are the union of these intervals over the places of relay k + 1. Over an interval of y on which d(y) >= s that is an
//! interval again, from the least y - d(y) on; so each relay's set is a few intervals, known by their ends. With s = 0 it is
//! one, [l_k, D]. A lower target only widens them, so that the best target can be bisected.

use super::crossing::boundary;
use super::line::{Line, Stride};
use super::spans::{Span, common, merged};

/// How a relay in `from` can be continued: the next one stands somewhere in `to`.
#[derive(Debug, Clone, Copy)]
struct Step {
    from: Span,
    to: Span,
    /// The place in `to` that hears the farthest back.
    farthest: f64,
}

/// The steps of one relay.
struct Stage {
    stride: Stride,
    steps: Vec<Step>,
}

/// A target that every hop but the first can meet.
pub(super) struct Stages<'a> {
    line: &'a Line<'a>,
    apart: f64,
    target: f64,
    /// The relays before the last, N - 1 down to 1.
    before: Vec<Stage>,
    /// Where relay 1 may stand, as far as the hops after it go.
    first: Vec<Span>,
}

/// What a stride allows, worked out once for all relays that speak alike.
struct Reach {
    stride: Stride,
    hearing: Vec<Span>,
    minima: Vec<f64>,
}

impl<'a> Stages<'a> {
    /// The sets for `target` (linear, > 0) with relays at least `apart` metres apart; `None` where one of them is empty.
    ///
    /// A scan of the line's nodes for every change of power from one relay to the next, and a few intervals a relay.
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

    /// Whether the first hop can meet the target, too.
    pub(super) fn is_met(&self) -> bool {
        let best = self.line.best_first(&self.first);
        best.is_some_and(|x| self.line.first_sir(x) >= self.target)
    }

    /// A chain that meets the target if [`Stages::is_met`], rising in x; `None` if the sets do not hang together.
    ///
    /// Each relay stands as near as the target lets it to an even division of the way that is left.
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

    /// The place nearest to `wish` for the receiver of a relay at `x`.
    fn next_place(&self, stage: &Stage, x: f64, wish: f64) -> Option<f64> {
        let steps = stage.steps.iter().filter(|step| step.from.contains(x));
        let places = steps.map(|step| {
            let near = x + self.apart;
            // It hears x if it is near enough, and else because it is the one that hears the farthest back.
            let sure = step.farthest.max(near).min(step.to.high);
            let wish = wish.clamp(step.to.low.max(near).min(sure), step.to.high);
            toward(sure, wish, |y| self.line.heard_from(stage.stride, y) <= x)
        });
        places.min_by(|a, b| (a - wish).abs().total_cmp(&(b - wish).abs()))
    }
}

/// From where the next relay's places `spans` are heard.
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

/// `wish` if it holds there, else the last place on the way from `sure`, where it holds.
fn toward(sure: f64, wish: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if holds(wish) {
        wish
    } else {
        boundary(sure, wish, holds)
    }
}
