//! Exact feasibility for relays at different altitudes: the set of all possible positions of each node.
//!
//! A set is a sorted list of closed intervals. A position is possible if it meets the target with the nearest possible
//! sender position at or before it. A nearer sender is received more strongly, and the interference does not depend on
//! the sender.
//!
//! The next set therefore has two kinds of intervals: positions inside an interval of the last set, with the sender
//! straight below or above; and positions in the gap after an interval, with the sender at the end of this interval. A
//! minimum separation shifts both kinds by the least advance along x.

use super::hop::{Hop, bisect};
use super::link::{Link, meets};

type Interval = (f64, f64);

impl Link {
    /// Returns the positions, m, of a chain that meets `target` (linear SIR).
    ///
    /// Each relay is as far toward Rx as possible. The altitudes of the relays may differ. `None` proves that no chain
    /// meets the target. The possible positions of a relay are intervals, seldom more than three. The cost is about 300
    /// SIR evaluations for each interval.
    pub fn placement(&self, target: f64) -> Option<Vec<f64>> {
        let sets = self.sets(target, 0.0)?;
        let mut limit = self.distance_m;
        let mut x = Vec::with_capacity(self.len());
        for set in sets.iter().rev() {
            limit = last_at_or_before(set, limit)?;
            x.push(limit);
        }
        x.reverse();
        Some(x)
    }

    /// Returns the best SIR (linear) of all chains that keep the minimum separation, at fixed altitudes.
    ///
    /// The relative error is at most 1e-13. `None` without relays, if no chain has an SIR above zero, or if no chain
    /// keeps the minimum separation.
    pub fn optimum_apart(&self) -> Option<f64> {
        self.largest_target(|target| self.sets(target, self.min_separation_m).is_some())
    }

    /// Returns the minimum distance along x from relay k-1 to relay `k`, m; 0 for relay 1.
    ///
    /// The two relays must be `apart_m` apart in space.
    pub(super) fn least_advance(&self, k: usize, apart_m: f64) -> f64 {
        let altitude = |k: usize| Some(self.relays.get(k.checked_sub(1)?)?.altitude_m);
        let pair = altitude(k).zip(k.checked_sub(1).and_then(altitude));
        pair.map_or(0.0, |(own, before)| {
            (apart_m * apart_m - (own - before).powi(2)).max(0.0).sqrt()
        })
    }

    /// Returns for each relay the positions at which the hops from Tx to this relay can meet `target`.
    ///
    /// Relays k-1 and k are at least `apart_m` apart. `None` if no chain meets the target at Rx.
    fn sets(&self, target: f64, apart_m: f64) -> Option<Vec<Vec<Interval>>> {
        let first = Hop::new(self, 1, 0.0)?;
        let turns = first.turns(0.0, self.distance_m);
        let mut sets = vec![where_true(0.0, &turns, self.distance_m, |x| {
            first.meets(x, target)
        })];
        for k in 2..=self.len() {
            let next = self.next_set(k, sets.last()?, target, self.least_advance(k, apart_m));
            sets.push(next);
        }
        // The SIR at Rx rises up to D, so the last position of the last set decides.
        let tail = sets.last()?.last()?.1;
        meets(self.sir_rx(tail)?, target).then_some(sets)
    }

    /// Returns the positions that relay `k` (2 to N) can have if relay k-1 is within `set`.
    ///
    /// The hop between the two relays must meet `target`. Relay `k` must be at least `advance` m beyond relay k-1 along
    /// x.
    fn next_set(&self, k: usize, set: &[Interval], target: f64, advance: f64) -> Vec<Interval> {
        let mut pieces = Vec::new();
        let gap_ends = set
            .iter()
            .skip(1)
            .map(|next| next.0)
            .chain([self.distance_m]);
        let past = |x: f64| (x + advance).min(self.distance_m);
        for (&(start, end), gap_end) in set.iter().zip(gap_ends) {
            if start + advance > self.distance_m {
                break;
            }
            // With the sender as close as possible the signal is constant. The interference is largest beside the
            // interferer.
            let (low, high) = (start + advance, past(end));
            let abreast = self.x_i.clamp(low, high);
            pieces.extend(where_true(low, &[abreast], high, |x| {
                self.sir_relay(k, x - advance, x)
                    .is_some_and(|sir| meets(sir, target))
            }));
            if end + advance <= self.distance_m
                && let Some(hop) = Hop::new(self, k, end)
            {
                let (low, high) = (end + advance, past(gap_end));
                pieces.extend(where_true(low, &hop.turns(low, high), high, |x| {
                    hop.meets(x, target)
                }));
            }
        }
        merge(&pieces)
    }
}

/// Returns the parts of the interval `low` to `high` in which `holds` returns true.
///
/// `turns` are positions in ascending order, which divide the interval. In each part of the divided interval, `holds`
/// must change at most once.
fn where_true(low: f64, turns: &[f64], high: f64, holds: impl Fn(f64) -> bool) -> Vec<Interval> {
    let corners = || turns.iter().copied().chain([high]);
    let froms = std::iter::once(low).chain(turns.iter().copied());
    let pieces = froms
        .zip(corners())
        .map(|(a, b)| match (holds(a), holds(b)) {
            (true, true) => Some((a, b)),
            (true, false) => Some((a, bisect(a, b, &holds))),
            (false, true) => Some((bisect(b, a, &holds), b)),
            (false, false) => None,
        });
    merge(&pieces.flatten().collect::<Vec<_>>())
}

fn merge(pieces: &[Interval]) -> Vec<Interval> {
    let mut merged: Vec<Interval> = Vec::with_capacity(pieces.len());
    for &(start, end) in pieces {
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
