//! Upper bound on the SIRs of a chain on the line Tx-Rx, by interval arithmetic in f64.
//!
//! [`excludes`] proves that no positions meet a target. It shares only the path losses with the search for positions.
//! The range of each relay is divided into cells. A hop between two cells is dropped if it misses the target in either
//! direction, even at their smallest distance and with the smallest interference in the receiver's cell. A cell is
//! dropped if no chain of remaining hops from Tx to Rx uses it. The other cells are divided further. If a relay has no
//! cell left, the target is excluded. The order of the relays and their minimum separation are ignored, so the bound
//! also holds without them.
//!
//! ```text
//! F <= P(sender) g(d) / (I(cell of the receiver) + N),    B <= P(receiver) g(d) / (I(cell of the sender) + N)
//! ```
//!
//! Work: few cells remain if every hop limits the SIR of the chain. If the position of a relay hardly matters, many
//! remain, and the search ends without a proof.

use std::ops::Range;

use uav_relay_scenario::scene::{Relay, Scene};

/// Number of equal cells (intervals of x from Tx to Rx) in which a relay may be when the search begins.
const FIRST: usize = 256;

/// Number of equal parts into which a cell (interval of x) is divided.
const PARTS: usize = 4;

/// Largest number of cells (intervals of x), summed over the relays. With more, the search ends without a proof.
const MOST_CELLS: usize = 60_000;

/// Largest number of rounds. Each round divides every remaining cell (interval of x).
///
/// The smallest cells are some 1e-8 of the distance from Tx to Rx.
const MOST_LEVELS: usize = 10;

/// Largest number of relays for which [`excludes`] tries a proof.
const MOST_RELAYS: usize = 200;

/// Allowance for rounding errors, as a fraction of a squared length.
const ROUNDING: f64 = 1e-9;

/// Target SIRs of every hop, linear: for data toward Rx, and for data toward Tx.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Targets {
    /// Target SIR of each hop for data toward Rx, linear, above 0.
    pub there: f64,
    /// Target SIR of each hop for data toward Tx, linear; 0 if there are no such data.
    pub back: f64,
}

/// Returns true if it is proven that no positions on the line Tx-Rx meet `targets`.
///
/// The altitudes of the relays are fixed. False only means that there is no proof.
pub fn excludes(scene: &Scene, targets: Targets) -> bool {
    let relays = scene.relays.len();
    if relays == 0 || relays > MOST_RELAYS || !(targets.there > 0.0 && targets.there.is_finite()) {
        return false;
    }
    let bound = Bound { scene, targets };
    let width = scene.distance_m / FIRST as f64;
    let even = (0..FIRST).map(|cell| width * cell as f64..width * (cell + 1) as f64);
    let even: Vec<Range<f64>> = even.collect();
    let mut cells = vec![even; relays];
    for _ in 0..MOST_LEVELS {
        bound.drop_cells(&mut cells);
        if cells.iter().any(Vec::is_empty) {
            return true;
        }
        if cells.iter().map(Vec::len).sum::<usize>() * PARTS > MOST_CELLS {
            return false;
        }
        for cells in &mut cells {
            *cells = cells.iter().flat_map(divided).collect();
        }
    }
    false
}

fn divided(cell: &Range<f64>) -> impl Iterator<Item = Range<f64>> + use<> {
    let (start, end) = (cell.start, cell.end);
    let edge = move |part: usize| start + (end - start) * part as f64 / PARTS as f64;
    (0..PARTS).map(move |part| {
        edge(part)..if part + 1 == PARTS {
            end
        } else {
            edge(part + 1)
        }
    })
}

struct Bound<'a> {
    scene: &'a Scene,
    targets: Targets,
}

/// Node of the chain with the cells (intervals of x) that it may be in, ascending.
///
/// `hears_squared` has a value for each cell: the largest squared distance along x, m^2, from which the node in this
/// cell can receive at the target SIR.
struct Node<'a> {
    cells: &'a [Range<f64>],
    hears_squared: Vec<f64>,
}

impl Bound<'_> {
    /// Drops the cells (intervals of x) that no chain of possible hops from Tx to Rx uses.
    fn drop_cells(&self, cells: &mut [Vec<Range<f64>>]) {
        let distance_m = self.scene.distance_m;
        let ends = [vec![0.0..0.0], vec![distance_m..distance_m]];
        let [tx, rx] = &ends;
        let relays = cells.len();
        // Hops are checked from Tx to Rx, and then from Rx to Tx.
        for at in 0..relays {
            let (before, rest) = cells.split_at_mut(at);
            let Some(here) = rest.first_mut() else { return };
            let kept = self.reached(at + 1, before.last().unwrap_or(tx), here, true);
            retain(here, &kept);
        }
        for at in (0..relays).rev() {
            let (rest, after) = cells.split_at_mut(at + 1);
            let Some(here) = rest.last_mut() else { return };
            let kept = self.reached(at + 2, here, after.first().unwrap_or(rx), false);
            retain(here, &kept);
        }
    }

    /// Returns a flag for each cell of one node of `hop`: true if a cell of the other node allows the hop.
    ///
    /// With `of_receiver` the flags are for the receiver's cells, otherwise for the sender's cells. The sender is the
    /// node nearer to Tx.
    fn reached(
        &self,
        hop: usize,
        senders: &[Range<f64>],
        receivers: &[Range<f64>],
        of_receiver: bool,
    ) -> Vec<bool> {
        let [sender_w, receiver_w] = [hop - 1, hop].map(|node| self.power_w(node));
        let [low, high] = [hop - 1, hop].map(|node| self.altitude_m(node));
        let last = self.scene.relays.len() + 1;
        let factor = if hop == 1 || hop == last {
            self.scene.eta
        } else {
            self.scene.mu_los
        };
        let climb_squared = (high - low) * (high - low);
        let node = |node: usize, cells, power_w: f64, target: f64| {
            let hears = |cell: &Range<f64>| {
                let needed_w = target * (self.least_w(node, cell) + self.scene.noise_w);
                let squared = power_w / (factor * needed_w);
                (squared * (1.0 + ROUNDING)) - climb_squared * (1.0 - ROUNDING)
            };
            let hears_squared = <[Range<f64>]>::iter(cells).map(hears).collect();
            Node {
                cells,
                hears_squared,
            }
        };
        let there = node(hop, receivers, sender_w, self.targets.there);
        let back = node(hop - 1, senders, receiver_w, self.targets.back);
        if of_receiver {
            possible(&there, &back)
        } else {
            possible(&back, &there)
        }
    }

    /// Returns a lower bound on the interference power that `node` receives in `cell`, W.
    ///
    /// For each interferer, the node is taken at the edge of the cell with the larger distance from the interferer.
    fn least_w(&self, node: usize, cell: &Range<f64>) -> f64 {
        let altitude_m = self.altitude_m(node);
        let factor = match self.relay(node) {
            Some(_) => self.scene.eta,
            None => self.scene.mu_nlos,
        };
        let each = self.scene.sources.iter().map(|source| {
            let ends = [cell.start, cell.end].map(|x_m| (x_m - source.x_m).abs());
            let along = ends[0].max(ends[1]);
            let squared = along * along + source.y_m * source.y_m + altitude_m * altitude_m;
            source.power_w / (factor * squared)
        });
        each.sum()
    }

    fn relay(&self, node: usize) -> Option<&Relay> {
        self.scene.relays.get(node.checked_sub(1)?)
    }

    fn power_w(&self, node: usize) -> f64 {
        let end = if node == 0 {
            self.scene.tx_w
        } else {
            self.scene.rx_w
        };
        self.relay(node).map_or(end, |relay| relay.power_w)
    }

    fn altitude_m(&self, node: usize) -> f64 {
        self.relay(node).map_or(0.0, |relay| relay.altitude_m)
    }
}

fn retain(cells: &mut Vec<Range<f64>>, kept: &[bool]) {
    let mut kept = kept.iter();
    cells.retain(|_| kept.next() == Some(&true));
}

/// Returns a flag for each cell of `here`: true if a hop to some cell of `other` meets the target SIRs.
///
/// The hop must be short enough for the receivers at both of its ends.
fn possible(here: &Node<'_>, other: &Node<'_>) -> Vec<bool> {
    let pairs = here.cells.iter().zip(&here.hears_squared);
    pairs
        .map(|(cell, &own)| {
            let first = other
                .cells
                .partition_point(|there| there.start < cell.start);
            let is_near = |at: usize| {
                let (Some(there), Some(&hears)) =
                    (other.cells.get(at), other.hears_squared.get(at))
                else {
                    return (f64::INFINITY, false);
                };
                let apart = (there.start - cell.end)
                    .max(cell.start - there.end)
                    .max(0.0);
                let squared = apart * apart;
                (squared, squared <= own.min(hears))
            };
            // Outward from the nearest cells, up to the longest hop that this cell can receive.
            let mut onward = (first..other.cells.len()).map(is_near);
            let mut back = (0..first).rev().map(is_near);
            let any = |side: &mut dyn Iterator<Item = (f64, bool)>| {
                side.take_while(|(squared, _)| *squared <= own)
                    .any(|(_, is_near)| is_near)
            };
            any(&mut onward) || any(&mut back)
        })
        .collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::{Targets, excludes};
    use crate::plan::{PlanRequest, plan};
    use uav_relay_scenario::Scenario;
    use uav_relay_scenario::scene::Scene;

    /// Checks that `excludes` rejects targets just above the planner's optimal SIR, and no lower targets.
    #[test]
    fn a_target_above_the_optimum_is_excluded_and_no_other() {
        let mut scenario = Scenario {
            min_separation_m: 0.0,
            ..Scenario::default()
        };
        for (relays, reverse) in [(1, 0.0), (3, 0.0), (8, 0.0), (20, 0.0), (3, 1.0), (8, 0.3)] {
            scenario.reverse = reverse;
            let ask = PlanRequest::of(relays, false, 1e-5);
            let best = plan(&scenario, &ask).unwrap().sir();
            let scene = Scene::new(&scenario, relays).unwrap();
            let excluded = |share: f64| {
                let there = best * share;
                let back = reverse * there;
                excludes(&scene, Targets { there, back })
            };
            assert!(excluded(1.0002), "{relays} {reverse}");
            assert!(!excluded(0.9999), "{relays} {reverse}");
        }
    }
}
