//! Room of each relay: an interval of x. If all relays stay in their rooms, no hop becomes less clear.
//!
//! A hop between two rooms is checked for all positions in them at once. The line of sight above a point of the ground
//! is lowest with both antennas at an end of their rooms, because it is monotone in either position. The earth's
//! curvature and the Fresnel zone are largest for the longest hop.

use uav_relay::Placement;

use crate::diffraction::EARTH_M;
use crate::profile::{FREE, Ground, State, steps_of};
use crate::report::TerrainReport;

/// Limits on the positions of relays, m.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Largest error of a relay's position, the same in every direction.
    pub position_error_m: f64,
    /// Least and greatest height of a relay above the ground.
    pub above_ground_m: [f64; 2],
    /// Least distance along x between the rooms (intervals of x) of two neighbouring relays.
    pub apart_m: f64,
    /// Wavelength of the carrier.
    pub wavelength_m: f64,
}

/// Interval of x in which a node of the chain may be, m, and the node's altitude above the datum, m.
///
/// The node is Tx, a relay or Rx. The datum is the straight line from the ground at Tx to the ground at Rx.
#[derive(Clone, Copy, Debug)]
struct Stretch {
    x_m: [f64; 2],
    h_m: f64,
}

/// Highest and lowest ground along the line Tx-Rx: points of x, m, and height above the datum, m.
///
/// Between two adjacent points of `highest` no ground is higher than the higher one of them. Between two adjacent points
/// of `lowest` no ground is lower than the lower one.
struct Ridge {
    /// Largest distance along x between two adjacent points.
    step_m: f64,
    /// Highest ground within the position error, plus the assumed error of the heights.
    highest: Vec<[f64; 2]>,
    /// Lowest ground within `off_m` to the left and right of the line Tx-Rx.
    lowest: Vec<[f64; 2]>,
}

impl Ridge {
    /// Samples the ground, and returns the altitudes of Tx and Rx above the datum, m.
    ///
    /// Relays are at most `off_m` to the left or right of the line Tx-Rx, with a position error of at most `error_m`.
    fn new(ground: &Ground<'_>, [off_m, error_m]: [f64; 2]) -> Result<(Self, [f64; 2]), String> {
        let [tx, rx] = ground.ends;
        let datum = |x_m: f64| Ok::<_, String>(f64::from(ground.point(x_m, 0.0)?.amsl_mm) / 1e3);
        let length = rx.x_m;
        let (step_m, steps) = steps(length, ground.step_m());
        // In a cell, the highest and lowest points of a strip are at its edges or at nodes of the elevation model.
        let strip = |wide_m: f64, higher: fn(f64, f64) -> f64| {
            let mut points = Vec::new();
            for y_m in [-wide_m, wide_m] {
                points.extend(ground.line([[0.0, y_m], [length, y_m]])?);
            }
            if wide_m > 0.0 {
                let nodes = ground.nodes([[0.0, -wide_m], [length, wide_m]], |_| true)?;
                points.extend(nodes.into_iter().map(|[x, _, height]| [x, height]));
                for step in 0..=steps {
                    let x_m = f64::from(step) * step_m;
                    let across = ground.line([[x_m, -wide_m], [x_m, wide_m]])?;
                    let height = across.into_iter().map(|[_, height]| height).reduce(higher);
                    points.extend(height.map(|height| [x_m, height]));
                }
            }
            for [x_m, height] in &mut points {
                *x_m = x_m.clamp(0.0, length);
                *height -= datum(*x_m)?;
            }
            points.sort_by(|one, other| one[0].total_cmp(&other[0]));
            Ok::<_, String>(points)
        };
        let mut highest = strip(off_m + error_m, f64::max)?;
        for [x_m, height] in &mut highest {
            *height += ground.raise_m(*x_m);
        }
        Ok((
            Self {
                step_m,
                highest,
                lowest: strip(off_m, f64::min)?,
            },
            [tx.amsl_m - datum(0.0)?, rx.amsl_m - datum(length)?],
        ))
    }

    /// Returns those of `points` whose x is from `from_m` to `to_m`.
    fn between(points: &[[f64; 2]], [from_m, to_m]: [f64; 2]) -> impl Iterator<Item = [f64; 2]> {
        let first = points.partition_point(|[x_m, _]| *x_m < from_m);
        let points = points.iter().skip(first).copied();
        points.take_while(move |[x_m, _]| *x_m <= to_m)
    }

    /// Returns true if every hop from a position in `from` to a position in `to` is clear.
    ///
    /// A hop is clear if no ground is in the inner part of its Fresnel zone; `share` is that part's fraction of the
    /// radius.
    fn is_free(&self, [from, to]: [Stretch; 2], share: f64, wavelength_m: f64) -> bool {
        let ([a, b], [c, d]) = (from.x_m, to.x_m);
        Self::between(&self.highest, [a, d]).all(|[x, height]| {
            let (before, after) = (x - a, d - x);
            let bulge = before * after / (2.0 * EARTH_M);
            let zone = (wavelength_m * before * after / (d - a)).max(0.0).sqrt();
            let corners = [a, b.min(x)].map(|x1| {
                [c.max(x), d].map(|x2| {
                    let part = if x2 > x1 { (x - x1) / (x2 - x1) } else { 0.0 };
                    from.h_m + part * (to.h_m - from.h_m)
                })
            });
            let sight = corners.concat().into_iter().fold(f64::INFINITY, f64::min);
            sight - bulge - share * zone > height
        })
    }
}

fn steps(length_m: f64, step_m: f64) -> (f64, u32) {
    let (step, steps) = steps_of(length_m, step_m);
    (step, steps.max(1))
}

/// Returns each relay's room: the interval of x, m, in which its hops stay as clear as in `report`.
///
/// The hops stay clear while all relays are in their rooms, up to the position error. A room also keeps the relay
/// within its limits of height above the ground. `None` for a relay without a room around its position.
///
/// # Errors
/// A text that names the position: the elevation files do not cover it, or have no height there.
pub fn rooms(
    ground: &Ground<'_>,
    places: &[Placement],
    report: &TerrainReport,
    limits: Limits,
) -> Result<Vec<Option<[f64; 2]>>, String> {
    let error = limits.position_error_m;
    let aside = places.iter().map(|place| f64::from(place.y_m).abs());
    let (ridge, ends) = Ridge::new(ground, [aside.fold(0.0, f64::max), error])?;
    let end_m = ground.ends[1].x_m;
    let relay = |place: &Placement| {
        let x_m = f64::from(place.x_m);
        Stretch {
            x_m: [(x_m - error).max(0.0), (x_m + error).min(end_m)],
            h_m: f64::from(place.altitude_m) - error,
        }
    };
    let at = |x_m: f64, h_m: f64| Stretch { x_m: [x_m; 2], h_m };
    let relays: Vec<Stretch> = places.iter().map(relay).collect();
    let mut nodes = [
        &[at(0.0, ends[0])],
        relays.as_slice(),
        &[at(end_m, ends[1])],
    ]
    .concat();
    let share = |hop: usize| match report.hops.get(hop).map(|hop| hop.state) {
        Some(State::Clear) => FREE,
        _ => 0.0,
    };
    let holds = |nodes: &[Stretch], hop: usize| {
        let ends = nodes.get(hop).zip(nodes.get(hop + 1));
        ends.is_some_and(|(from, to)| ridge.is_free([*from, *to], share(hop), limits.wavelength_m))
    };
    let [least, most] = limits.above_ground_m;
    // The least height is checked over all ground within the position error, the greatest height only straight below
    // the relay.
    let is_in_band = |node: &Stretch, strip: [f64; 2], inner: [f64; 2]| {
        let h = node.h_m + error;
        let mut highest = Ridge::between(&ridge.highest, strip);
        let mut lowest = Ridge::between(&ridge.lowest, inner);
        highest.all(|[_, ground]| h - ground >= least - 0.01)
            && lowest.all(|[_, ground]| h - ground <= most + 0.01)
    };
    let is_in: Vec<bool> = (0..places.len())
        .map(|relay| holds(&nodes, relay) && holds(&nodes, relay + 1))
        .collect();
    let mut grows: Vec<[bool; 2]> = is_in.iter().map(|is_in| [*is_in; 2]).collect();
    while grows.concat().contains(&true) {
        for (relay, sides) in grows.iter_mut().enumerate() {
            for (side, grows) in sides.iter_mut().enumerate().filter(|(_, grows)| **grows) {
                let now = nodes.get(relay + 1).copied();
                let edges = nodes.get(relay).zip(nodes.get(relay + 2));
                let (Some(now), Some((before, after))) = (now, edges) else {
                    continue;
                };
                let mut next = now;
                // One point beyond the edge is included, so that the ground at the edge is between two points.
                let (strip, inward_m) = if side == 0 {
                    next.x_m[0] -= ridge.step_m;
                    ([next.x_m[0] - ridge.step_m, now.x_m[0]], error)
                } else {
                    next.x_m[1] += ridge.step_m;
                    ([now.x_m[1], next.x_m[1] + ridge.step_m], -error)
                };
                let inner = strip.map(|x_m| x_m + inward_m);
                let is_apart = next.x_m[0] >= before.x_m[1] + limits.apart_m
                    && next.x_m[1] <= after.x_m[0] - limits.apart_m;
                let set = |nodes: &mut Vec<Stretch>, to: Stretch| {
                    if let Some(node) = nodes.get_mut(relay + 1) {
                        *node = to;
                    }
                };
                set(&mut nodes, next);
                *grows = is_apart
                    && is_in_band(&next, strip, inner)
                    && holds(&nodes, relay)
                    && holds(&nodes, relay + 1);
                if !*grows {
                    set(&mut nodes, now);
                }
            }
        }
    }
    let rooms = nodes.iter().skip(1).zip(is_in);
    // At each end, the room is smaller than the interval by the position error.
    Ok(rooms
        .map(|(node, is_in)| {
            let [from, to] = [node.x_m[0] + error, node.x_m[1] - error];
            // The interval ends at Tx or Rx, so that a relay near them may have no room.
            (is_in && from <= to).then_some([from, to])
        })
        .collect())
}
