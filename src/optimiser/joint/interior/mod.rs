//! Interior-point method for the positions that maximise the worst SIR of both directions.
//!
//! With data in both directions a hop has two reaches, and in a sixth of the chains some hop is limited by both at
//! once, where neither has a derivative. So differential dynamic programming, which follows one reach per hop, is not
//! used: all positions move together. With the levels c_i = ln F_k and ln (B_k / r) of the N + 1 hops (see `hop`), the
//! method maximises
//! `hop`), the method maximises
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
//! T is the *target* and mu the *barrier weight*, which the constants give for all levels together. The lambda_i are the Lagrange
//! multipliers; mu / (c_i - T) are their values at the optimum. The positions have *settled* once the merit gains little.
//!
//! This file has the state and one portion of the work. Lengths are in units of D. A lateral offset and altitude are
//! stored in six bytes, as in the other solver. The memory of a segment of ten relays has its front during the
//! elimination, and then its steps.

mod hop;
mod newton;

use super::chain::{Chain, SeatOf};
use super::hop::{Triple, minus};
use super::line::Noted;
use super::outlook::{upper_half, widened};
use super::site::{Cell, Cells};
use crate::place::{CrossSection, Placement};
use core::task::Poll;
use hop::{Derivatives, Levels, LogGains, add_scaled, dot};
use newton::{Factor, Front, Sums, Weights};

/// First barrier weight of the interior-point method, for a start far from the result.
const FIRST_MU: f32 = 0.03;
/// First barrier weight of the interior-point method, for a start near the result.
const CLOSE_MU: f32 = 3e-3;
/// Last barrier weight. The result differs from a local optimum by at most this value, in ln(SIR), if the problem is
/// concave around the optimum.
const LAST_MU: f32 = 1e-4;

/// Factor that lowers the barrier weight, once a Newton step raises the merit only a little. The merit is the maximised
/// function.
const LESS: f32 = 0.3;

/// Increase of the merit, divided by the barrier weight, below which the optimum counts as reached. This limit applies
/// if the relays made more than half of the computed Newton step. The merit is the maximised function.
const SETTLED: f32 = 0.1;
/// Increase of the merit, divided by the barrier weight, below which the optimum counts as reached. This limit applies
/// after a Newton step of any length. The merit is the maximised function.
const STUCK: f32 = 1e-3;

const ITERATIONS: u8 = 60;

/// Maximum step of a coordinate toward its lower or upper limit, divided by the distance to that limit.
const NEAR_BOX: f32 = 0.98;
/// Factor on the length of a Newton step that lowers the merit (the maximised function).
const SHORTER: f32 = 0.4;
const TRIES: u8 = 6;

/// Maximum factor by which a Lagrange multiplier may differ from mu / slack, its value at the optimum. A multiplier
/// that differs more is set to the end of this range.
const APART: f32 = 5.0;

/// Number of Newton iterations per call that compute the target T. T, in ln(SIR), is slightly below the SIRs of all
/// hops.
const STEPS: u8 = 4;
/// Index, from 0, of the last Newton iteration that computes the target T. T, in ln(SIR), is slightly below the SIRs of
/// all hops.
const TARGETS: u8 = 12;
/// Relative error of the equation for the target T, at which the Newton iteration for T ends. The equation is: the sum
/// of mu / (c - T) over all levels c is 1, with the barrier weight mu.
const EXACT: f32 = 5e-4;

/// Number of relays in a segment, the part of the chain that one call handles.
const AT_ONCE: u16 = 10;
/// Number of relays in the first part of a segment. A segment has ten relays; the second part has [`SECOND`] of them.
const FIRST: usize = 6;
const SECOND: usize = 4;
const FIRST_RELAYS: u16 = 6;

/// Levels of a hop (see [`Levels`]), and their Lagrange multipliers. Each multiplier is stored as the upper 16 bits of
/// an f32.
#[derive(Clone, Copy, Debug)]
struct Hop {
    level: Levels,
    lambda: [u16; 2],
}

impl Hop {
    const NONE: Self = Self {
        level: [0.0; 2],
        lambda: [0; 2],
    };
}

/// x of a relay, in units of the distance from Tx to Rx, and the hop that ends at the relay.
#[derive(Clone, Copy, Debug)]
pub(super) struct Node {
    x: f32,
    hop: Hop,
}

/// Memory for Algorithm 1, which computes the x of all relays for one target. The memory is that of the hop's levels,
/// which are computed later.
impl Noted for Node {
    fn lengths_m(&mut self) -> &mut [f32; 2] {
        &mut self.hop.level
    }
}

/// Newton step of a relay in x, y and h. Each value is stored as the upper 16 bits of an f32 (three decimal digits).
type Step = [u16; 3];

#[derive(Clone, Copy, Debug)]
enum Segment {
    /// Equations of the first relay of a segment (ten relays), after all earlier relays are eliminated.
    Front(Front),
    /// Newton steps of the relays of a segment: of its first six relays, and of its last four relays.
    Steps([Step; FIRST], [Step; SECOND]),
}

/// Position (x, y, h) of a node and its limits, in units of the distance from Tx to Rx.
#[derive(Clone, Copy, Debug)]
struct Spot {
    at: Triple,
    low: Triple,
    high: Triple,
}

impl Spot {
    const fn fixed(at: Triple) -> Self {
        Self {
            at,
            low: at,
            high: at,
        }
    }

    /// Returns the distances of x, y and h from their lower limits.
    fn room_below(&self) -> Triple {
        minus(self.at, self.low)
    }

    /// Returns the distances of x, y and h from their upper limits.
    fn room_above(&self) -> Triple {
        minus(self.high, self.at)
    }

    /// Moves each coordinate so that it is at least `margin` inside its limits. `margin` is a fraction of the distance
    /// between the limits.
    fn enclose(&mut self, margin: f32) {
        let limits = self.low.iter().zip(&self.high);
        for (cell, (low, high)) in self.at.iter_mut().zip(limits) {
            let margin = margin * (high - low);
            *cell = cell.max(low + margin).min(high - margin);
        }
    }
}

#[derive(Clone, Copy, Debug)]
enum Work {
    /// Computation of all hops' [levels](Levels) at the tried positions. The field is the next hop.
    Levels(u16),
    /// Computation of the target T from the levels of all hops. T is slightly below all levels. The field is the number
    /// of Newton iterations done for T.
    Target(u8),
    /// Summation of the merit, which decides if a step is accepted. The field is the next hop.
    Merit(u16),
    /// Storage of the accepted positions and of new Lagrange multipliers; the field is the next hop.
    Accept(u16),
    /// Elimination of all relays from the Newton system; the field is the next segment of the chain.
    Eliminate(u16),
    /// Computation of the relays' Newton steps. The fields are the next segment of the chain, and a flag: true for the
    /// segment's second half, which is computed before its first half.
    Substitute(u16, bool),
}

/// Interior-point method that maximises the worst SIR of all hops, in both directions of data. It stores the relays'
/// positions and Newton steps.
#[derive(Clone, Debug)]
pub(super) struct Interior<const RELAYS: usize, const SEGMENTS: usize> {
    gains: LogGains,
    /// Lateral offsets and altitudes of the relays.
    pub(super) cells: Cells<RELAYS>,
    /// Minimum distance of relay 1 from Rx along x, and minimum distance of the last relay from Tx. The unit is the
    /// distance from Tx to Rx.
    pub(super) closed: [f32; 2],
    pub(super) nodes: [Node; RELAYS],
    last: Hop,
    segments: [Segment; SEGMENTS],
    /// Newton steps of the last four relays of the current segment, kept until the first six are computed.
    second: [Step; SECOND],
    /// Newton step of the next relay toward Rx. The current relay's step is computed from it.
    ahead: Triple,
    work: Work,
    mu: f32,
    target: f32,
    least: f32,
    /// Merit (the maximised function) at the stored positions. A step is accepted if it does not lower the merit.
    merit: f32,
    /// Sum of the logarithms in the merit (the maximised function), over the hops handled so far. The logarithms are
    /// those for the tried positions.
    sum: f32,
    /// Fraction of the Newton step that is tried; 0 to evaluate the stored positions.
    share: f32,
    sums: Sums,
    by_target: f32,
    /// True to replace the stored Lagrange multipliers by their values at the optimum.
    resets: bool,
    convex: bool,
    tries: u8,
    iterations: u8,
}

impl<const RELAYS: usize, const SEGMENTS: usize> Interior<RELAYS, SEGMENTS> {
    pub(super) const NEW: Self = Self {
        gains: LogGains::NONE,
        cells: Cells::NEW,
        closed: [0.0; 2],
        nodes: [Node {
            x: 0.0,
            hop: Hop::NONE,
        }; RELAYS],
        last: Hop::NONE,
        segments: [Segment::Front(Front::NONE); SEGMENTS],
        second: [[0; 3]; SECOND],
        ahead: [0.0; 3],
        work: Work::Levels(0),
        mu: 0.0,
        target: 0.0,
        least: 0.0,
        merit: 0.0,
        sum: 0.0,
        share: 0.0,
        sums: Sums::NONE,
        by_target: 0.0,
        resets: false,
        convex: false,
        tries: 0,
        iterations: 0,
    };

    /// Starts the interior-point method from the positions that [`Interior::put`] has set. If `is_close` is true, they
    /// are close to the result, and the first barrier weight is smaller.
    pub(super) fn start(&mut self, chain: &Chain<'_, impl SeatOf>, is_close: bool) {
        self.gains = LogGains::new(chain);
        self.mu = if is_close { CLOSE_MU } else { FIRST_MU } / levels(chain);
        self.iterations = 0;
        self.convex = false;
        self.look(true);
    }

    /// Sets relay `index` to `place`, moved at least `margin` inside the limits of its coordinates. `margin` is a
    /// fraction of the distance between the limits.
    pub(super) fn put(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        index: u16,
        place: Placement,
        margin: f32,
    ) {
        let mut spot = self.spot(chain, index);
        let unit = 1.0 / chain.distance_m();
        spot.at = [place.x_m, place.y_m, place.altitude_m].map(|m| m * unit);
        spot.enclose(margin);
        self.settle(chain, index, spot.at);
    }

    /// Stores the position (x, y, h) of relay `index`, in units of the distance from Tx to Rx.
    #[inline(never)]
    fn settle(&mut self, chain: &Chain<'_, impl SeatOf>, index: u16, [x, y, h]: Triple) {
        let distance_m = chain.distance_m();
        let at = CrossSection {
            y_m: y * distance_m,
            altitude_m: h * distance_m,
        };
        (self.cells).set(index, Cell::of(at, chain.room(index)));
        if let Some(node) = self.node(index) {
            node.x = x;
        }
    }

    /// Returns the x of relay `index`, m, that Algorithm 1 has stored. This algorithm computes the x of all relays for
    /// one target.
    pub(super) fn noted_x_m(&self, index: u16) -> f32 {
        let node = self.nodes.get(usize::from(index).wrapping_sub(1));
        node.map_or(0.0, |node| node.hop.level[0])
    }

    fn node(&mut self, index: u16) -> Option<&mut Node> {
        self.nodes.get_mut(usize::from(index).wrapping_sub(1))
    }

    /// Returns the stored position of node `index` and its limits. Index 0 is Tx, and N + 1 is Rx.
    #[inline(never)]
    fn spot(&self, chain: &Chain<'_, impl SeatOf>, index: u16) -> Spot {
        if index > chain.relays() {
            return Spot::fixed([1.0, 0.0, 0.0]);
        }
        let Some(node) = self.nodes.get(usize::from(index).wrapping_sub(1)) else {
            return Spot::fixed([0.0; 3]);
        };
        let unit = 1.0 / chain.distance_m();
        let room = chain.room(index);
        let at = self.cells.get(index).place(room);
        let (lateral, band) = (room.lateral, room.band);
        let [far, near] = self.closed;
        let most = if index == 1 { 1.0 - far } else { 1.0 };
        let least = if index == chain.relays() { near } else { 0.0 };
        Spot {
            at: [node.x, at.y_m * unit, at.altitude_m * unit],
            low: [least, lateral.least_m * unit, band.least_m * unit],
            high: [most, lateral.most_m * unit, band.most_m * unit],
        }
    }

    /// Returns the stored Newton step of relay `index` in x, y and h; zeros for Tx.
    fn step_of(&self, index: u16) -> Triple {
        let at = usize::from(index).wrapping_sub(1);
        let (segment, k) = (at / (FIRST + SECOND), at % (FIRST + SECOND));
        let step = match self.segments.get(segment) {
            Some(Segment::Steps(first, second)) => {
                first.get(k).or_else(|| second.get(k.wrapping_sub(FIRST)))
            }
            _ => None,
        };
        step.map_or([0.0; 3], |step| step.map(widened))
    }

    /// Returns the position of node `index` after the tried fraction of its Newton step, and its limits.
    #[inline(never)]
    fn moved(&self, chain: &Chain<'_, impl SeatOf>, index: u16) -> Spot {
        let mut spot = self.spot(chain, index);
        if self.share > 0.0 {
            add_scaled(&mut spot.at, &self.step_of(index), self.share);
            spot.enclose(0.0);
        }
        spot
    }

    /// Returns the stored levels and Lagrange multipliers of hop `k`. Hop `k` leads to relay `k`, or to Rx for
    /// `k` = N + 1.
    #[inline(never)]
    fn hop(&mut self, relays: u16, k: u16) -> &mut Hop {
        match self.nodes.get_mut(usize::from(k).wrapping_sub(1)) {
            Some(node) if k <= relays => &mut node.hop,
            _ => &mut self.last,
        }
    }

    /// Prepares the evaluation of the stored positions, without a step. If `resets` is true, the evaluation sets the
    /// Lagrange multipliers to their values at the optimum.
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

    /// Continues the interior-point method by a bounded amount of work. `Ready` at the end with the target T, in
    /// ln(SIR). T is slightly below all [levels](Levels) of the hops at the stored positions.
    pub(super) fn step(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<f32> {
        let relays = chain.relays();
        let done = match self.work {
            Work::Levels(k) => {
                self.levels(chain, k);
                Some(())
            }
            Work::Target(steps) => {
                self.approach(relays, steps);
                Some(())
            }
            Work::Merit(k) => {
                let end = k.saturating_add(2 * AT_ONCE).min(relays + 2);
                for k in k..end {
                    let target = self.target;
                    let [a, b] = self.hop(relays, k).level;
                    self.sum += libm::logf((a - target) * (b - target));
                }
                self.work = Work::Merit(end);
                if end > relays + 1 {
                    return self.judge(chain);
                }
                Some(())
            }
            Work::Accept(k) => {
                let end = k.saturating_add(2 * AT_ONCE).min(relays + 2);
                for k in k..end {
                    self.accept(chain, k);
                }
                self.work = Work::Accept(end);
                if end > relays + 1 {
                    return self.continue_with(chain);
                }
                Some(())
            }
            Work::Eliminate(segment) => self.forward(chain, segment).or_else(|| {
                self.work = Work::Eliminate(0);
                (!core::mem::replace(&mut self.convex, true)).then_some(())
            }),
            Work::Substitute(segment, is_second) => self.substitute(chain, segment, is_second),
        };
        match done {
            Some(()) => Poll::Pending,
            None => Poll::Ready(self.target),
        }
    }

    /// Computes the [levels](Levels) of ten hops from hop `k` on, and the barrier terms of their receivers. A barrier
    /// term is the logarithm of a coordinate's distance to its limit.
    fn levels(&mut self, chain: &Chain<'_, impl SeatOf>, k: u16) {
        let relays = chain.relays();
        let end = k.saturating_add(AT_ONCE).min(relays + 2);
        let mut from = self.moved(chain, k - 1).at;
        let mut quiet = self.gains.quiet(from);
        for k in k..end {
            let spot = self.moved(chain, k);
            let to = spot.at;
            let ahead = self.gains.quiet(to);
            let both = self.gains.levels(k, chain, [from, to], [quiet, ahead]);
            let [a, b] = both;
            self.least = self.least.min(a).min(b);
            self.hop(relays, k).level = both;
            let mut inside = 1.0;
            for (a, b) in spot.room_below().iter().zip(&spot.room_above()) {
                if *a > 0.0 && *b > 0.0 {
                    inside *= a * b;
                }
            }
            self.sum += libm::logf(inside);
            (from, quiet) = (to, ahead);
        }
        self.work = if end > relays + 1 {
            self.target = self.least - self.mu;
            Work::Target(0)
        } else {
            Work::Levels(end)
        };
    }

    /// Computes the target T, in ln(SIR), for the stored levels c. With the barrier weight mu, the sum of mu / (c - T)
    /// over all levels is 1.
    ///
    /// The inverse of this sum is concave in T, and Newton's method starts above the solution. So every iteration
    /// lowers T toward the solution.
    fn approach(&mut self, relays: u16, steps: u8) {
        let end = steps + STEPS;
        self.work = Work::Target(end);
        for step in steps..end {
            let (mut sum, mut slope) = (0.0, 0.0);
            for k in 1..relays + 2 {
                let target = self.target;
                let [a, b] = self.hop(relays, k).level;
                let (a, b) = (1.0 / (a - target), 1.0 / (b - target));
                sum += a + b;
                slope += a * a + b * b;
            }
            let (sum, slope) = (self.mu * sum, self.mu * slope);
            self.target -= (sum * sum - sum) / slope;
            if sum <= 1.0 + EXACT || step >= TARGETS {
                self.target = self.target.min(self.least - 0.5 * self.mu);
                self.work = Work::Merit(1);
                return;
            }
        }
    }

    fn weights(&mut self, relays: u16, k: u16) -> Weights {
        let (target, mu) = (self.target, self.mu);
        let Hop { level, lambda } = *self.hop(relays, k);
        Weights {
            lambda: lambda.map(widened),
            slack: level.map(|level| level - target),
            mu,
        }
    }

    /// Accepts the tried Newton step if it does not lower the merit; otherwise shortens the step. If the shortest step
    /// also lowers the merit, a new Newton step is computed without negative curvature. If the shortest part of that
    /// step lowers the merit too, the barrier weight is lowered. The merit is the maximised function.
    fn judge(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<f32> {
        if !(self.share > 0.0) || self.summed() >= self.merit {
            self.work = Work::Accept(1);
            return Poll::Pending;
        }
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
            return self.lower(chain, true);
        }
        self.look(true);
        Poll::Pending
    }

    fn summed(&self) -> f32 {
        self.target + self.mu * self.sum
    }

    /// Stores the new position of relay `k`. Limits the Lagrange multipliers of the hop to relay `k`: they differ from
    /// their values at the optimum by at most the factor [`APART`].
    fn accept(&mut self, chain: &Chain<'_, impl SeatOf>, k: u16) {
        let relays = chain.relays();
        if self.share > 0.0 && k <= relays {
            let spot = self.moved(chain, k);
            self.settle(chain, k, spot.at);
        }
        let central = self.weights(relays, k).central();
        let resets = self.resets;
        let hop = self.hop(relays, k);
        for (lambda, central) in hop.lambda.iter_mut().zip(central) {
            *lambda = upper_half(if resets {
                central
            } else {
                widened(*lambda).max(central / APART).min(central * APART)
            });
        }
    }

    /// Starts the next Newton step from the accepted positions, or lowers the barrier weight. `Ready` with the target,
    /// in ln(SIR), after the maximum number of steps.
    fn continue_with(&mut self, chain: &Chain<'_, impl SeatOf>) -> Poll<f32> {
        let merit = self.summed();
        let gain = (merit - self.merit) / (self.mu * levels(chain));
        let is_step = self.share > 0.0;
        self.convex &= !is_step;
        self.resets = false;
        if is_step && (self.share > 0.5 && gain < SETTLED || gain < STUCK) {
            return self.lower(chain, false);
        }
        self.merit = merit;
        if self.iterations >= ITERATIONS {
            return Poll::Ready(self.target);
        }
        self.iterations += 1;
        self.work = Work::Eliminate(0);
        Poll::Pending
    }

    /// Lowers the barrier weight and continues. `Ready` with the target, in ln(SIR), if the lowest barrier weight is
    /// already in use. `resets` is true to replace the Lagrange multipliers, because no step with them has raised the
    /// merit.
    fn lower(&mut self, chain: &Chain<'_, impl SeatOf>, resets: bool) -> Poll<f32> {
        let whole = self.mu * levels(chain);
        if whole <= 1.001 * LAST_MU {
            return Poll::Ready(self.target);
        }
        self.mu *= LESS.max(LAST_MU / whole);
        self.convex = false;
        self.look(resets);
        Poll::Pending
    }

    /// Returns the derivatives of hop `k`'s [levels](Levels) with respect to the positions `ends`. Also returns the
    /// hop's Lagrange multipliers and slacks (level minus target).
    #[inline(never)]
    fn derivatives(&mut self, relays: u16, k: u16, ends: [Triple; 2]) -> (Derivatives, Weights) {
        let weights = self.weights(relays, k);
        let hop = (self.gains).derivatives(k, relays, ends, weights.lambda, self.convex);
        (hop, weights)
    }

    /// Eliminates the first `count` relays of `segment` from the Newton system. Returns the equations of the next
    /// relay; `None` if a pivot is not positive. `factors` receives the equations of the last six eliminated relays,
    /// from which their Newton steps are computed.
    #[inline(never)]
    fn eliminate(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        segment: u16,
        count: u16,
        factors: &mut [Factor; FIRST],
    ) -> Option<Front> {
        let first = segment * AT_ONCE;
        // The first segment begins with Tx.
        let (from, mut front) = match self.segments.get(usize::from(segment)) {
            Some(Segment::Front(front)) if segment > 0 => (first + 1, *front),
            _ => (0, Front::NONE),
        };
        let relays = chain.relays();
        let mut at = self.spot(chain, from).at;
        let after = first + count + 1;
        for index in from..after {
            let spot = self.spot(chain, index + 1);
            let (hop, weights) = self.derivatives(relays, index + 1, [at, spot.at]);
            at = spot.at;
            let (convex, sums) = (self.convex, &mut self.sums);
            let factor = front.pass(index > 0, &hop, &weights, &spot, convex, sums)?;
            // Tx has no factors to store.
            let k = usize::from(index.wrapping_sub(first + 1)) % FIRST;
            if let Some(kept) = factors.get_mut(k) {
                *kept = factor;
            }
        }
        Some(front)
    }

    /// Eliminates all relays of `segment`, which has ten relays, from the Newton system. Then begins the next segment
    /// or the computation of steps. `None` if the Newton system cannot be solved.
    fn forward(&mut self, chain: &Chain<'_, impl SeatOf>, segment: u16) -> Option<()> {
        let relays = chain.relays();
        if segment == 0 {
            self.sums = Sums::NONE;
        }
        let count = AT_ONCE.min(relays - segment * AT_ONCE);
        let front = self.eliminate(chain, segment, count, &mut [Factor::NONE; FIRST])?;
        let next = segment + 1;
        self.work = if let Some(segment) = self.segments.get_mut(usize::from(next))
            && next * AT_ONCE < relays
        {
            *segment = Segment::Front(front);
            Work::Eliminate(next)
        } else {
            self.by_target = self.sums.by_target()?;
            (self.share, self.tries, self.ahead) = (1.0, 0, [0.0; 3]);
            Work::Substitute(segment, count > FIRST_RELAYS)
        };
        Some(())
    }

    /// Computes the Newton steps of the first six or the last four relays of `segment`. It starts with the relay
    /// nearest to Rx. `None` if the system cannot be solved or a step is not finite.
    fn substitute(
        &mut self,
        chain: &Chain<'_, impl SeatOf>,
        segment: u16,
        is_second: bool,
    ) -> Option<()> {
        let first = segment * AT_ONCE;
        let middle = first + FIRST_RELAYS;
        let (begin, end) = if is_second {
            (middle, first + AT_ONCE)
        } else {
            (first, middle)
        };
        let relays = chain.relays();
        let end = end.min(relays);
        let mut factors = [Factor::NONE; FIRST];
        self.eliminate(chain, segment, end - first, &mut factors)?;
        let mut steps = [[0; 3]; FIRST];
        let after = end + 1;
        let mut to = self.spot(chain, after).at;
        for index in (begin + 1..after).rev() {
            let k = usize::from(index - first - 1) % FIRST;
            let ahead = self.ahead;
            let step = factors.get(k)?.step(self.by_target, ahead);
            if !dot(&step, &step).is_finite() {
                return None;
            }
            *steps.get_mut(k)? = step.map(upper_half);
            let spot = self.spot(chain, index);
            self.limit(&spot, step);
            self.follow(relays, index + 1, [spot.at, to], [step, ahead]);
            (self.ahead, to) = (step, spot.at);
        }
        if is_second {
            let [a, b, c, d, ..] = steps;
            self.second = [a, b, c, d];
            self.work = Work::Substitute(segment, false);
            return Some(());
        }
        let kept = self.segments.get_mut(usize::from(segment))?;
        *kept = Segment::Steps(steps, self.second);
        if let Some(before) = segment.checked_sub(1) {
            self.work = Work::Substitute(before, true);
        } else {
            self.follow(relays, 1, [[0.0; 3], to], [[0.0; 3], self.ahead]);
            self.try_step();
        }
        Some(())
    }

    /// Lowers the tried fraction of all Newton steps, so that the relay at `spot` stays within its limits. `step` is
    /// that relay's whole Newton step.
    fn limit(&mut self, spot: &Spot, step: Triple) {
        let (below, above) = (spot.room_below(), spot.room_above());
        for (step, (below, above)) in step.iter().zip(below.iter().zip(&above)) {
            let room = if *step < 0.0 { below } else { above };
            let most = NEAR_BOX * room / step.abs();
            if *below > 0.0 && *above > 0.0 && most < self.share {
                self.share = most;
            }
        }
    }

    /// Updates the Lagrange multipliers of hop `k` for whole (not shortened) Newton steps of its ends. `from` and
    /// `to` are these steps, and `ends` the positions before them.
    fn follow(&mut self, relays: u16, k: u16, ends: [Triple; 2], [from, to]: [Triple; 2]) {
        let (hop, weights) = self.derivatives(relays, k, ends);
        let ([a, b], [c, d]) = (&hop.by_from, &hop.by_to);
        let change = [
            dot(a, &from) + dot(c, &to) - self.by_target,
            dot(b, &from) + dot(d, &to) - self.by_target,
        ];
        self.hop(relays, k).lambda = weights.after(change).map(upper_half);
    }
}

/// Returns the number of [levels](Levels) in a chain: one for each hop and direction of data.
fn levels(chain: &Chain<'_, impl SeatOf>) -> f32 {
    2.0 * f32::from(chain.relays() + 1)
}
