//! Plans for interferers that may be anywhere in an area, and plans around no-fly areas.
//!
//! The SIR of a hop is least if each interferer is at the point of its area nearest to the hop's receiver. The chain
//! has the SIR of its worst hop, and all interferers can be nearest to the receiver of that hop. The worst case of the
//! chain's SIR is therefore the least SIR of its hops, each with the interferers nearest to its receiver
//! ([`Scene::areas`]). So the search for positions is that for a known interference at each receiver.
//!
//! | positions | method |
//! | --- | --- |
//! | one altitude, one direction | the exact optimum for the sum of the interferers |
//! | other | dynamic programming on a grid of positions, then in ever narrower windows around the relays |
//! | quantile | the same, against random draws of the interferers' positions and powers without the worst draws; this is repeated until the quantile no longer rises |
//!
//! Chains with no path between two neighbours through a no-fly area come first.

use chacha20::ChaCha8Rng;
use rand::{RngExt as _, SeedableRng as _};
use serde::Serialize;
use uav_relay::Placement;
use uav_relay_scenario::area::{NoFly, SourceArea};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Scenario, Source};
use uav_relay_sim::report::db;

use super::{NoPlan, Number, Plan, PlanRequest, ProfiledMission, fewest_of, fitted_radio, source};
use crate::multi_interferer::{best_common_altitude, optimum};

/// Largest number of relays in a search on a grid.
const MOST_SEARCHED: u16 = 50;

/// Quantile that is reported if no other quantile is requested.
pub const QUANTILE: f64 = 0.95;

/// Numbers of random draws of the interferers.
///
/// The first number is for the search for positions with the best quantile of the SIR, the second for the reported
/// quantile.
const DRAWS: [usize; 2] = [400, 4000];

/// Seed of the random draws. It is fixed, so that equal scenarios have equal plans.
const SEED: u64 = 36;

/// Largest number of rounds of the search for positions with the best quantile of the SIR.
///
/// Each round leaves out the random draws in which the chain of the previous round has the lowest SIRs.
const ROUNDS: u32 = 8;

/// Factor on the SIR of a hop if a relay crosses a no-fly area on its way to the hop's other relay.
///
/// A chain with such a hop ranks behind all chains without one.
const CROSSING: f64 = 1e-30;

/// Length that counts as 0 because of rounding, m: depth in a no-fly area, or length of a path in it.
const ROUNDING_M: f64 = 0.01;

/// Least numbers of steps of the first grid of positions, along x, y and altitude.
///
/// A coordinate that relays may not choose has no steps.
const GRID: [u32; 3] = [40, 7, 5];

/// Largest number of searches on small grids (windows) around the relays, and factor on their width.
///
/// The factor applies after a search that raises the SIR by at most 0.1 %.
const WINDOWS: (u32, f64) = (120, 0.6);

/// Largest number of restarts of the search with windows (small grids around the relays) of full width.
const RESTARTS: u32 = 5;

/// Smallest width of a window (small grid around a relay) along x, as a fraction of the distance Tx-Rx.
const NARROWEST: f64 = 1e-7;

/// Criterion for the choice of positions.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Criterion {
    /// Fraction of cases, 0.5 to 0.99, that are to have at least the maximised SIR.
    ///
    /// A case is a choice of the interferers' positions and powers within their limits. `None` to maximise the SIR of
    /// the worst case.
    pub quantile: Option<f64>,
    /// True if a relay may cross a no-fly area on its way to the position of a neighbouring relay.
    pub allow_crossing: bool,
}

/// Plans the positions that `ask` requests, for interferers in areas and with no-fly areas.
///
/// If `criterion` has a quantile, the positions maximise this quantile of the SIR, otherwise the SIR of the worst case.
/// The SIRs in the plan are always for the worst case.
pub fn plan(scenario: &Scenario, ask: &PlanRequest, criterion: Criterion) -> Result<Plan, NoPlan> {
    let wrong = |line: &str| Err(NoPlan::Wrong(line.to_owned()));
    if scenario.areas.is_empty() {
        // Without areas the plan that ignores the no-fly areas is best, if it avoids them.
        let blind = super::plan(&anywhere(scenario), ask)?;
        let is_field = matches!(scenario.interference, Interference::Field(_));
        let allow_crossing = criterion.allow_crossing;
        if is_field
            || problem(scenario, &blind.chain(), ask.free_altitude, allow_crossing).is_none()
        {
            return Ok(blind);
        }
    }
    if ask.x_m.is_some() {
        return wrong("--x-m: cannot be used with interferer.area or [[no_fly]]");
    }
    if fitted_radio(scenario, ask.free_altitude).is_some() {
        return wrong(
            "link.access = \"fitted\": cannot be used with interferer.area or [[no_fly]] and --altitude free",
        );
    }
    match (ask.number, criterion.quantile) {
        (Number::Of(relays), _) => best(scenario, ask, relays, criterion),
        (Number::Meeting(_), Some(_)) => wrong(
            "--quantile: needs --uavs N, because --quantile cannot be used in a search for the number of relays",
        ),
        (Number::Meeting(target), None) => {
            let plan = |relays| best(scenario, ask, relays, criterion);
            let plan = fewest_of(target, plan, Plan::sir)?;
            let most = Some(plan.sir());
            Ok(Plan {
                most,
                proven: false,
                ..plan
            })
        }
    }
}

/// Returns the scenario without its no-fly areas.
pub(super) fn anywhere(scenario: &Scenario) -> Scenario {
    Scenario {
        no_fly: Vec::new(),
        ..scenario.clone()
    }
}

/// Returns the scenario with the interferers in the middle of their areas, at their greatest power.
pub fn at_centre(scenario: &Scenario) -> Scenario {
    Scenario {
        areas: std::collections::BTreeMap::new(),
        ..scenario.clone()
    }
}

/// Returns a mission with the profiles (power, altitude) of the relays.
///
/// If interferers have areas, the mission has only the first interferer, in the middle of its area. The planner does
/// not use this interferer.
pub(super) fn profiles(
    scenario: &Scenario,
    relays: u16,
    tolerance: f64,
) -> Result<ProfiledMission, NoPlan> {
    let mut one = at_centre(scenario);
    if let (Interference::Sources(sources), false) =
        (&mut one.interference, scenario.areas.is_empty())
    {
        sources.truncate(1);
    }
    ProfiledMission::new(&one, relays, tolerance)
}

fn best(
    scenario: &Scenario,
    ask: &PlanRequest,
    relays: u16,
    criterion: Criterion,
) -> Result<Plan, NoPlan> {
    let Criterion {
        quantile,
        allow_crossing,
    } = criterion;
    let scene = Scene::new(scenario, relays)
        .ok_or_else(|| NoPlan::Wrong("there is no interferer".to_owned()))?;
    let briefed = profiles(scenario, relays, ask.tolerance)?;
    let exact = if ask.free_altitude || scene.reverse > 0.0 || !scenario.no_fly.is_empty() {
        None
    } else {
        optimum(&scene)
    };
    let search = Search {
        allow_crossing,
        ..Search::new(&scene, scenario, ask.free_altitude)
    };
    let (places, proven) = match &exact {
        Some(chain) => {
            let places = chain.places.iter().map(|at| Place::from(*at)).collect();
            (places, !chain.separation_binds())
        }
        None if relays > MOST_SEARCHED => {
            return Err(NoPlan::Wrong(format!(
                "--uavs {relays}: must be within 1 to {MOST_SEARCHED} with interferer.area or [[no_fly]]; more relays are possible only at one common altitude, with traffic in one direction and without [[no_fly]]"
            )));
        }
        None => {
            let mut starts: Vec<Vec<Place>> = Vec::new();
            if ask.free_altitude && !(scene.reverse > 0.0) {
                let common = best_common_altitude(&scene).map(|chain| chain.places);
                starts.extend(common.map(|places| places.into_iter().map(Place::from).collect()));
            }
            starts.extend(centre(scenario, ask, relays).map(|plan| places_of(&plan)));
            (search.best(&starts).ok_or_else(nowhere)?, false)
        }
    };
    let (places, how) = match quantile {
        Some(quantile) => {
            let starts = centre(scenario, ask, relays).map(|plan| places_of(&plan));
            let starts: Vec<_> = starts.into_iter().chain([places]).collect();
            (
                search.by_quantile(scenario, quantile, &starts),
                "the quantile of the worst hop's SIR over the positions of the interferer",
            )
        }
        None if scenario.areas.is_empty() => (places, "a search around the no-fly areas"),
        None => (places, "the worst position of the interferer"),
    };
    let places: Vec<Placement> = places
        .iter()
        .map(|at| Placement {
            x_m: narrow(at.x),
            y_m: narrow(at.y),
            altitude_m: narrow(at.h),
        })
        .collect();
    let plan = briefed
        .plan(&places, how, proven && quantile.is_none())
        .against(&scene);
    if plan.sir() > 0.0 {
        Ok(plan)
    } else {
        Err(source::nothing())
    }
}

fn nowhere() -> NoPlan {
    let why = "no positions outside the no-fly areas are far enough apart: check [[no_fly]], geometry.min_separation_m and the permitted altitudes";
    NoPlan::Unmet(super::Why::Plain(why.to_owned()), None)
}

/// Returns the plan for the interferers in the middle of their areas.
fn centre(scenario: &Scenario, ask: &PlanRequest, relays: u16) -> Option<Plan> {
    let ask = PlanRequest {
        number: Number::Of(relays),
        ..*ask
    };
    super::plan(&anywhere(&at_centre(scenario)), &ask).ok()
}

fn places_of(plan: &Plan) -> Vec<Place> {
    plan.chain().into_iter().map(Place::from).collect()
}

/// Position x, y and altitude, m.
type Point = [f64; 3];

/// Returns the straight paths of two neighbouring relays, each to the position of the other relay.
///
/// Relays fly on these paths when they close a gap after a loss. With `keeps`, as in Algorithm 1, a relay stays at its
/// altitude.
pub fn ways([from, to]: [Point; 2], keeps: [bool; 2]) -> [[Point; 2]; 2] {
    let at = |place: Point, altitude_m: f64| [place[0], place[1], altitude_m];
    [
        [from, if keeps[0] { at(to, from[2]) } else { to }],
        [if keeps[1] { at(from, to[2]) } else { from }, to],
    ]
}

/// End of the text about a path that crosses a no-fly area.
pub const ACCEPTS: &str = "; `cargo plan --allow-crossing` accepts it";

fn point(at: &Placement) -> Point {
    [at.x_m, at.y_m, at.altitude_m].map(f64::from)
}

pub(super) fn range(area: &NoFly) -> String {
    let [low, high] = [area.altitudes_m.start(), area.altitudes_m.end()];
    format!("{} ({low} to {high} m)", area.key)
}

/// Returns the reason why relays cannot be at the positions `chain`; `None` if they can.
///
/// If `is_free` is true, relays choose their altitudes in flight, except relays with an altitude in the scenario. If
/// `allow_crossing` is true, the path from a relay to a neighbouring relay's position may cross a no-fly area.
pub fn problem(
    scenario: &Scenario,
    chain: &[Placement],
    is_free: bool,
    allow_crossing: bool,
) -> Option<String> {
    let mut lines = Vec::new();
    let points: Vec<Point> = chain.iter().map(point).collect();
    for area in &scenario.no_fly {
        let range = range(area);
        lines.extend(
            (1..)
                .zip(&points)
                .filter_map(|(index, at)| inside(area, index, *at)),
        );
        let neighbours = points.iter().zip(points.iter().skip(1));
        for (index, (from, to)) in (1..).zip(neighbours).filter(|_| !allow_crossing) {
            let keeps = [index, index + 1].map(|index| keeps(scenario, index, is_free));
            let each = ways([*from, *to], keeps).map(|way| (area.crossing_m(way), way[0][2]));
            let [mut worst, other] = each;
            if other.0 > worst.0 {
                worst = other;
            }
            let (crossing_m, altitude_m) = worst;
            if crossing_m > ROUNDING_M {
                let level = keeps.contains(&true) && (from[2] - to[2]).abs() > ROUNDING_M;
                let level = level.then(|| format!(" from the altitude {altitude_m:.1} m"));
                lines.push(format!(
                    "the line from relay {index} to relay {} crosses {range} for {crossing_m:.1} m{}; a relay that closes a gap would fly through it{ACCEPTS}",
                    index + 1,
                    level.unwrap_or_default()
                ));
            }
        }
    }
    (!lines.is_empty()).then(|| lines.join("; "))
}

/// Returns true if relay `index` keeps its altitude in flight.
fn keeps(scenario: &Scenario, index: u16, is_free: bool) -> bool {
    let own = scenario.relays.get(&index);
    !is_free || own.is_some_and(|own| own.altitude_m.is_some())
}

fn inside(area: &NoFly, index: u16, [x, y, h]: Point) -> Option<String> {
    let depth_m = area.depth_m([x, y], h);
    let depth_m = depth_m.filter(|depth| *depth > ROUNDING_M)?;
    Some(format!(
        "relay {index} is {depth_m:.1} m inside {}",
        range(area)
    ))
}

/// Returns a text for each relay that flies through a no-fly area or ends in one.
///
/// The relays `indices` fly from their positions `from` to those in `to`.
pub(super) fn entered(
    no_fly: &[NoFly],
    indices: &[u16],
    [from, to]: [&[Placement]; 2],
) -> Vec<String> {
    let mut lines = Vec::new();
    for (index, (from, to)) in indices.iter().zip(from.iter().zip(to)) {
        for area in no_fly {
            let way = [from, to].map(point);
            let crossing_m = area.crossing_m(way);
            if let Some(line) = inside(area, *index, way[1]) {
                lines.push(line);
            } else if crossing_m > ROUNDING_M {
                lines.push(format!(
                    "relay {index} on its way from x = {:.0} m to {:.0} m crosses {} for {crossing_m:.1} m",
                    from.x_m,
                    to.x_m,
                    range(area)
                ));
            }
        }
    }
    lines
}

/// Possible position of a node, and the interference plus noise there, W.
#[derive(Clone, Copy)]
struct Spot {
    at: Place,
    disturbance_w: f64,
}

/// Search for the positions of relays in a scene.
struct Search<'a> {
    scene: &'a Scene,
    no_fly: &'a [NoFly],
    is_free: bool,
    allow_crossing: bool,
    /// Remaining random draws of the interferers in the search for a quantile; empty for the worst case.
    draws: Vec<Vec<Source>>,
}

impl<'a> Search<'a> {
    fn new(scene: &'a Scene, scenario: &'a Scenario, is_free: bool) -> Self {
        Self {
            scene,
            no_fly: &scenario.no_fly,
            is_free,
            allow_crossing: false,
            draws: Vec::new(),
        }
    }

    fn spot(&self, at: Place, factor: f64) -> Spot {
        let scene = self.scene;
        let of_draw = |draw: &Vec<Source>| {
            let each = draw.iter().map(|source| {
                let (dx, dy) = (at.x - source.x_m, at.y - source.y_m);
                source.power_w / (factor * (dx * dx + dy * dy + at.h * at.h))
            });
            each.sum::<f64>()
        };
        let interference_w = if !self.draws.is_empty() {
            self.draws.iter().map(of_draw).fold(0.0, f64::max)
        } else if at.h > 0.0 {
            scene.interference_w(at)
        } else {
            scene.interference_on_ground_w(at.x)
        };
        Spot {
            at,
            disturbance_w: interference_w + scene.noise_w,
        }
    }

    /// Returns Tx (`end` 0) or Rx (`end` 1).
    fn site(&self, end: usize) -> Spot {
        let x = if end == 0 { 0.0 } else { self.scene.distance_m };
        self.spot(Place { x, y: 0.0, h: 0.0 }, self.scene.mu_nlos)
    }

    /// Returns the allowed positions of relay `relay` (from 0): combinations of `x`, `y` and altitudes `h`.
    ///
    /// A relay with a fixed altitude has only this altitude.
    fn spots(&self, relay: usize, [x, y, h]: &[Vec<f64>; 3]) -> Vec<Spot> {
        let held = self.scene.relays.get(relay);
        let held = held.filter(|relay| relay.holds || !self.is_free);
        let own = held.map(|relay| vec![relay.altitude_m]);
        let h = own.as_ref().unwrap_or(h);
        let each = x.iter().flat_map(|x| y.iter().map(move |y| (*x, *y)));
        let each = each.flat_map(|(x, y)| h.iter().map(move |h| Place { x, y, h: *h }));
        let is_allowed = |at: &Place| {
            let mut areas = self.no_fly.iter();
            areas.all(|area| area.depth_m([at.x, at.y], at.h).is_none())
        };
        each.filter(is_allowed)
            .map(|at| self.spot(at, self.scene.eta))
            .collect()
    }

    /// Returns the SIR of the hop from the node before `node` to `node`, linear. Node 0 is Tx.
    ///
    /// For data in both directions it is the smaller of two values: the SIR toward Rx, and the SIR toward Tx divided by
    /// `reverse`. It is 0 if two relays are too close.
    fn hop(&self, node: usize, from: Spot, to: Spot) -> f64 {
        let scene = self.scene;
        let relays = &scene.relays;
        let behind = node.checked_sub(2).and_then(|at| relays.get(at));
        let ahead = node.checked_sub(1).and_then(|at| relays.get(at));
        let [dx, dy, dh] = [
            to.at.x - from.at.x,
            to.at.y - from.at.y,
            to.at.h - from.at.h,
        ];
        let squared = dx * dx + dy * dy + dh * dh;
        let is_inner = behind.is_some() && ahead.is_some();
        let apart = scene.min_separation_m * (1.0 - 1e-9);
        if is_inner && (dx < 0.0 || squared < apart * apart) {
            return 0.0;
        }
        let factor = if is_inner { scene.mu_los } else { scene.eta };
        let tx_w = behind.map_or(scene.tx_w, |relay| relay.power_w);
        // The SIR of relays at one position is unlimited.
        let there = (tx_w / (factor * squared) / to.disturbance_w).min(f64::MAX);
        if !(scene.reverse > 0.0) {
            return there;
        }
        let rx_w = ahead.map_or(scene.rx_w, |relay| relay.power_w);
        there.min(rx_w / (factor * squared) / from.disturbance_w / scene.reverse)
    }

    /// Returns the factor on the SIR of a hop.
    ///
    /// The factor is [`CROSSING`] if the path of one relay of the hop to the position of the other relay crosses a
    /// no-fly area. It is 1 otherwise, and if crossing is allowed.
    fn preference(&self, node: usize, from: Spot, to: Spot) -> f64 {
        let is_inner = node > 1 && node <= self.scene.relays.len() && !self.allow_crossing;
        let keeps = |relay: usize| {
            let own = self.scene.relays.get(relay);
            !self.is_free || own.is_some_and(|own| own.holds)
        };
        let keeps = [node.saturating_sub(2), node.saturating_sub(1)].map(keeps);
        let ways = ways(
            [from, to].map(|spot| [spot.at.x, spot.at.y, spot.at.h]),
            keeps,
        );
        let mut areas = self.no_fly.iter();
        let is_crossed = |area: &NoFly| ways.iter().any(|way| area.crossing_m(*way) > 0.0);
        if is_inner && areas.any(is_crossed) {
            CROSSING
        } else {
            1.0
        }
    }

    /// Returns the chain whose worst hop has the largest SIR, and this SIR.
    ///
    /// Relay k is at one of the positions `grids[k - 1]`.
    fn best_on(&self, grids: &[Vec<Spot>]) -> Option<(Vec<Spot>, f64)> {
        // For each spot of a relay: the SIR of the worst hop so far, and the index of the previous spot. The best spots
        // are first.
        let mut layers: Vec<Vec<(f64, Spot, usize)>> = Vec::new();
        let mut before = vec![(f64::INFINITY, self.site(0), 0)];
        let last = [self.site(1)];
        for (node, own) in (1..).zip(grids.iter().map(Vec::as_slice).chain([last.as_slice()])) {
            let reached = |to: &Spot| {
                let mut best = (0.0, *to, 0);
                for (at, (value, from, _)) in before.iter().enumerate() {
                    if *value <= best.0 {
                        break;
                    }
                    let mut sir = value.min(self.hop(node, *from, *to));
                    if sir > best.0 && !self.no_fly.is_empty() {
                        sir *= self.preference(node, *from, *to);
                    }
                    if sir > best.0 {
                        best = (sir, *to, at);
                    }
                }
                best
            };
            let mut layer: Vec<_> = own
                .iter()
                .map(reached)
                .filter(|(sir, ..)| *sir > 0.0)
                .collect();
            layer.sort_by(|a, b| b.0.total_cmp(&a.0));
            layers.push(std::mem::replace(&mut before, layer));
        }
        let (sir, _, mut at) = *before.first()?;
        let mut chain = Vec::new();
        for layer in layers.iter().skip(1).rev() {
            let (_, spot, previous) = layer.get(at)?;
            chain.push(*spot);
            at = *previous;
        }
        chain.reverse();
        Some((chain, sir))
    }

    /// Returns the limits of the permitted positions: least and greatest x, y and altitude, m.
    fn room(&self) -> [[f64; 2]; 3] {
        let band = self.scene.band;
        if self.is_free {
            let lateral = [band.left_m, band.right_m];
            [
                [0.0, self.scene.distance_m],
                lateral,
                [band.least_m, band.most_m],
            ]
        } else {
            [[0.0, self.scene.distance_m], [0.0; 2], [1.0; 2]]
        }
    }

    /// Returns the best chain found by searches that start from a grid and from the chains `starts`.
    fn best(&self, starts: &[Vec<Place>]) -> Option<Vec<Place>> {
        let room = self.room();
        let is_single = room.iter().skip(1).all(|[low, high]| low >= high);
        let relays = u32::try_from(self.scene.relays.len()).unwrap_or(u32::MAX);
        // With few relays the grid can be finer. The work for each hop grows with the square of the number of
        // positions.
        let finer = match relays {
            _ if is_single => [8, 1, 1],
            1 => [8, 6, 4],
            2 => [2, 2, 2],
            _ => [1; 3],
        };
        let ([along, across, up], [longer, wider, higher]) = (GRID, finer);
        let along = along.max(3 * relays) * longer;
        let (across, up) = (across * wider, up * higher);
        let mut axes: [Vec<f64>; 3] = Default::default();
        for ((axis, [low, high]), count) in axes.iter_mut().zip(room).zip([along, across, up]) {
            let steps = if low < high { count } else { 0 };
            let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(steps.max(1));
            *axis = (0..=steps).map(at).collect();
        }
        let grids: Vec<Vec<Spot>> = (0..self.scene.relays.len())
            .map(|relay| self.spots(relay, &axes))
            .collect();
        let first = self.best_on(&grids).map(|(chain, _)| chain);
        let starts = starts.iter().map(|start| self.known(start));
        let all = first.into_iter().chain(starts);
        let refined = all.filter_map(|start| self.refined(&start));
        let (mut sir, mut chain) = refined.max_by(|a, b| a.0.total_cmp(&b.0))?;
        for _ in 0..RESTARTS {
            match self.refined(&self.known(&chain)) {
                Some((better, next)) if better > sir * (1.0 + 1e-6) => {
                    (sir, chain) = (better, next);
                }
                _ => break,
            }
        }
        Some(chain)
    }

    fn known(&self, places: &[Place]) -> Vec<Spot> {
        let each = places.iter();
        each.map(|at| self.spot(*at, self.scene.eta)).collect()
    }

    /// Returns the SIR and positions of the best chain found on small grids around the relays of `start`.
    ///
    /// The small grids (windows) become narrower from search to search. `None` if they contain no allowed position.
    fn refined(&self, start: &[Spot]) -> Option<(f64, Vec<Place>)> {
        let room = self.room();
        let mut width = room.map(|[low, high]| high - low);
        for (width, parts) in width.iter_mut().zip(GRID) {
            *width /= f64::from(parts);
        }
        let mut found: Option<(f64, Vec<Spot>)> = None;
        let mut chain = start.to_vec();
        for _ in 0..WINDOWS.0 {
            let around = |(relay, spot): (usize, &Spot)| {
                let mut axes: [Vec<f64>; 3] = Default::default();
                let own = [spot.at.x, spot.at.y, spot.at.h];
                for (((axis, own), [low, high]), width) in
                    axes.iter_mut().zip(own).zip(room).zip(width)
                {
                    // The steps are not symmetric, so that a relay is not limited to a lattice.
                    let steps = [0.0, -1.0, -0.5, -0.2, 0.23, 0.55, 1.0];
                    let steps = steps.iter().take(if width > 0.0 { 7 } else { 1 });
                    *axis = steps
                        .map(|step| (own + step * width).clamp(low, high))
                        .collect();
                }
                // All combinations of seven altitudes and seven lateral positions would take too long.
                if axes.iter().all(|axis| axis.len() > 1) {
                    for axis in axes.iter_mut().skip(1) {
                        *axis = axis
                            .iter()
                            .copied()
                            .take(1)
                            .chain(axis.iter().copied().skip(2).step_by(2))
                            .collect();
                    }
                }
                self.spots(relay, &axes)
            };
            let grids: Vec<Vec<Spot>> = chain.iter().enumerate().map(around).collect();
            let before = found.as_ref().map_or(0.0, |(sir, _)| *sir);
            if let Some((better, sir)) = self.best_on(&grids)
                && sir > before
            {
                chain.clone_from(&better);
                found = Some((sir, better));
            }
            let now = found.as_ref().map_or(0.0, |(sir, _)| *sir);
            if !(now > before * 1.001) {
                width = width.map(|width| width * WINDOWS.1);
            }
            if width[0] < NARROWEST * self.scene.distance_m {
                break;
            }
        }
        found.map(|(sir, chain)| (sir, chain.iter().map(|spot| spot.at).collect()))
    }

    /// Returns the chain with the best quantile of the SIR, found by searches that start from `starts`.
    fn by_quantile(
        &self,
        scenario: &'a Scenario,
        quantile: f64,
        starts: &[Vec<Place>],
    ) -> Vec<Place> {
        let areas = Draws::new(scenario, self.scene, DRAWS[0]);
        let judge = Draws::new(scenario, self.scene, DRAWS[1]);
        let mut best: Option<(f64, Vec<Place>)> = None;
        for start in starts {
            let mut chain = start.clone();
            let mut reached = areas.quantile(&chain, quantile);
            for round in 0..ROUNDS {
                let counted = areas.most_harmless(&chain, quantile);
                let search = Self {
                    draws: counted,
                    allow_crossing: self.allow_crossing,
                    ..Self::new(self.scene, scenario, self.is_free)
                };
                let better = if round == 0 {
                    search.best(std::slice::from_ref(&chain))
                } else {
                    search
                        .refined(&search.known(&chain))
                        .map(|(_, better)| better)
                };
                let Some(better) = better else { break };
                let now = areas.quantile(&better, quantile);
                if !(now > reached * (1.0 + 1e-6)) {
                    break;
                }
                (chain, reached) = (better, now);
            }
            for chain in [chain, start.clone()] {
                let value = judge.quantile(&chain, quantile);
                if best.as_ref().is_none_or(|(other, _)| value > *other) {
                    best = Some((value, chain));
                }
            }
        }
        best.map_or_else(Vec::new, |(_, chain)| chain)
    }
}

/// Random draws of the positions and powers of all interferers.
///
/// A position is uniform over its area, and a power is uniform in decibels.
#[derive(Debug)]
pub struct Draws {
    scene: Scene,
    draws: Vec<Vec<Source>>,
}

impl Draws {
    /// Creates `number` random draws.
    pub fn new(scenario: &Scenario, scene: &Scene, number: usize) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(SEED);
        let draws = (0..number).map(|_| {
            let each = scene.sources.iter().enumerate();
            each.map(|(at, source)| {
                let area = scenario.areas.get(&at);
                area.map_or_else(|| source.clone(), |area| drawn(&mut rng, source, area))
            })
            .collect()
        });
        Self {
            draws: draws.collect(),
            scene: Scene {
                areas: std::collections::BTreeMap::new(),
                ..scene.clone()
            },
        }
    }

    /// Returns the SIR of the chain's worst hop for each draw, and the draw's index, by falling SIR.
    fn sirs(&self, chain: &[Place]) -> Vec<(f64, usize)> {
        let mut scene = self.scene.clone();
        let each = self.draws.iter().enumerate().map(|(at, draw)| {
            scene.sources.clone_from(draw);
            (scene.chain_sir(chain), at)
        });
        let mut sirs: Vec<_> = each.collect();
        sirs.sort_by(|a, b| b.0.total_cmp(&a.0));
        sirs
    }

    fn counted(&self, quantile: f64) -> usize {
        let count = (quantile * self.draws.len() as f64).ceil();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a number of draws"
        )]
        let count = count as usize;
        count.clamp(1, self.draws.len())
    }

    /// Returns the SIR, linear, that the chain has at least in the fraction `quantile` of the draws.
    pub fn quantile(&self, chain: &[impl Copy + Into<Place>], quantile: f64) -> f64 {
        let chain: Vec<Place> = chain.iter().map(|at| (*at).into()).collect();
        let sirs = self.sirs(&chain);
        sirs.get(self.counted(quantile) - 1)
            .map_or(0.0, |(sir, _)| *sir)
    }

    /// Returns the draws in which the chain has the largest SIRs; their share of all draws is `quantile`.
    fn most_harmless(&self, chain: &[Place], quantile: f64) -> Vec<Vec<Source>> {
        let sirs = self.sirs(chain).into_iter().take(self.counted(quantile));
        sirs.filter_map(|(_, at)| self.draws.get(at).cloned())
            .collect()
    }
}

/// Largest number of random points that are drawn in search of a point inside an interferer's area.
const TRIES: u32 = 100_000;

fn drawn(rng: &mut ChaCha8Rng, source: &Source, own: &SourceArea) -> Source {
    let [low, high] = own.area.bounds();
    let inside = (0..TRIES).find_map(|_| {
        let at = [
            rng.random_range(low[0]..=high[0]),
            rng.random_range(low[1]..=high[1]),
        ];
        own.area.contains(at).then_some(at)
    });
    let [x_m, y_m] = inside.unwrap_or_else(|| own.area.centre());
    let share = rng.random_range(0.0..=1.0);
    let power_w = own.least_w * (source.power_w / own.least_w).powf(share);
    Source { power_w, x_m, y_m }
}

/// SIRs of a chain against interferers in areas: the worst case, and a quantile.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct OverArea {
    /// SIR of the worst hop with the interferers at their worst positions and greatest powers, dB.
    pub worst_sir_db: f64,
    /// SIR that the worst hop has at least in the fraction `quantile` of all positions and powers, dB.
    pub quantile_sir_db: f64,
}

/// Report of a plan over the areas of the interferers.
///
/// It compares this plan with a plan for interferers in the middle of their areas.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct AreaReport {
    /// Criterion of the plan: `worst` or `quantile`.
    pub criterion: &'static str,
    /// Fraction of the positions and powers of the interferers, 0 to 1.
    pub quantile: f64,
    /// SIRs of the plan.
    #[serde(flatten)]
    pub plan: OverArea,
    /// SIRs of the plan for interferers in the middle of their areas; absent if there is no such plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub centre: Option<OverArea>,
    /// Position [x, y], m, in each interferer's area at which the SIR of the plan's worst hop is least.
    pub worst_places: Vec<[f64; 2]>,
}

impl AreaReport {
    /// Creates the report of `plan`; `None` if no interferer has an area.
    pub fn new(
        scenario: &Scenario,
        ask: &PlanRequest,
        plan: &Plan,
        quantile: Option<f64>,
    ) -> Option<Self> {
        if scenario.areas.is_empty() {
            return None;
        }
        let relays = u16::try_from(plan.places.len()).ok()?;
        let scene = Scene::new(scenario, relays)?;
        let draws = Draws::new(scenario, &scene, DRAWS[1]);
        let of = quantile.unwrap_or(QUANTILE);
        let over = |chain: &[Placement]| OverArea {
            worst_sir_db: db(scene.chain_sir(chain)),
            quantile_sir_db: db(draws.quantile(chain, of)),
        };
        let chain = plan.chain();
        let receiver = receiver(&scene, &chain);
        Some(Self {
            criterion: if quantile.is_some() {
                "quantile"
            } else {
                "worst"
            },
            quantile: of,
            plan: over(&chain),
            centre: centre(scenario, ask, relays).map(|plan| over(&plan.chain())),
            worst_places: scene
                .areas
                .values()
                .map(|area| area.nearest(receiver))
                .collect(),
        })
    }

    /// Returns the report as lines for the terminal.
    pub fn describe(&self) -> String {
        let share = 100.0 * self.quantile;
        let say = |over: OverArea| {
            format!(
                "worst hop {:.3} dB at the interferer's worst position, at least {:.3} dB for {share} % of its positions and powers",
                over.worst_sir_db, over.quantile_sir_db
            )
        };
        let places: Vec<String> = self
            .worst_places
            .iter()
            .map(|[x, y]| format!("x = {x:.1} m, y = {y:.1} m"))
            .collect();
        let centre = self.centre.map_or_else(|| "none".to_owned(), say);
        format!(
            "area of the interferer: {}\nworst position of the interferer: {}\na plan for an interferer in the middle of the area: {centre}\n",
            say(self.plan),
            places.join("; ")
        )
    }
}

/// Returns the position [x, y] of the receiver of the worst hop, m.
fn receiver(scene: &Scene, chain: &[Placement]) -> [f64; 2] {
    let mut nodes = vec![[0.0; 2]];
    nodes.extend(chain.iter().map(|at| [at.x_m, at.y_m].map(f64::from)));
    nodes.push([scene.distance_m, 0.0]);
    let there = scene.hop_sirs(chain).into_iter().zip(nodes.iter().skip(1));
    let back = scene.hop_sirs_back(chain).into_iter();
    let back = back.filter(|_| scene.reverse > 0.0);
    let back = back.map(|sir| sir / scene.reverse).zip(&nodes);
    let worst = there.chain(back).min_by(|a, b| a.0.total_cmp(&b.0));
    worst.map_or([0.0; 2], |(_, at)| *at)
}

/// Cell of the map of SIRs: a square in which the interferer may be, and the SIR of the worst hop.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Cell {
    /// Index of the interferer, from 0.
    pub source: usize,
    /// Middle of the cell, [x, y], m.
    pub at: [f64; 2],
    /// Length of the sides of the cell, m.
    pub side_m: f64,
    /// SIR of the worst hop, dB. The interferer is in the middle of the cell, at its greatest power.
    pub sir_db: f64,
    /// Standard deviation, m, of the relays' estimate of the position of an interferer in this cell.
    ///
    /// Infinite if the relays cannot locate the interferer. `None` if this deviation is not computed.
    pub error_m: Option<f64>,
}

/// Number of cells of the map along the longer side of an area.
const CELLS: f64 = 60.0;

/// Returns the SIR of the worst hop of `plan` for each position of each interferer that has an area.
///
/// All remaining interferers with an area are at their worst positions.
pub fn cells(scenario: &Scenario, plan: &Plan) -> Vec<Cell> {
    let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
    let Some(scene) = Scene::new(scenario, relays) else {
        return Vec::new();
    };
    let chain = plan.chain();
    let mut cells = Vec::new();
    for (source, area) in &scene.areas {
        let mut scene = scene.clone();
        scene.areas.remove(source);
        let [low, high] = area.bounds();
        let side_m = (high[0] - low[0]).max(high[1] - low[1]) / CELLS;
        let middles = |axis: usize| {
            let ends = [low, high].map(|end| end.get(axis).copied().unwrap_or_default());
            let middle = move |step: u32| ends[0] + side_m * (f64::from(step) + 0.5);
            (0..60_u32)
                .map(middle)
                .take_while(move |at| *at < ends[1] + 0.5 * side_m)
        };
        for y_m in middles(1) {
            for x_m in middles(0) {
                if !area.contains([x_m, y_m]) {
                    continue;
                }
                if let Some(own) = scene.sources.get_mut(*source) {
                    (own.x_m, own.y_m) = (x_m, y_m);
                }
                let sir_db = db(scene.chain_sir(&chain));
                cells.push(Cell {
                    source: *source,
                    at: [x_m, y_m],
                    side_m,
                    sir_db,
                    error_m: None,
                });
            }
        }
    }
    cells
}
