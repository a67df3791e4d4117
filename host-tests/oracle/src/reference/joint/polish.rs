//! Local optimisation of a chain: a feasible primal-dual interior-point method.
//!
//! Unknowns are the positions and the target; the target is maximised while every [`Limit`] stays > 0. A Newton step costs O(N);
//! if the Lagrangian is not convex, a multiple of the identity is added until it is.

use super::limits::{Limit, limits};
use super::scene::Scene;
use super::space::{Square, Triple};
use super::system::{Block, solve};

/// Final barrier weight. The target ends below the local optimum by this times the number of constraints.
const LAST_WEIGHT: f64 = 1e-12;

/// Least error of the optimality conditions above rounding.
const LEAST_ERROR: f64 = 1e-10;

const STEPS: u32 = 400;

/// Largest part of the distance to the nearest constraint that one step may take.
const NEARLY: f64 = 0.995;

/// A chain with its target and the multipliers of its constraints.
struct Iterate {
    places: Vec<Triple>,
    target: f64,
    limits: Vec<Limit>,
    duals: Vec<f64>,
}

/// Returns the local optimum reached from `start`; `None` if `start` is not strictly feasible.
///
/// Also `None` as soon as the optimum cannot exceed `hope`, a ln SIR. `slack` > 0 is the difference of the initial target below
/// the SIR of `start`, and sets the initial barrier: a larger slack forgets more of `start`.
pub(super) fn polish(
    scene: &Scene,
    start: &[Triple],
    slack: f64,
    hope: f64,
) -> Option<Vec<Triple>> {
    let target = scene.worst(start) - slack;
    let limits = limits(scene, start, target);
    if limits.is_empty() || !limits.iter().all(|limit| limit.value > 0.0) {
        return None;
    }
    let count = limits.len() as f64;
    let mut weight = slack / count;
    let duals = limits.iter().map(|limit| weight / limit.value).collect();
    let mut at = Iterate {
        places: start.to_vec(),
        target,
        limits,
        duals,
    };
    for _ in 0..STEPS {
        let is_central = at.error(scene, weight) < weight.max(LEAST_ERROR);
        if is_central {
            // The optimum is about the number of constraints times the weight above the target.
            if at.target + 2.0 * count * weight < hope {
                return None;
            }
            if weight <= LAST_WEIGHT {
                break;
            }
            weight = (0.1 * weight).max(LAST_WEIGHT);
        }
        if !at.step(scene, weight) {
            if weight <= LAST_WEIGHT {
                break;
            }
            // Rounding hides the remaining gain at this weight.
            weight = (0.1 * weight).max(LAST_WEIGHT);
        }
    }
    Some(at.places)
}

struct Direction {
    steps: Vec<Triple>,
    raise: f64,
}

impl Direction {
    fn of(&self, relay: usize) -> (Triple, Triple) {
        let step = |i: usize| self.steps.get(i).copied();
        let before = relay.checked_sub(1).and_then(step);
        (step(relay).unwrap_or_default(), before.unwrap_or_default())
    }
}

impl Iterate {
    /// Returns the largest violation of the optimality conditions at a barrier weight.
    fn error(&self, scene: &Scene, weight: f64) -> f64 {
        let mut slopes = vec![Triple::default(); self.places.len()];
        let (mut target, mut worst) = (1.0, 0.0_f64);
        for (limit, &dual) in self.limits.iter().zip(&self.duals) {
            add(&mut slopes, limit.relay, limit.own * dual);
            if let Some(before) = limit.relay.checked_sub(1) {
                add(&mut slopes, before, limit.before * dual);
            }
            target += limit.target * dual;
            worst = worst.max((limit.value * dual - weight).abs());
        }
        let slopes = slopes.iter().zip(&scene.rooms);
        let slopes = slopes.map(|(slope, room)| slope.times(room.free()).size());
        slopes.fold(worst.max(target.abs()), f64::max)
    }

    /// Takes one damped Newton step; returns false if it gains nothing.
    ///
    /// The step is an arc, because the constraints are curved and a straight step along a narrow valley would soon hit its wall.
    fn step(&mut self, scene: &Scene, weight: f64) -> bool {
        let Some((damping, line)) = self.direction(scene, weight) else {
            return false;
        };
        let changes = self.changes(&line);
        let bends = self.bends(&line);
        let Some(arc) = self.damped_direction(scene, weight, damping, Some(&bends)) else {
            return false;
        };
        let slopes = self.limits.iter().zip(&changes);
        let gain = line.raise
            + slopes
                .map(|(limit, change)| weight * change / limit.value)
                .sum::<f64>();
        let merit = self.merit(weight);
        let mut share = 1.0;
        while share > 1e-10 {
            let (straight, bent) = (share * (1.0 - share), share * share);
            let moves = self.places.iter().zip(line.steps.iter().zip(&arc.steps));
            let places: Vec<Triple> = moves
                .map(|(&place, (&line, &arc))| place + line * straight + arc * bent)
                .collect();
            let target = self.target + line.raise * straight + arc.raise * bent;
            let limits = limits(scene, &places, target);
            let mut pairs = limits.iter().zip(&self.limits);
            if pairs.all(|(new, old)| new.value > (1.0 - NEARLY) * old.value) {
                let next = Self {
                    places,
                    target,
                    limits,
                    duals: Vec::new(),
                };
                if next.merit(weight) >= merit + 1e-4 * share * gain - 1e-14 {
                    let duals = self.next_duals(&changes, &next.limits, weight);
                    *self = Self { duals, ..next };
                    return true;
                }
            }
            share *= 0.5;
        }
        false
    }

    fn changes(&self, along: &Direction) -> Vec<f64> {
        self.limits
            .iter()
            .map(|limit| {
                let (own, before) = along.of(limit.relay);
                limit.change(own, before, along.raise)
            })
            .collect()
    }

    fn bends(&self, along: &Direction) -> Vec<f64> {
        self.limits
            .iter()
            .map(|limit| {
                let (own, before) = along.of(limit.relay);
                limit.bend(own, before)
            })
            .collect()
    }

    /// Returns the merit function: target plus barrier.
    fn merit(&self, weight: f64) -> f64 {
        let barrier: f64 = self.limits.iter().map(|limit| limit.value.ln()).sum();
        self.target + weight * barrier
    }

    /// Returns the Newton direction and its damping.
    fn direction(&self, scene: &Scene, weight: f64) -> Option<(f64, Direction)> {
        let dampings = std::iter::once(0.0).chain((0..30).map(|i| 1e-6 * 8_f64.powi(i)));
        dampings
            .map(|damping| (damping, self.damped_direction(scene, weight, damping, None)))
            .find_map(|(damping, found)| Some((damping, found?)))
    }

    /// Returns the Newton direction with `damping` on the diagonal, and with constraints raised by `bends`.
    fn damped_direction(
        &self,
        scene: &Scene,
        weight: f64,
        damping: f64,
        bends: Option<&[f64]>,
    ) -> Option<Direction> {
        let fresh = Block {
            own: Square::even(damping),
            ..Block::default()
        };
        let mut blocks = vec![fresh; self.places.len()];
        let (mut corner, mut corner_right) = (0.0, 1.0);
        let bends = bends
            .unwrap_or_default()
            .iter()
            .chain(std::iter::repeat(&0.0));
        for ((limit, &dual), bend) in self.limits.iter().zip(&self.duals).zip(bends) {
            let stiff = dual / limit.value;
            let push = weight / limit.value - stiff * bend;
            let leap = limit.leap.curvature() * dual;
            if let Some(block) = blocks.get_mut(limit.relay) {
                block.own = block.own + Square::outer(limit.own, limit.own) * stiff
                    - leap
                    - limit.alone.curvature() * dual;
                block.before = block.before + Square::outer(limit.own, limit.before) * stiff + leap;
                block.common = block.common + limit.own * (limit.target * stiff);
                block.right = block.right + limit.own * push;
            }
            let before = limit.relay.checked_sub(1);
            if let Some(block) = before.and_then(|i| blocks.get_mut(i)) {
                block.own = block.own + Square::outer(limit.before, limit.before) * stiff - leap;
                block.common = block.common + limit.before * (limit.target * stiff);
                block.right = block.right + limit.before * push;
            }
            corner += limit.target * limit.target * stiff;
            corner_right += limit.target * push;
        }
        let mut free_before = Triple::default();
        for (block, room) in blocks.iter_mut().zip(&scene.rooms) {
            *block = block.held(room.free(), free_before);
            free_before = room.free();
        }
        let (steps, raise) = solve(&blocks, corner, corner_right)?;
        Some(Direction { steps, raise })
    }

    /// Returns the multipliers after a Newton step, kept > 0 and near `weight` / value.
    fn next_duals(&self, changes: &[f64], limits: &[Limit], weight: f64) -> Vec<f64> {
        let old = self.limits.iter().zip(&self.duals).zip(changes);
        let steps: Vec<f64> = old
            .map(|((limit, dual), change)| (weight - dual * change) / limit.value - dual)
            .collect();
        let room = self.duals.iter().zip(&steps);
        let share = room
            .filter(|&(_, &step)| step < 0.0)
            .map(|(dual, step)| -NEARLY * dual / step)
            .fold(1.0, f64::min);
        let moved = self.duals.iter().zip(&steps);
        moved
            .zip(limits)
            .map(|((dual, step), limit)| {
                let middle = weight / limit.value;
                (dual + share * step).clamp(1e-8 * middle, 1e8 * middle)
            })
            .collect()
    }
}

fn add(slopes: &mut [Triple], relay: usize, slope: Triple) {
    if let Some(sum) = slopes.get_mut(relay) {
        *sum = *sum + slope;
    }
}
