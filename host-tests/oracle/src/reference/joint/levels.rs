//! The best chain for given levels (positions in the cross-section) of each relay. Exact, whatever the interferer.
//!
//! For a target, the positions that each relay can reach at each of its levels are a union of intervals (see `reference::sets`).
//! A sender at another level matters only through its nearest position, which is the least advance away or at the end of an
//! interval; either way the receiver's positions solve a quadratic inequality. The target is bisected. Unlike the rest of the
//! reference, this solves quadratics, for speed; the result is evaluated by its SIR alone.

use super::roots;
use super::scene::{Room, Scene};
use super::space::{Across, Triple};

type Interval = (f64, f64);

/// Reachable positions of one relay: each level with its sorted, disjoint intervals.
type Reach = Vec<(Across, Vec<Interval>)>;

/// Positions open to a relay.
#[derive(Debug, Clone)]
pub(super) struct Slot {
    pub(super) levels: Vec<Across>,
    pub(super) window: Interval,
}

/// Returns one level per relay: the nearest in its room to that of `places`.
pub(super) fn at_places(scene: &Scene, places: &[Across]) -> Vec<Slot> {
    let places = places
        .iter()
        .chain(std::iter::repeat(&Across { y: 0.0, h: 0.0 }));
    let rooms = scene.rooms.iter().zip(places);
    rooms
        .map(|(room, place)| Slot {
            levels: vec![room.nearest(*place, 0.0)],
            window: (0.0, 1.0),
        })
        .collect()
}

pub(super) fn in_room(room: &Room, levels: &[Across]) -> Vec<Across> {
    let mut inside: Vec<Across> = Vec::with_capacity(levels.len());
    for level in levels {
        let level = room.nearest(*level, 0.0);
        if !inside.contains(&level) {
            inside.push(level);
        }
    }
    inside
}

/// Returns the best chain, one slot per relay, to `tolerance` in ln SIR. `None` if no chain reaches `floor`, a ln SIR.
pub(super) fn best_chain(
    scene: &Scene,
    slots: &[Slot],
    floor: f64,
    tolerance: f64,
) -> Option<Vec<Triple>> {
    let mut best = chain(scene, slots, floor)?;
    let mut low = scene.worst(&best).max(floor);
    let mut high = scene.ceiling();
    let mut stride = 0.02;
    while high - low > tolerance {
        // Doubles the stride to bracket the optimum; most calls start just below it.
        let middle = low.midpoint(high).min(low + stride);
        match chain(scene, slots, middle) {
            Some(found) => {
                low = middle.max(scene.worst(&found));
                best = found;
                stride *= 2.0;
            }
            None => high = middle,
        }
    }
    Some(best)
}

/// Returns a chain that meets a target, ln SIR.
fn chain(scene: &Scene, slots: &[Slot], target: f64) -> Option<Vec<Triple>> {
    let mut reaches: Vec<Reach> = Vec::with_capacity(slots.len());
    for (slot, &constant) in slots.iter().zip(&scene.hops) {
        let ease = (constant - target).exp();
        let reach = |&level: &Across| {
            let hop = Landing {
                scene,
                ease,
                level,
                window: slot.window,
            };
            let mut pieces = Vec::new();
            match reaches.last() {
                None => hop.after_place(Triple::default(), 0.0, &mut pieces),
                Some(last) => {
                    for (from_level, set) in last {
                        hop.after_level(*from_level, set, &mut pieces);
                    }
                }
            }
            (level, merge(pieces))
        };
        let reach: Reach = slot.levels.iter().map(reach).collect();
        if reach.iter().all(|(_, set)| set.is_empty()) {
            return None;
        }
        reaches.push(reach);
    }
    trace_back(scene, &reaches, target)
}

/// Traces the chain back: the last relay nearest to Rx, then each relay nearest to its successor.
fn trace_back(scene: &Scene, reaches: &[Reach], target: f64) -> Option<Vec<Triple>> {
    let mut next = Triple::new(1.0, 0.0, 0.0);
    let mut places = Vec::with_capacity(reaches.len());
    for reach in reaches.iter().rev() {
        let is_last = places.is_empty();
        let candidates = reach.iter().filter_map(|(level, set)| {
            let advance = if is_last {
                0.0
            } else {
                least_advance(scene, next.across().apart_2(*level))
            };
            last_at_or_before(set, next.x - advance).map(|x| Triple::at(x, *level))
        });
        let distance = |place: &Triple| (next - *place).dot(next - *place);
        let place = candidates.min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        if is_last && scene.last - distance(&place).ln() < target {
            return None;
        }
        places.push(place);
        next = place;
    }
    places.reverse();
    Some(places)
}

/// Returns the least advance past the sender that keeps the separation. `across_2` is the squared cross-section distance.
pub(super) fn least_advance(scene: &Scene, across_2: f64) -> f64 {
    (scene.apart * scene.apart - across_2).max(0.0).sqrt()
}

/// Receiver at one level: l <= `ease` s / (1 + nu s). l is the squared distance from sender to relay, s that from relay to
/// interferer.
struct Landing<'a> {
    scene: &'a Scene,
    ease: f64,
    level: Across,
    window: Interval,
}

impl Landing<'_> {
    /// Adds the positions at least `advance` beyond one sender.
    fn after_place(&self, from: Triple, advance: f64, pieces: &mut Vec<Interval>) {
        let ahead = self.scene.interferer.x - from.x;
        let across_2 = self.level.apart_2(from.across());
        let rest = self.level.apart_2(self.scene.interferer.across());
        let noise = self.scene.noise;
        if noise > 0.0 {
            // l (1 + nu s) - ease s, with l = z^2 + across_2 and s = z^2 - 2 ahead z + heard.
            let heard = ahead * ahead + rest;
            let quartic = [
                across_2 * (1.0 + noise * heard) - self.ease * heard,
                2.0 * ahead * (self.ease - noise * across_2),
                1.0 + noise * (heard + across_2) - self.ease,
                -2.0 * noise * ahead,
                noise,
            ];
            let start = (from.x + advance).max(self.window.0) - from.x;
            let found = roots::not_positive(&quartic, start, self.window.1 - from.x);
            pieces.extend(
                found
                    .iter()
                    .map(|(start, end)| (from.x + start, from.x + end)),
            );
            return;
        }
        not_positive(
            1.0 - self.ease,
            self.ease * ahead,
            across_2 - self.ease * (ahead * ahead + rest),
            (
                (from.x + advance).max(self.window.0) - from.x,
                self.window.1 - from.x,
            ),
            |(start, end)| pieces.push((from.x + start, from.x + end)),
        );
    }

    /// Adds the positions reached from a whole set of one level.
    fn after_level(&self, level: Across, set: &[Interval], pieces: &mut Vec<Interval>) {
        let across_2 = self.level.apart_2(level);
        let advance = least_advance(self.scene, across_2);
        let rest = self.level.apart_2(self.scene.interferer.across());
        let x_i = self.scene.interferer.x;
        for &(start, end) in set {
            // The sender is exactly the least advance behind.
            let nearest = advance * advance + across_2;
            let ease = self.ease - self.scene.noise * nearest;
            not_positive(
                -ease,
                0.0,
                nearest - ease * rest,
                (
                    (start + advance).max(self.window.0) - x_i,
                    (end + advance).min(self.window.1) - x_i,
                ),
                |(start, end)| pieces.push((x_i + start, x_i + end)),
            );
            self.after_place(Triple::at(end, level), advance, pieces);
        }
    }
}

/// Calls `found` with the one or two intervals of `within` where a z^2 + 2 b z + c <= 0.
fn not_positive(a: f64, b: f64, c: f64, within: Interval, mut found: impl FnMut(Interval)) {
    let (low, high) = within;
    if !(low <= high) {
        return;
    }
    let discriminant = b * b - a * c;
    if discriminant < 0.0 {
        if c <= 0.0 && a <= 0.0 {
            found(within);
        }
        return;
    }
    // Computes the larger root first, for its accuracy; infinite if the inequality is linear.
    let sum = -(b + discriminant.sqrt().copysign(b));
    let (far, near) = (sum / a, if sum == 0.0 { 0.0 } else { c / sum });
    let (first, second) = (far.min(near), far.max(near));
    let mut clip = |start: f64, end: f64| {
        let (start, end) = (start.max(low), end.min(high));
        if start <= end {
            found((start, end));
        }
    };
    if a >= 0.0 {
        clip(first, second);
    } else {
        clip(f64::NEG_INFINITY, first);
        clip(second, f64::INFINITY);
    }
}

fn merge(mut pieces: Vec<Interval>) -> Vec<Interval> {
    pieces.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let mut merged: Vec<Interval> = Vec::with_capacity(4);
    for (start, end) in pieces {
        match merged.last_mut() {
            Some(last) if start <= last.1 => last.1 = last.1.max(end),
            _ => merged.push((start, end)),
        }
    }
    merged
}

fn last_at_or_before(set: &[Interval], limit: f64) -> Option<f64> {
    set.iter()
        .rev()
        .find(|piece| piece.0 <= limit)
        .map(|piece| piece.1.min(limit))
}
