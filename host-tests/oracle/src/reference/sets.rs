//! Exact feasibility for relays at different altitudes: the whole set of positions each node can reach.
//!
//! A node's set is a sorted list of closed intervals. A position can be reached if the hop from the *nearest* reachable position
//! at or before it meets the target: a nearer sender is received more strongly, and the interference at the receiver does not
//! depend on it. So the next set has two kinds of pieces: positions inside an interval of the last set (sender straight below or
//! above), and positions in the gap after an interval (sender at the interval's end).

use super::hop::{Hop, bisect};
use super::link::{Link, meets};

type Interval = (f64, f64);

impl Link {
    /// Returns positions, m, of a chain that meets `target` (linear). Each relay is as far toward Rx as possible.
    ///
    /// `None` only if there is no such chain, whatever the altitudes. Per relay and interval about 300 SIR evaluations; there are
    /// seldom more than three intervals.
    pub fn placement(&self, target: f64) -> Option<Vec<f64>> {
        let first = Hop::new(self, 1, 0.0)?;
        let turns = first.turns(0.0, self.distance_m);
        let mut sets = vec![where_true(0.0, &turns, self.distance_m, |x| {
            first.meets(x, target)
        })];
        for k in 2..=self.len() {
            let next = self.next_set(k, sets.last()?, target);
            sets.push(next);
        }
        // The SIR at Rx rises all the way to D, so only the last position of the last set needs to be tried.
        let mut limit = sets.last()?.last()?.1;
        if !meets(self.sir_rx(limit)?, target) {
            return None;
        }
        let mut x = Vec::with_capacity(self.len());
        for set in sets.iter().rev() {
            limit = last_at_or_before(set, limit)?;
            x.push(limit);
        }
        x.reverse();
        Some(x)
    }

    /// Returns the set of relay `k` in 2..=N from that of relay k-1.
    fn next_set(&self, k: usize, set: &[Interval], target: f64) -> Vec<Interval> {
        let mut pieces = Vec::new();
        let gap_ends = set
            .iter()
            .skip(1)
            .map(|next| next.0)
            .chain([self.distance_m]);
        for (&(start, end), gap_end) in set.iter().zip(gap_ends) {
            // Straight above one another the signal is constant, and the interference is largest abreast of the interferer.
            let abreast = self.x_i.clamp(start, end);
            pieces.extend(where_true(start, &[abreast], end, |x| {
                self.sir_relay(k, x, x)
                    .is_some_and(|sir| meets(sir, target))
            }));
            if let Some(hop) = Hop::new(self, k, end) {
                pieces.extend(where_true(end, &hop.turns(end, gap_end), gap_end, |x| {
                    hop.meets(x, target)
                }));
            }
        }
        merge(&pieces)
    }
}

/// Returns the part of [`low`, `high`] on which `holds`. `holds` changes at most once between two of the rising `turns`.
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
