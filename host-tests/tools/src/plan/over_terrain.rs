//! Positions with the smallest loss by terrain.
//!
//! The SIR of a hop is that of free space, times the gain of diffraction (0 to 1).
//!
//! The best chain on a grid over x and altitude is found by dynamic programming. Each grid point of relay k has the
//! best chain that ends there. This chain extends the best chain to a grid point of relay k - 1 by a hop; its value is
//! the smaller of that chain's value and the SIR of the hop. On its grid the result is exact. Chains without a blocked
//! hop come first, because others are refused. The result is refined by the same method on finer grids around the
//! relays. All relays have y = 0.
//!
//! Grid points of the previous relay are tried in the order of an upper bound without diffraction, so that few losses
//! are computed. Hops below the SIR of a chain from a coarser grid are left out.

use std::collections::HashMap;
use std::fmt;

use serde::Serialize;
use uav_relay::Placement;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::area::NoFly;
use uav_relay_scenario::scene::Scene;
use uav_relay_terrain::diffraction::{LIGHT_M_S, Point, loss_db};
use uav_relay_terrain::profile::{Ground, Node, bulge_m};

use super::terrain::Elevation;
use super::{NoPlan, Plan, PlanRequest, Why, area};

/// Largest number of relays in a search over terrain.
pub const MOST_RELAYS: u16 = 50;

/// Number of altitudes of the first grid at each x.
const LEVELS: u32 = 12;

/// Largest number of terrain points along the whole line Tx-Rx during the search.
const POINTS: f64 = 800.0;

/// Limit on the terrain points along the line Tx-Rx at the end of the search: none, as in reports.
pub(super) const FINE_POINTS: f64 = f64::INFINITY;

/// Smallest distance between columns of the grid, m, at which hilltops between columns are tried, too.
const WIDE_M: f64 = 100.0;

/// Number of finer grids, each with cells half as large.
const REFINEMENTS: i32 = 5;

/// Factor on the SIR of a blocked hop. Every chain with a blocked hop then ranks behind all chains without one.
const BLOCKED: f64 = 1e-30;

/// Number of grid points on each side of a relay in a finer grid.
const AROUND: i32 = 2;

/// Comparison of the positions for the terrain with the positions that ignore the terrain.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct OverTerrain {
    /// SIR of the worst hop with terrain at the positions that ignore the terrain, dB.
    ///
    /// Absent if there are no such positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blind_sir_db: Option<f64>,
    /// SIR of the plan minus the SIR at the positions that ignore the terrain, dB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terrain_gain_db: Option<f64>,
    /// Reason why the positions that ignore the terrain cannot be flown, or do not exist.
    ///
    /// Absent if they can be flown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blind_problem: Option<String>,
}

impl fmt::Display for OverTerrain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.blind_sir_db, self.terrain_gain_db) {
            (Some(sir_db), Some(gain_db)) => {
                let side = if gain_db < 0.0 { "below" } else { "above" };
                let apart_db = gain_db.abs();
                write!(
                    f,
                    "positions that ignore the terrain: worst hop {sir_db:.3} dB with terrain; this plan is {apart_db:.3} dB {side} that"
                )?;
            }
            _ => f.write_str("positions that ignore the terrain: none")?,
        }
        match &self.blind_problem {
            Some(problem) => write!(f, "; those positions cannot be flown: {problem}"),
            None => Ok(()),
        }
    }
}

/// Position that a relay may have: x, altitude above the line Tx-Rx, and height above the sea, m.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Candidate {
    /// Distance from Tx, m.
    pub x_m: f64,
    /// Altitude above the straight line from the ground at Tx to the ground at Rx, m.
    pub h_m: f64,
    amsl_m: f64,
}

/// Search for positions of the relays of a scene above a terrain.
#[expect(missing_debug_implementations, reason = "the terrain has none")]
pub struct Search<'a> {
    scene: &'a Scene,
    ground: Ground<'a>,
    wavelength_m: f64,
    /// Ground along the line Tx-Rx: x and height, m.
    line: Vec<Point>,
    /// True if `line` is coarse: equal steps, each with the height of the highest ground near it.
    is_coarse: bool,
    /// Least and greatest height of a relay above the ground, m.
    clearance_m: [f64; 2],
    position_error_m: f64,
    /// True if the scenario's range of altitudes applies in addition to the heights above the ground.
    is_banded: bool,
    losses: HashMap<[[u64; 2]; 2], f64>,
    no_fly: Vec<NoFly>,
}

impl<'a> Search<'a> {
    /// Creates a search along the line Tx-Rx of the scenario, with at most 800 points of the terrain.
    ///
    /// If the terrain has more points, each point has the height of the highest ground near it.
    ///
    /// # Errors
    /// A text that names the position: the elevation files do not cover it, or have no height there.
    pub fn new(
        scenario: &Scenario,
        scene: &'a Scene,
        elevation: &'a Elevation,
    ) -> Result<Self, String> {
        Self::with_points(scenario, scene, elevation, POINTS)
    }

    /// Creates a search with at most `points` points of the terrain.
    pub(super) fn with_points(
        scenario: &Scenario,
        scene: &'a Scene,
        elevation: &'a Elevation,
        points: f64,
    ) -> Result<Self, String> {
        let ground = elevation.ground(scenario)?;
        let fine = ground.profile(ground.ends)?.points;
        let is_coarse = fine.len() as f64 > points;
        let line = if is_coarse {
            coarse(&fine, scene.distance_m / points)
        } else {
            fine
        };
        let most = elevation.spec.above_ground_max_m;
        Ok(Self {
            scene,
            wavelength_m: LIGHT_M_S / scenario.channel.carrier_hz,
            line,
            is_coarse,
            clearance_m: [elevation.spec.above_ground_m, most.unwrap_or(f64::INFINITY)],
            position_error_m: elevation.position_error_m(),
            is_banded: most.is_none(),
            losses: HashMap::new(),
            no_fly: scenario.no_fly.clone(),
            ground,
        })
    }

    /// Returns the error message for a search that finds no positions.
    ///
    /// It contains the permitted heights, the scenario keys that set them, and the lowest ground.
    fn nowhere(&self, scenario: &Scenario) -> String {
        let [least_m, most_m] = self.clearance_m;
        let relays = self.scene.relays.len();
        let most = if most_m.is_finite() {
            format!(" and at most {most_m} m (terrain.above_ground_max_m)")
        } else {
            let band = self.scene.band;
            format!(
                ", and at an altitude of {} to {} m (geometry.altitude_min_m and altitude_max_m)",
                band.least_m, band.most_m
            )
        };
        let heights = self.line.iter();
        let heights =
            heights.filter_map(|&[x_m, height_m]| Some([x_m, height_m - self.datum_m(x_m).ok()?]));
        let lowest = heights.min_by(|a, b| a[1].total_cmp(&b[1]));
        let [x_m, height_m] = lowest.unwrap_or_default();
        format!(
            "no positions of {relays} relays over this terrain meet all limits: at least {least_m} m (terrain.above_ground_m) above the highest ground{most}, relays at least {} m apart (geometry.min_separation_m). The lowest ground is at x = {x_m:.0} m, {height_m:.1} m above the line from Tx to Rx; this includes terrain.error_m = {}",
            scenario.min_separation_m,
            scenario.terrain.as_ref().map_or(0.0, |spec| spec.error_m)
        )
    }

    /// Returns the lowest and highest altitude of a relay at `x_m`; `None` if no altitude is permitted.
    fn band_m(&self, x_m: f64) -> Result<Option<[f64; 2]>, String> {
        let datum = self.datum_m(x_m)?;
        let node = Node {
            x_m,
            y_m: 0.0,
            amsl_m: datum,
        };
        let [least, most] = self.clearance_m;
        let mut low = self.ground.highest_m(node, self.position_error_m)? + least - datum;
        let mut high = self.ground.height_m(x_m, 0.0)? + most - datum;
        if self.is_banded {
            (low, high) = (
                low.max(self.scene.band.least_m),
                high.min(self.scene.band.most_m),
            );
        }
        // Missions have altitudes above 0.
        low = low.max(0.1);
        Ok((low <= high).then_some([low, high]))
    }

    fn datum_m(&self, x_m: f64) -> Result<f64, String> {
        Ok(f64::from(self.ground.point(x_m, 0.0)?.amsl_mm) / 1e3)
    }

    /// Returns the candidate positions of relay `relay` (from 0) at `x_m`.
    ///
    /// `levels` returns the altitudes to try, for the lowest and highest permitted altitude.
    fn column(
        &self,
        relay: usize,
        x_m: f64,
        levels: impl Fn([f64; 2]) -> Vec<f64>,
    ) -> Result<Vec<Candidate>, String> {
        let Some(band) = self.band_m(x_m)? else {
            return Ok(Vec::new());
        };
        let held = self.scene.relays.get(relay).filter(|relay| relay.holds);
        let levels = held.map_or_else(|| levels(band), |relay| vec![relay.altitude_m]);
        let datum = self.datum_m(x_m)?;
        let levels = levels
            .into_iter()
            .filter(|h_m| (band[0]..=band[1]).contains(h_m))
            .filter(|h_m| {
                self.no_fly
                    .iter()
                    .all(|area| area.depth_m([x_m, 0.0], *h_m).is_none())
            });
        Ok(levels
            .map(|h_m| Candidate {
                x_m,
                h_m,
                amsl_m: datum + h_m,
            })
            .collect())
    }

    /// Returns the candidate positions of every relay on a grid of columns (values of x) and altitudes.
    ///
    /// The grid has `columns` columns with `levels` altitudes each.
    ///
    /// # Errors
    /// A text that names the position: the elevation files do not cover it, or have no height there.
    pub fn grid(&self, columns: u32, levels: u32) -> Result<Vec<Vec<Candidate>>, String> {
        let relays = 0..self.scene.relays.len();
        let each = relays.map(|relay| {
            let x = (1..=columns)
                .map(|column| self.scene.distance_m * f64::from(column) / f64::from(columns + 1));
            let columns = x.map(|x_m| self.above(relay, x_m, levels));
            Ok(columns.collect::<Result<Vec<_>, String>>()?.concat())
        });
        each.collect()
    }

    /// Returns the candidate positions of relay `relay` (from 0) at `x_m`.
    ///
    /// They are at `levels` altitudes in equal steps over the permitted range. Candidates in a no-fly area are left
    /// out. A relay with a fixed altitude has at most one candidate.
    pub(super) fn above(
        &self,
        relay: usize,
        x_m: f64,
        levels: u32,
    ) -> Result<Vec<Candidate>, String> {
        self.column(relay, x_m, |[low, high]| {
            let share = |level: u32| f64::from(level) / f64::from((levels - 1).max(1));
            let level = |level: u32| low + (high - low) * share(level);
            (0..levels).map(level).collect()
        })
    }

    /// Returns the position at `x_m` and the altitude `h_m`, even if it is not permitted.
    pub(super) fn candidate(&self, x_m: f64, h_m: f64) -> Result<Candidate, String> {
        let amsl_m = self.datum_m(x_m)? + h_m;
        Ok(Candidate { x_m, h_m, amsl_m })
    }

    /// Returns the SIR of a chain's worst hop, linear, reduced to nearly 0 if a position is not permitted.
    ///
    /// Every chain with such a position ranks behind all chains without one.
    pub(super) fn rank(&mut self, chain: &[Candidate]) -> Result<f64, String> {
        let mut off_m: f64 = 0.0;
        for at in chain {
            let off = match self.band_m(at.x_m)? {
                Some([low, high]) => (low - at.h_m).max(at.h_m - high),
                None => 1e4,
            };
            let inside = self
                .no_fly
                .iter()
                .filter_map(|area| area.depth_m([at.x_m, 0.0], at.h_m));
            off_m += inside.fold(off.max(0.0), f64::max);
        }
        let is_allowed = off_m < 1e-3;
        let factor = if is_allowed {
            1.0
        } else {
            BLOCKED * BLOCKED / (1.0 + off_m)
        };
        Ok(factor * self.worst_sir(chain))
    }

    /// Returns candidates at the highest point of each column of the grid; none if the columns are narrow.
    ///
    /// Hilltops between two columns of the grid are then candidates, too. Columns are narrow below [`WIDE_M`].
    fn crests(&self, relay: usize, columns: u32, levels: u32) -> Result<Vec<Candidate>, String> {
        let wide_m = self.scene.distance_m / f64::from(columns + 1);
        if wide_m < WIDE_M {
            return Ok(Vec::new());
        }
        let crests = self.line.chunk_by(|[one, _], [other, _]| {
            (one / wide_m)
                .floor()
                .total_cmp(&(other / wide_m).floor())
                .is_eq()
        });
        let crests = crests.filter_map(|points| {
            let [x_m, _] = points
                .iter()
                .max_by(|one, other| one[1].total_cmp(&other[1]))?;
            (*x_m > 0.0 && *x_m < self.scene.distance_m).then(|| self.above(relay, *x_m, levels))
        });
        Ok(crests.collect::<Result<Vec<_>, String>>()?.concat())
    }

    /// Returns the candidate positions around each relay of `chain`.
    ///
    /// The steps are `step_m` along x and `climb_m` in altitude.
    fn around(
        &self,
        chain: &[Candidate],
        step_m: f64,
        climb_m: f64,
    ) -> Result<Vec<Vec<Candidate>>, String> {
        let steps = || (-AROUND..=AROUND).map(f64::from);
        let each = chain.iter().enumerate().map(|(relay, at)| {
            let mut candidates = vec![*at];
            for x_m in steps().map(|step| at.x_m + step * step_m) {
                if !(x_m > 0.0 && x_m < self.scene.distance_m) {
                    continue;
                }
                // The lowest altitude is often the best, but seldom a multiple of the step.
                let levels = |[low, high]: [f64; 2]| {
                    steps()
                        .map(|step| (at.h_m + step * climb_m).clamp(low, high))
                        .collect()
                };
                candidates.extend(self.column(relay, x_m, levels)?);
            }
            Ok(candidates)
        });
        each.collect()
    }

    /// Returns the SIR of the hop to node `node` in free space, linear.
    ///
    /// For data in both directions it is the smaller of two values: the SIR toward Rx, and the SIR toward Tx divided by
    /// `reverse`.
    fn free_sir(&self, node: usize, from: Option<Candidate>, to: Option<Candidate>) -> f64 {
        let place = |at: Candidate| (at.x_m, at.h_m);
        let relays = &self.scene.relays;
        let sender = |at: Candidate, index: usize| {
            relays
                .get(index)
                .map(|relay| self.scene.sender(place(at), relay))
        };
        let before = node.checked_sub(1);
        let (there, back) = match (from, to) {
            (None, Some(to)) => (
                Some(self.scene.sir_at(self.scene.tx(), place(to))),
                relays
                    .get(node)
                    .map(|relay| self.scene.sir_at_tx(place(to), relay)),
            ),
            (Some(from), Some(to)) => (
                before
                    .and_then(|before| sender(from, before))
                    .map(|sender| self.scene.sir_at(sender, place(to))),
                sender(to, node).map(|sender| self.scene.sir_at(sender, place(from))),
            ),
            (Some(from), None) => (
                before
                    .and_then(|before| relays.get(before))
                    .map(|relay| self.scene.sir_at_rx(place(from), relay)),
                Some(self.scene.sir_at(self.scene.rx(), place(from))),
            ),
            (None, None) => (None, None),
        };
        let there = there.unwrap_or_default();
        if self.scene.reverse > 0.0 {
            return there.min(back.unwrap_or_default() / self.scene.reverse);
        }
        there
    }

    /// Returns the diffraction factor of a hop's SIR, 0 to 1, times [`BLOCKED`] if terrain blocks the hop.
    fn gain(&mut self, from: Option<Candidate>, to: Option<Candidate>) -> f64 {
        let [tx, rx] = self.ground.ends;
        let end = |node: Node| Candidate {
            x_m: node.x_m,
            h_m: 0.0,
            amsl_m: node.amsl_m,
        };
        let (from, to) = (from.unwrap_or(end(tx)), to.unwrap_or(end(rx)));
        let key = [from, to].map(|at| [at.x_m.to_bits(), at.amsl_m.to_bits()]);
        if let Some(gain) = self.losses.get(&key) {
            return *gain;
        }
        let points = self.profile(from.x_m, to.x_m);
        let loss = loss_db(&points, [from.amsl_m, to.amsl_m], self.wavelength_m);
        let length = to.x_m - from.x_m;
        let climb = (to.amsl_m - from.amsl_m) / length.max(f64::MIN_POSITIVE);
        let is_blocked = points
            .iter()
            .any(|[along, height]| height + bulge_m(*along, length) > from.amsl_m + climb * along);
        let preference = if is_blocked { BLOCKED } else { 1.0 };
        let gain = preference * 10_f64.powf(-loss / 10.0);
        self.losses.insert(key, gain);
        gain
    }

    /// Returns the ground between two x on the line Tx-Rx.
    fn profile(&self, from_m: f64, to_m: f64) -> Vec<Point> {
        let after = |x_m: f64| self.line.partition_point(|[x, _]| *x <= x_m);
        let height = |x_m: f64| {
            let at = after(x_m);
            let known = |at: usize| self.line.get(at).or(self.line.last()).copied();
            let ends = known(at.saturating_sub(1)).zip(known(at));
            let ([from, low], [to, high]) = ends.unwrap_or_default();
            let share = (x_m - from) / (to - from).max(f64::MIN_POSITIVE);
            low + share.clamp(0.0, 1.0) * (high - low)
        };
        let mut points = vec![[0.0, height(from_m)]];
        let inner = self.line.iter().skip(after(from_m + 1e-3));
        let inner = inner.take_while(|[x_m, _]| *x_m < to_m - 1e-3);
        points.extend(inner.map(|[x_m, ground]| [x_m - from_m, *ground]));
        points.push([to_m - from_m, height(to_m)]);
        points
    }

    /// Returns the SIR of the worst hop of a chain with terrain, linear.
    ///
    /// It is nearly 0 if a hop is blocked.
    pub fn worst_sir(&mut self, chain: &[Candidate]) -> f64 {
        let places: Vec<(f64, f64)> = chain.iter().map(|at| (at.x_m, at.h_m)).collect();
        let back = self.scene.hop_sirs_back(&places);
        let mut worst = f64::INFINITY;
        for (hop, sir) in self.scene.hop_sirs(&places).into_iter().enumerate() {
            let from = hop.checked_sub(1).and_then(|at| chain.get(at));
            let gain = self.gain(from.copied(), chain.get(hop).copied());
            worst = worst.min(sir * gain);
            if let Some(back) = back.get(hop).filter(|_| self.scene.reverse > 0.0) {
                worst = worst.min(back * gain / self.scene.reverse);
            }
        }
        worst
    }

    /// Returns the best chain of the candidates, and the SIR of its worst hop, linear.
    ///
    /// `None` if no chain has at least the SIR `floor`. Hops with an SIR below `floor` are left out, so that a high
    /// `floor` saves time.
    pub fn best(
        &mut self,
        candidates: &[Vec<Candidate>],
        floor: f64,
    ) -> Option<(Vec<Candidate>, f64)> {
        // For each candidate of a relay: the SIR of the worst hop so far, and the index of the previous candidate.
        let mut layers: Vec<Vec<(f64, usize)>> = Vec::new();
        for (node, own) in candidates.iter().enumerate() {
            let before = node
                .checked_sub(1)
                .and_then(|at| Some((candidates.get(at)?, layers.get(at)?)));
            let mut layer = Vec::with_capacity(own.len());
            let before = before.map(|(places, values)| {
                places
                    .iter()
                    .copied()
                    .zip(values.iter().copied())
                    .collect::<Vec<_>>()
            });
            for to in own {
                layer.push(match &before {
                    None => (
                        self.free_sir(node, None, Some(*to)) * self.gain(None, Some(*to)),
                        0,
                    ),
                    Some(before) => self.reached(node, before, Some(*to), floor),
                });
            }
            layers.push(layer);
        }
        let last: Vec<_> = candidates
            .last()?
            .iter()
            .copied()
            .zip(layers.last()?.iter().copied())
            .collect();
        let (sir, mut at) = self.reached(candidates.len(), &last, None, floor);
        if !(sir > 0.0 && sir >= floor) {
            return None;
        }
        let mut chain = Vec::new();
        for (own, layer) in candidates.iter().zip(&layers).rev() {
            chain.push(*own.get(at)?);
            at = layer.get(at)?.1;
        }
        chain.reverse();
        Some((chain, sir))
    }

    /// Returns the SIR of the best chain from Tx to `to`, and the index of its node in `before`.
    ///
    /// `before` has the candidate positions of the node before `to`.
    fn reached(
        &mut self,
        node: usize,
        before: &[(Candidate, (f64, usize))],
        to: Option<Candidate>,
        floor: f64,
    ) -> (f64, usize) {
        let separation = self.scene.min_separation_m;
        let mut bounds: Vec<(f64, usize, Candidate, f64)> = Vec::new();
        for (at, (from, (value, _))) in before.iter().enumerate() {
            let is_apart = to.is_none_or(|to| {
                to.x_m > from.x_m && (to.x_m - from.x_m).hypot(to.h_m - from.h_m) >= separation
            });
            if is_apart && *value > 0.0 && *value >= floor {
                let free = self.free_sir(node, Some(*from), to);
                if free >= floor {
                    bounds.push((value.min(free), at, *from, free));
                }
            }
        }
        bounds.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut best = (0.0, 0);
        for (bound, at, from, free) in bounds {
            if bound <= best.0 {
                break;
            }
            let value = bound.min(free * self.gain(Some(from), to));
            if value > best.0 {
                best = (value, at);
            }
        }
        best
    }
}

/// Returns points at equal steps of about `step_m`, each with the highest of the points near it.
///
/// The first and the last point are those of `fine`, because they are below the antennas.
fn coarse(fine: &[Point], step_m: f64) -> Vec<Point> {
    let near = |[x_m, _]: &Point| (x_m / step_m).round();
    let chunks = fine.chunk_by(|one, other| near(one).total_cmp(&near(other)).is_eq());
    let highest = chunks.filter_map(|points| {
        let x_m = near(points.first()?) * step_m;
        let heights = points.iter().map(|[_, height]| *height);
        Some([x_m, heights.fold(f64::NEG_INFINITY, f64::max)])
    });
    let mut line: Vec<Point> = highest.collect();
    if let (Some(at), Some(end)) = (line.first_mut(), fine.first()) {
        *at = *end;
    }
    if let (Some(at), Some(end)) = (line.last_mut(), fine.last()) {
        *at = *end;
    }
    line
}

/// Returns the best positions over the terrain for `relays` relays with y = 0.
///
/// # Errors
/// [`NoPlan`]: too many relays, interference that is known only along the line Tx-Rx, terrain that is not covered, or
/// no permitted positions.
pub fn best(
    scenario: &Scenario,
    elevation: &Elevation,
    relays: u16,
    tolerance: f64,
) -> Result<Plan, NoPlan> {
    if relays > MOST_RELAYS {
        return Err(NoPlan::Wrong(format!(
            "--altitude terrain: needs --uavs within 1 to {MOST_RELAYS}, not {relays}"
        )));
    }
    let scene = elevation.scene(scenario, relays).map_err(NoPlan::Wrong)?;
    let scene = scene.ok_or_else(|| {
        NoPlan::Wrong("--altitude terrain: needs an [[interferer]], not a [field]".to_owned())
    })?;
    let briefed = area::profiles(scenario, relays, tolerance)?;
    let mut search = Search::new(scenario, &scene, elevation).map_err(NoPlan::Wrong)?;
    let columns = u32::from(relays * 8).max(80);
    // The positions that ignore the terrain are candidates, raised if necessary, so that the search does no worse.
    let mut seeds = vec![Vec::new(); usize::from(relays)];
    let ask = PlanRequest::of(relays, true, tolerance);
    if let Ok(blind) = super::plan(scenario, &ask) {
        for ((relay, seeds), (place, _)) in seeds.iter_mut().enumerate().zip(&blind.places) {
            let own_m = f64::from(place.altitude_m);
            let level = |[low, high]: [f64; 2]| vec![own_m.clamp(low, high)];
            *seeds = search
                .column(relay, place.x_m.into(), level)
                .map_err(NoPlan::Wrong)?;
        }
    }
    // The best chain of a coarse grid is a candidate of the fine grid, and its SIR is the floor.
    let mut found: Option<(Vec<Candidate>, f64)> = None;
    let mut highest: f64 = 0.0;
    for (columns, levels) in [(columns / 4, LEVELS / 4), (columns, LEVELS)] {
        let mut grid = search.grid(columns, levels).map_err(NoPlan::Wrong)?;
        for (relay, (own, seeds)) in grid.iter_mut().zip(&seeds).enumerate() {
            own.extend(seeds);
            own.extend(
                search
                    .crests(relay, columns, LEVELS / 4)
                    .map_err(NoPlan::Wrong)?,
            );
            own.extend(found.as_ref().and_then(|(chain, _)| chain.get(relay)));
            highest = own.iter().fold(highest, |most, at| most.max(at.h_m));
        }
        let floor = found.as_ref().map_or(0.0, |(_, sir)| *sir);
        found = search.best(&grid, floor).or(found);
    }
    let Some((mut chain, mut sir)) = found else {
        return Err(NoPlan::Unmet(Why::Plain(search.nowhere(scenario)), None));
    };
    if search.is_coarse {
        search =
            Search::with_points(scenario, &scene, elevation, FINE_POINTS).map_err(NoPlan::Wrong)?;
        sir = search.worst_sir(&chain);
    }
    let step_m = scene.distance_m / f64::from(columns + 1);
    let climb_m = highest / f64::from(LEVELS - 1);
    for halving in 1..=REFINEMENTS {
        let finer = 0.5_f64.powi(halving);
        let around = search
            .around(&chain, step_m * finer, climb_m * finer)
            .map_err(NoPlan::Wrong)?;
        if let Some((better, at_least)) = search.best(&around, sir) {
            (chain, sir) = (better, at_least);
        }
    }
    let places: Vec<Placement> = chain.iter().map(Candidate::placement).collect();
    Ok(briefed
        .plan(&places, "a search over the terrain", false)
        .against(&scene))
}

impl Candidate {
    /// Returns the position with the f32 numbers that relays use.
    ///
    /// The altitude is rounded up, so that it stays above the ground.
    #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
    pub fn placement(&self) -> Placement {
        let altitude_m = self.h_m as f32;
        let is_lower = f64::from(altitude_m) < self.h_m;
        Placement {
            x_m: self.x_m as f32,
            y_m: 0.0,
            altitude_m: if is_lower {
                altitude_m.next_up()
            } else {
                altitude_m
            },
        }
    }
}
