//! Interior-point method for the positions that maximise the worst SIR of both directions.
//!
//! Differential dynamic programming follows one reach per hop. With a way back a hop has two, and in a sixth of the chains some
//! hop is limited by both at once, where neither has a derivative. So all positions move together here. With the levels
//! c_i = ln F_k and ln (B_k / r) of the N + 1 hops (see `hop`), the method maximises
//!
//! ```text
//! merit = T + mu (sum of ln(c_i - T) + sum of ln(distances to the box)),    sum of mu / (c_i - T) = 1
//! ```
//!
//! over the positions, for a falling mu; the second equation is the maximum over T, which is below every level by at least mu. At
//! the maximum for one mu, a concave problem of m levels has its optimum within m mu. Each iteration is a primal-dual Newton step
//! (see `newton`): the multipliers lambda_i follow their own linear equation instead of mu / (c_i - T), and remain within a factor
//! of that. A step ends before the box and is shortened until the merit does not fall.
//!
//! | file | content |
//! | --- | --- |
//! | `hop` | levels of a hop and their derivatives |
//! | `newton` | block tridiagonal system of a step |
//!
//! This file has the state and one portion of the work. Lengths are in units of D.

mod hop;
mod newton;

use super::hop::{Triple, minus};
use super::outlook::{upper_half, widened};
use super::solver::Seat;
use crate::mission::{Interferer, Mission};
use crate::place::{CrossSection, Placement};
use core::task::Poll;
use hop::{Derivatives, Gains, add_scaled, dot};
use newton::{Factor, Front, Sums, Weights};

/// First mu, from a distant and from a close start, and last mu; times the number of levels.
const FIRST_MU: f32 = 0.03;
const CLOSE_MU: f32 = 3e-3;
const LAST_MU: f32 = 1e-4;

/// Factor from one mu to the next.
const LESS: f32 = 0.3;

/// Gain of merit, in units of m mu, below which mu falls. First after a step of more than half, then after any step.
const SETTLED: f32 = 0.1;
const STUCK: f32 = 1e-3;

const ITERATIONS: u8 = 60;

/// Fraction of the way to the box that a step may take, and the factor between tries.
const NEAR_BOX: f32 = 0.98;
const SHORTER: f32 = 0.4;
const TRIES: u8 = 6;

/// Factor between a multiplier and mu / s.
const APART: f32 = 5.0;

/// Attempts at a factorisation, and the first damping.
const ATTEMPTS: u8 = 6;
const DAMPING: f32 = 1e-5;

/// Steps of T, and the relative error of the sum at which they end.
const TARGETS: u8 = 12;
const EXACT: f32 = 5e-4;

/// Relays of a portion.
const AT_ONCE: u16 = 10;
const SEGMENT: usize = 10;
/// Relays of a segment in memory; 0 without the feature `altitude`.
const STAGES: usize = if cfg!(feature = "altitude") {
    SEGMENT
} else {
    0
};

/// Levels of a hop, and their multipliers with three digits.
#[derive(Clone, Copy, Debug)]
struct Hop {
    level: [f32; 2],
    lambda: [u16; 2],
}

impl Hop {
    const NONE: Self = Self {
        level: [0.0; 2],
        lambda: [0; 2],
    };
}

/// Relay, its step with three digits, and the hop to it.
#[derive(Clone, Copy, Debug)]
struct Node {
    at: Triple,
    step: [u16; 3],
    hop: Hop,
}

#[derive(Clone, Copy, Debug)]
enum Work {
    /// Levels of this hop and the next ones, after a fraction of the step.
    Levels(u16),
    /// Newton step of T.
    Target(u8),
    /// Merit, from this hop on.
    Merit(u16),
    /// Elimination of a segment.
    Eliminate(u16),
    /// Factors of a segment, and then its steps.
    Factorise(u16),
    Substitute(u16),
}

/// Relays, whose positions are the variables, and the current step.
#[derive(Clone, Debug)]
pub(super) struct Interior<const RELAYS: usize, const SEGMENTS: usize> {
    gains: Gains,
    nodes: [Node; RELAYS],
    last: Hop,
    fronts: [Front; SEGMENTS],
    factors: [Factor; STAGES],
    work: Work,
    mu: f32,
    target: f32,
    least: f32,
    /// Merit of the positions, and the one that is summed.
    merit: f32,
    sum: f32,
    /// Fraction of the step, 0 for the positions themselves.
    share: f32,
    sums: Sums,
    by_target: f32,
    /// Multipliers mu / s in place of the stored ones.
    resets: bool,
    convex: bool,
    damping: f32,
    tries: u8,
    attempts: u8,
    iterations: u8,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Interior<RELAYS, SEGMENTS> {
    pub(super) const NEW: Self = Self {
        gains: Gains::NONE,
        nodes: [Node {
            at: [0.0; 3],
            step: [0; 3],
            hop: Hop::NONE,
        }; RELAYS],
        last: Hop::NONE,
        fronts: [Front::NONE; SEGMENTS],
        factors: [Factor::NONE; STAGES],
        work: Work::Levels(1),
        mu: 0.0,
        target: 0.0,
        least: 0.0,
        merit: 0.0,
        sum: 0.0,
        share: 0.0,
        sums: Sums::NONE,
        by_target: 0.0,
        resets: true,
        convex: false,
        damping: 0.0,
        tries: 0,
        attempts: 0,
        iterations: 0,
    };

    /// Starts from the positions given by [`Interior::put`], which may be `close` to the result.
    pub(super) fn start(&mut self, mission: &Mission, interferer: &Interferer, close: bool) {
        self.gains = Gains::new(mission, interferer);
        self.mu = if close { CLOSE_MU } else { FIRST_MU } / levels(mission);
        self.iterations = 0;
        self.convex = false;
        self.look(true);
    }

    /// Sets the position of relay `index`, with a margin to the box as a fraction of its width.
    pub(super) fn put(
        &mut self,
        mission: &Mission,
        seat: Seat,
        index: u16,
        place: Placement,
        margin: f32,
    ) {
        let [low, high] = room(mission, seat);
        let unit = 1.0 / mission.config().distance_m;
        let wanted = [place.x_m, place.y_m, place.altitude_m].map(|m| m * unit);
        let width = minus(high, low);
        let mut at = [0.0; 3];
        let ends = wanted.into_iter().zip(low.into_iter().zip(width));
        for (cell, (wanted, (low, width))) in at.iter_mut().zip(ends) {
            *cell = wanted
                .max(low + margin * width)
                .min(low + (1.0 - margin) * width);
        }
        if let Some(node) = self.node(index) {
            node.at = at;
            node.step = [0; 3];
        }
    }

    /// Stores two lengths for relay `index` while no step is computed.
    pub(super) fn note(&mut self, index: u16, lengths_m: [f32; 2]) {
        if let Some(node) = self.node(index) {
            node.hop.level = lengths_m;
        }
    }

    /// Returns the two lengths stored for relay `index`; 0 for Tx.
    pub(super) fn noted(&self, index: u16) -> [f32; 2] {
        let node = self.nodes.get(usize::from(index).wrapping_sub(1));
        node.map_or([0.0; 2], |node| node.hop.level)
    }

    /// Returns the cross-section of relay `index`.
    pub(super) fn cross_section(&self, mission: &Mission, index: u16) -> CrossSection {
        let [_, y, h] = self.at(mission.relays(), index);
        let distance_m = mission.config().distance_m;
        CrossSection {
            y_m: y * distance_m,
            altitude_m: h * distance_m,
        }
    }

    fn node(&mut self, index: u16) -> Option<&mut Node> {
        self.nodes.get_mut(usize::from(index).wrapping_sub(1))
    }

    /// Returns the position of node `index`, 0 for Tx and N + 1 for Rx.
    fn at(&self, relays: u16, index: u16) -> Triple {
        if index > relays {
            return [1.0, 0.0, 0.0];
        }
        let node = self.nodes.get(usize::from(index).wrapping_sub(1));
        node.map_or([0.0; 3], |node| node.at)
    }

    /// Returns hop `k`, 1..=N + 1.
    fn hop(&mut self, relays: u16, k: u16) -> &mut Hop {
        match self.nodes.get_mut(usize::from(k).wrapping_sub(1)) {
            Some(node) if k <= relays => &mut node.hop,
            _ => &mut self.last,
        }
    }

    /// Computes the levels of the positions themselves, with new multipliers or the stored ones.
    const fn look(&mut self, resets: bool) {
        self.share = 0.0;
        self.resets = resets;
        self.try_step();
    }

    const fn try_step(&mut self) {
        self.least = f32::INFINITY;
        self.sum = 0.0;
        self.work = Work::Levels(1);
    }

    /// Processes one portion of the work; ready with T, the logarithm of an SIR, at the end.
    pub(super) fn step(&mut self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat) -> Poll<f32> {
        let relays = mission.relays();
        match self.work {
            Work::Levels(k) => self.levels(mission, seat_of, k),
            Work::Target(step) => self.approach(relays, step),
            Work::Merit(k) => {
                let end = k.saturating_add(2 * AT_ONCE).min(relays + 2);
                for k in k..end {
                    let target = self.target;
                    let [a, b] = self.hop(relays, k).level;
                    self.sum += libm::logf((a - target) * (b - target));
                }
                self.work = Work::Merit(end);
                if end > relays + 1 {
                    return self.judge(mission);
                }
            }
            Work::Eliminate(segment) => {
                if self.eliminate(mission, seat_of, segment).is_none() {
                    self.attempts += 1;
                    if self.attempts >= ATTEMPTS {
                        return Poll::Ready(self.target);
                    }
                    if self.convex {
                        self.damping = (10.0 * self.damping).max(DAMPING);
                    }
                    self.convex = true;
                    self.work = Work::Eliminate(0);
                }
            }
            Work::Factorise(segment) => {
                if self.factorise(mission, seat_of, segment).is_none() {
                    return Poll::Ready(self.target);
                }
            }
            Work::Substitute(segment) => {
                if self.substitute(mission, seat_of, segment).is_none() {
                    return Poll::Ready(self.target);
                }
            }
        }
        Poll::Pending
    }

    /// Computes levels from hop `k` on, and the logarithms of the distances to the box.
    fn levels(&mut self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, k: u16) {
        let relays = mission.relays();
        let end = k.saturating_add(AT_ONCE).min(relays + 2);
        let mut from = self.moved(mission, seat_of, k - 1);
        let mut quiet = self.gains.quiet(from);
        for k in k..end {
            let to = self.moved(mission, seat_of, k);
            let ahead = self.gains.quiet(to);
            let both = self
                .gains
                .levels(k, relays, seat_of, [from, to], [quiet, ahead]);
            let [a, b] = both;
            self.least = self.least.min(a).min(b);
            self.hop(relays, k).level = both;
            if k <= relays {
                let [low, high] = room(mission, (seat_of)(k));
                let spans = minus(to, low).into_iter().zip(minus(high, to));
                let inside = spans.filter(|(a, b)| *a > 0.0 && *b > 0.0);
                self.sum += libm::logf(inside.map(|(a, b)| a * b).product());
            }
            (from, quiet) = (to, ahead);
        }
        self.work = if end > relays + 1 {
            self.target = self.least - self.mu;
            Work::Target(0)
        } else {
            Work::Levels(end)
        };
    }

    /// Returns the position of node `index` after the fraction of its step.
    fn moved(&self, mission: &Mission, seat_of: &impl Fn(u16) -> Seat, index: u16) -> Triple {
        let mut at = self.at(mission.relays(), index);
        let node = self.nodes.get(usize::from(index).wrapping_sub(1));
        if let Some(node) = node.filter(|_| index <= mission.relays()) {
            add_scaled(&mut at, node.step.map(widened), self.share);
            let [low, high] = room(mission, (seat_of)(index));
            for (cell, (low, high)) in at.iter_mut().zip(low.into_iter().zip(high)) {
                *cell = cell.max(low).min(high);
            }
        }
        at
    }

    /// Moves T toward the solution of its equation, by Newton's method for the inverse of the sum.
    ///
    /// That inverse is concave, and T starts beyond the solution, so T falls to it.
    fn approach(&mut self, relays: u16, step: u8) {
        let (mut sum, mut slope) = (0.0, 0.0);
        for k in 1..=relays + 1 {
            let target = self.target;
            for level in self.hop(relays, k).level {
                let inverse = 1.0 / (level - target);
                sum += inverse;
                slope += inverse * inverse;
            }
        }
        let (sum, slope) = (self.mu * sum, self.mu * slope);
        self.target -= (sum * sum - sum) / slope;
        self.work = if sum <= 1.0 + EXACT || step >= TARGETS {
            self.target = self.target.min(self.least - 0.5 * self.mu);
            Work::Merit(1)
        } else {
            Work::Target(step + 1)
        };
    }

    /// Returns the slacks and multipliers of hop `k`.
    fn weights(&mut self, relays: u16, k: u16) -> Weights {
        let (target, mu) = (self.target, self.mu);
        let Hop { level, lambda } = *self.hop(relays, k);
        Weights {
            lambda: lambda.map(widened),
            slack: level.map(|level| level - target),
            mu,
        }
    }

    /// Accepts or refuses a step, and begins the next one.
    fn judge(&mut self, mission: &Mission) -> Poll<f32> {
        let relays = mission.relays();
        let merit = self.target + self.mu * self.sum;
        let whole = self.mu * levels(mission);
        let is_step = self.share > 0.0;
        if is_step && !(merit >= self.merit) {
            self.tries += 1;
            self.share *= SHORTER;
            if self.tries < TRIES {
                self.try_step();
                return Poll::Pending;
            }
            // No step is better: once more without negative curvature, then with a smaller mu.
            let was_convex = self.convex;
            self.convex = true;
            if was_convex {
                return self.lower(whole, true);
            }
            self.look(true);
            return Poll::Pending;
        }
        let gain = merit - self.merit;
        if is_step {
            let share = self.share;
            for node in self.nodes.iter_mut().take(relays.into()) {
                add_scaled(&mut node.at, node.step.map(widened), share);
            }
            self.convex = false;
        }
        self.keep_multipliers(relays);
        if is_step && (self.share > 0.5 && gain < SETTLED * whole || gain < STUCK * whole) {
            return self.lower(whole, false);
        }
        self.merit = merit;
        if self.iterations >= ITERATIONS {
            return Poll::Ready(self.target);
        }
        self.iterations += 1;
        (self.attempts, self.damping) = (0, 0.0);
        self.work = Work::Eliminate(0);
        Poll::Pending
    }

    /// Lowers mu, or ends. `resets` is for multipliers that no step was found with.
    fn lower(&mut self, whole: f32, resets: bool) -> Poll<f32> {
        if whole <= 1.001 * LAST_MU {
            return Poll::Ready(self.target);
        }
        self.mu *= LESS.max(LAST_MU / whole);
        self.convex = false;
        self.look(resets);
        Poll::Pending
    }

    /// Keeps the multipliers close to mu / s.
    fn keep_multipliers(&mut self, relays: u16) {
        for k in 1..=relays + 1 {
            let Weights { slack, mu, .. } = self.weights(relays, k);
            let resets = self.resets;
            let hop = self.hop(relays, k);
            for (lambda, slack) in hop.lambda.iter_mut().zip(slack) {
                let central = mu / slack;
                *lambda = upper_half(if resets {
                    central
                } else {
                    widened(*lambda).max(central / APART).min(central * APART)
                });
            }
        }
        self.resets = false;
    }

    fn derivatives(&mut self, relays: u16, k: u16) -> (Derivatives, Weights) {
        let weights = self.weights(relays, k);
        let ends = [self.at(relays, k - 1), self.at(relays, k)];
        let hop = self
            .gains
            .derivatives(k, relays, ends, weights.lambda, self.convex);
        (hop, weights)
    }

    /// Eliminates relay `index` with rows `front`, and returns its factors and the rows of the next relay.
    fn pass(
        &mut self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        index: u16,
        front: Front,
    ) -> Option<(Factor, Front, Weights)> {
        let relays = mission.relays();
        let (hop, weights) = self.derivatives(relays, index + 1);
        let factor = front.eliminate(&hop, &weights, self.damping)?;
        if index >= relays {
            return Some((factor, front, weights));
        }
        let room = room(mission, (seat_of)(index + 1));
        let mut next = Front::start(&hop, &weights, self.at(relays, index + 1), room);
        factor.carry(&mut next);
        Some((factor, next, weights))
    }

    fn eliminate(
        &mut self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        segment: u16,
    ) -> Option<()> {
        let relays = mission.relays();
        if segment == 0 {
            let (hop, weights) = self.derivatives(relays, 1);
            self.sums = Sums::NONE;
            weights.sum(&mut self.sums);
            let room = room(mission, (seat_of)(1));
            *self.fronts.first_mut()? = Front::start(&hop, &weights, self.at(relays, 1), room);
        }
        let mut front = *self.fronts.get(usize::from(segment))?;
        let first = segment * AT_ONCE;
        for index in first + 1..=(first + AT_ONCE).min(relays) {
            let (factor, next, weights) = self.pass(mission, seat_of, index, front)?;
            weights.sum(&mut self.sums);
            factor.sum(&mut self.sums);
            front = next;
        }
        self.work = if first + AT_ONCE < relays {
            *self.fronts.get_mut(usize::from(segment) + 1)? = front;
            Work::Eliminate(segment + 1)
        } else {
            self.by_target = self.sums.by_target()?;
            (self.share, self.tries) = (1.0, 0);
            Work::Factorise(segment)
        };
        Some(())
    }

    /// Computes the factors of a segment again.
    fn factorise(
        &mut self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        segment: u16,
    ) -> Option<()> {
        let first = segment * AT_ONCE;
        let mut front = *self.fronts.get(usize::from(segment))?;
        for index in first + 1..=(first + AT_ONCE).min(mission.relays()) {
            let (factor, next, _) = self.pass(mission, seat_of, index, front)?;
            *self.factors.get_mut(usize::from(index - first - 1))? = factor;
            front = next;
        }
        self.work = Work::Substitute(segment);
        Some(())
    }

    /// Computes the steps of a segment from its last relay to its first. `None` if one is not finite.
    fn substitute(
        &mut self,
        mission: &Mission,
        seat_of: &impl Fn(u16) -> Seat,
        segment: u16,
    ) -> Option<()> {
        let relays = mission.relays();
        let first = segment * AT_ONCE;
        for index in (first + 1..=(first + AT_ONCE).min(relays)).rev() {
            let ahead = self.nodes.get(usize::from(index));
            let ahead = ahead
                .filter(|_| index < relays)
                .map_or([0.0; 3], |node| node.step.map(widened));
            let k = usize::from(index - first - 1);
            let step = self.factors.get(k)?.step(self.by_target, ahead);
            if !dot(step, step).is_finite() {
                return None;
            }
            self.limit(room(mission, (seat_of)(index)), index, step);
            self.follow(relays, index + 1, [step, ahead]);
            if index == 1 {
                self.follow(relays, 1, [[0.0; 3], step]);
            }
        }
        if let Some(before) = segment.checked_sub(1) {
            self.work = Work::Factorise(before);
        } else {
            self.try_step();
        }
        Some(())
    }

    /// Stores the step of relay `index`, and shortens all steps so that it stays in the box.
    fn limit(&mut self, [low, high]: [Triple; 2], index: u16, step: Triple) {
        let mut share = self.share;
        if let Some(node) = self.node(index) {
            node.step = step.map(upper_half);
            let ends = minus(node.at, low).into_iter().zip(minus(high, node.at));
            for (step, (below, above)) in step.into_iter().zip(ends) {
                let room = if step < 0.0 { below } else { above };
                if below > 0.0 && above > 0.0 && step.abs() * share > NEAR_BOX * room {
                    share = NEAR_BOX * room / step.abs();
                }
            }
        }
        self.share = share;
    }

    /// Updates the multipliers of hop `k`, whose ends move by `steps`.
    fn follow(&mut self, relays: u16, k: u16, [from, to]: [Triple; 2]) {
        let (hop, weights) = self.derivatives(relays, k);
        let ([a, b], [c, d]) = (hop.by_from, hop.by_to);
        let change = [
            dot(a, from) + dot(c, to) - self.by_target,
            dot(b, from) + dot(d, to) - self.by_target,
        ];
        self.hop(relays, k).lambda = weights.after(change).map(upper_half);
    }
}

/// Returns the number of levels of a chain.
fn levels(mission: &Mission) -> f32 {
    2.0 * f32::from(mission.relays() + 1)
}

/// Returns the lower and the upper corner of a relay's box, in units of D.
fn room(mission: &Mission, seat: Seat) -> [Triple; 2] {
    let unit = 1.0 / mission.config().distance_m;
    let (lateral, band) = (seat.room.lateral, seat.room.band);
    [
        [0.0, lateral.least_m * unit, band.least_m * unit],
        [1.0, lateral.most_m * unit, band.most_m * unit],
    ]
}
