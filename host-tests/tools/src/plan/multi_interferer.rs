//! Plans against several interferers.
//!
//! A hypothetical interferer replaces them, so that relays can find their positions by themselves. If these positions
//! lose more than 1 % against the true sum of the interferers, the best positions for that sum are used. For both
//! directions these are found by a shortest path, with free altitudes also by local search. For relays with free altitudes and fitted time slots, the data rate
//! decides instead of the SIR.

use uav_relay::Placement;

use super::bound::{Targets, excludes};
use super::path::{Table, Times};
use super::{
    Fitted, LOSS, NoPlan, Number, Plan, PlanRequest, ProfiledMission, altitude, fewest_of,
    fitted_radio, merit, source,
};
use crate::multi_interferer::{best_common_altitude, optimum, polish};
use uav_relay_scenario::hypothetical::Hypothetical;
use uav_relay_scenario::link::{Access, Link, Radio, RateModel};
use uav_relay_scenario::mission::{self, Refusal};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Interference, Scenario, Source};

/// Number of start chains that local search improves: those with the best SIRs or data rates.
const POLISHED: usize = 2;

/// Largest number of real interferers whose best chains (for this interferer alone) are start chains.
const ALONE: usize = 4;

pub(super) fn plan(scenario: &Scenario, ask: &PlanRequest) -> Result<Plan, NoPlan> {
    let hypothetical = mission::hypothetical(scenario).ok_or(Refusal::NoHypothetical)?;
    let planner = Planner {
        scenario,
        ask,
        hypothetical,
        radio: fitted_radio(scenario, ask.free_altitude),
    };
    match ask.number {
        Number::Of(relays) => planner.candidates(relays)?.chosen(&planner, None),
        Number::Meeting(target) if ask.free_altitude => altitude::fewest_of(
            scenario,
            target,
            |level| {
                let ask = &PlanRequest {
                    free_altitude: false,
                    ..*ask
                };
                let scenario = level;
                Planner {
                    scenario,
                    ask,
                    hypothetical,
                    radio: None,
                }
                .fewest(target)
            },
            |relays| planner.candidates(relays)?.chosen(&planner, Some(target)),
        ),
        Number::Meeting(target) => planner.fewest(target),
    }
}

/// Returns the scenario with the hypothetical interferer in place of all real interferers.
pub(super) fn with_one(scenario: &Scenario, one: &Hypothetical) -> Scenario {
    let mut source = one.source();
    // Power limit of a mission. Only the fit of interferers near this limit exceeds it.
    source.power_w = source.power_w.min(1e9);
    Scenario {
        interference: Interference::Sources(vec![source]),
        ..scenario.clone()
    }
}

struct Planner<'a> {
    scenario: &'a Scenario,
    ask: &'a PlanRequest,
    hypothetical: Hypothetical,
    /// Data link whose rate decides which positions are better; `None` if the SIR decides.
    radio: Option<Radio>,
}

/// Two candidate chains with the same number of relays.
///
/// The first is the best chain for the hypothetical interferer, the second the best chain found against the sum of all
/// real interferers.
struct Candidates {
    scene: Scene,
    relays: u16,
    /// Chain for the hypothetical interferer, and its value ([`merit`]).
    by_one: Option<(Plan, f64)>,
    by_all: Option<Best>,
}

/// Best chain found against the sum of all interferers, with its value ([`merit`]).
struct Best {
    places: Vec<Placement>,
    value: f64,
    proven: bool,
}

impl Planner<'_> {
    fn candidates(&self, relays: u16) -> Result<Candidates, NoPlan> {
        let scene = Scene::new(self.scenario, relays)
            .ok_or_else(|| NoPlan::Wrong("there is no interferer".to_owned()))?;
        let ask = PlanRequest {
            number: Number::Of(relays),
            ..*self.ask
        };
        let by_one =
            match super::with_one_interferer(&with_one(self.scenario, &self.hypothetical), &ask) {
                Ok(plan) => {
                    let value = merit(self.radio.as_ref(), &scene, &plan.chain());
                    Some((plan, value))
                }
                Err(NoPlan::Unmet(..)) => None,
                Err(wrong) => return Err(wrong),
            };
        let start = by_one.as_ref().map(|(plan, _)| plan);
        let by_all = self.by_all(&scene, start);
        Ok(Candidates {
            scene,
            relays,
            by_one,
            by_all,
        })
    }

    /// Returns the best chain found against the sum of all interferers; `None` if there is none.
    ///
    /// If altitudes are free or differ, local search improves several start chains.
    fn by_all(&self, scene: &Scene, start: Option<&Plan>) -> Option<Best> {
        if let Some(x_m) = self.ask.x_m {
            return at(scene, x_m);
        }
        if let Some(radio) = &self.radio {
            return self.by_moves(Some(radio), scene, start.map(places).into_iter().collect());
        }
        if scene.reverse > 0.0 {
            let at_own = both_ways(scene, start, self.ask.tolerance);
            if !self.ask.free_altitude {
                return at_own;
            }
            let unproven = at_own.map(|best| Best {
                proven: false,
                ..best
            });
            let own = unproven.iter().map(|best| best.places.as_slice());
            let starts = own.map(|places| places.iter().map(|&at| at.into()).collect());
            let starts: Vec<Vec<Place>> = starts.chain(start.map(places)).collect();
            let free = self.by_moves(None, scene, starts);
            let all = unproven.into_iter().chain(free);
            return all.max_by(|a, b| a.value.total_cmp(&b.value));
        }
        if !self.ask.free_altitude
            && let Some(chain) = optimum(scene)
        {
            let proven = !chain.separation_binds();
            return Some(Best::new(None, scene, &chain.places, proven));
        }
        let mut scene = scene.clone();
        let mut starts = Vec::new();
        if self.ask.free_altitude {
            let common = best_common_altitude(&scene).map(|chain| chain.places);
            starts.extend(common.map(|chain| chain.into_iter().map(Place::from).collect()));
            starts.extend(self.of_variants(&scene));
        } else {
            // Relays keep their different altitudes, and have no lateral offset.
            (scene.band.left_m, scene.band.right_m) = (0.0, 0.0);
            for relay in &mut scene.relays {
                relay.holds = true;
            }
        }
        starts.extend(start.map(places));
        let mut starts: Vec<(f64, Vec<Place>)> = starts
            .into_iter()
            .map(|start| (scene.chain_sir(&start), start))
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        starts.truncate(POLISHED);
        starts
            .into_iter()
            .filter_map(|(_, start)| polish(&scene, &start, scene.band))
            .map(|polished| Best::new(None, &scene, &polished.places, false))
            .max_by(|a, b| a.value.total_cmp(&b.value))
    }

    /// Returns the best chain of each scenario of [`Planner::variants`] that has a chain.
    fn of_variants(&self, scene: &Scene) -> Vec<Vec<Place>> {
        let best = |variant: &Scenario| {
            let relays = u16::try_from(scene.relays.len()).ok()?;
            let plan = altitude::in_flight(variant, relays, self.ask.tolerance).ok()?;
            Some(places(&plan))
        };
        self.variants().iter().filter_map(best).collect()
    }

    /// Returns the chain with the largest value ([`merit`]) found by moves from several start chains.
    ///
    /// The start chains are `starts`, and those of [`Planner::of_variants`].
    fn by_moves(
        &self,
        radio: Option<&Radio>,
        scene: &Scene,
        mut starts: Vec<Vec<Place>>,
    ) -> Option<Best> {
        starts.extend(self.of_variants(scene));
        starts.sort_by(|a, b| {
            let [a, b] = [a, b].map(|start| merit(radio, scene, start));
            b.total_cmp(&a)
        });
        starts.truncate(POLISHED);
        let improved = starts.into_iter().map(|start| moved(radio, scene, start));
        let best = improved.map(|places| Best::new(radio, scene, &places, false));
        best.max_by(|a, b| a.value.total_cmp(&b.value))
    }

    /// Returns scenarios with a single interferer. Their best chains are start chains of a search.
    ///
    /// Each scenario is that with the hypothetical interferer, with one change: the interferer is mirrored about the
    /// line Tx-Rx, or replaced by one of the first real interferers, or y is limited to the left side, the right side
    /// or 0.
    fn variants(&self) -> Vec<Scenario> {
        let one = with_one(self.scenario, &self.hypothetical);
        let mut variants = Vec::new();
        if one.lateral_min_m < one.lateral_max_m {
            let (left, right) = (one.lateral_min_m, one.lateral_max_m);
            for (lateral_min_m, lateral_max_m) in [(left, 0.0), (0.0, right), (0.0, 0.0)] {
                variants.push(Scenario {
                    lateral_min_m,
                    lateral_max_m,
                    ..one.clone()
                });
            }
            if let Interference::Sources(sources) = &one.interference {
                let mirrored = sources.iter().map(|source| Source {
                    y_m: -source.y_m,
                    ..source.clone()
                });
                variants.push(Scenario {
                    interference: Interference::Sources(mirrored.collect()),
                    ..one.clone()
                });
            }
        }
        if let Interference::Sources(sources) = &self.scenario.interference {
            variants.extend(sources.iter().take(ALONE).map(|source| Scenario {
                interference: Interference::Sources(vec![source.clone()]),
                ..one.clone()
            }));
        }
        variants
    }

    /// Returns the plan with the fewest relays that give every hop the SIR `target`.
    ///
    /// The search assumes that more relays never have a lower SIR.
    fn fewest(&self, target: f64) -> Result<Plan, NoPlan> {
        let found = fewest_of(target, |relays| self.candidates(relays), Candidates::sir)?;
        found.chosen(self, Some(target))
    }
}

impl Candidates {
    fn sir(&self) -> f64 {
        let one = self.by_one.as_ref().map_or(0.0, |(_, value)| *value);
        let all = self.by_all.as_ref().map_or(0.0, |best| best.value);
        one.max(all)
    }

    /// Returns the chain for the hypothetical interferer if it suffices, else the best chain found.
    ///
    /// If there is a `target`, the chain suffices if its SIR is at least `target`. Otherwise it suffices if its SIR is
    /// at most 1 % below that of the best chain against all interferers.
    fn chosen(self, planner: &Planner, target: Option<f64>) -> Result<Plan, NoPlan> {
        let one = self.by_one.as_ref().map(|(_, value)| *value);
        let best = self.by_all.as_ref().map_or(0.0, |best| best.value);
        let enough = target.unwrap_or(best * (1.0 - LOSS));
        let is_kept = one.is_some_and(|one| one > 0.0 && one >= enough);
        let fitted = Fitted {
            hypothetical: planner.hypothetical,
            sir: self
                .by_one
                .as_ref()
                .map(|(plan, _)| self.scene.chain_sir(&plan.chain())),
            kept: is_kept,
            loss: one.map(|one| if is_kept { 0.0 } else { 1.0 - one / best }),
            by_rate: planner.radio.is_some(),
        };
        let most = target.map(|_| self.sir());
        let is_best = self.by_all.as_ref().is_some_and(|best| best.proven);
        let is_fewest = match target {
            // With different powers fewer relays may do better, so each smaller number is excluded.
            Some(target) if self.scene.reverse > 0.0 => (1..self.relays)
                .rev()
                .all(|fewer| source::is_excluded(planner.scenario, fewer, target)),
            // With fewer relays even the best chain misses the target.
            Some(_) => is_best,
            None => false,
        };
        let plan = match (self.by_one, self.by_all) {
            (Some((plan, _)), _) if is_kept => Plan {
                how: "the hypothetical interferer",
                proven: is_fewest,
                ..plan
            },
            (_, Some(best)) if best.value > 0.0 => {
                let briefed = ProfiledMission::new(
                    &with_one(planner.scenario, &planner.hypothetical),
                    self.relays,
                    planner.ask.tolerance,
                )?;
                let proven = if target.is_some() { is_fewest } else { is_best };
                briefed.plan(
                    &best.places,
                    "the sum of the powers of all interferers",
                    proven,
                )
            }
            _ => return Err(source::nothing()),
        };
        Ok(Plan {
            most,
            fitted: Some(fitted),
            ..plan.against(&self.scene)
        })
    }
}

impl Best {
    /// Creates the chain at `places`, rounded to f32 numbers as relays use them.
    fn new(
        radio: Option<&Radio>,
        scene: &Scene,
        places: &[impl Copy + Into<Place>],
        proven: bool,
    ) -> Self {
        let places: Vec<Placement> = places
            .iter()
            .map(|&place| {
                let Place { x, y, h } = place.into();
                Placement {
                    x_m: narrow(x),
                    y_m: narrow(y),
                    altitude_m: narrow(h),
                }
            })
            .collect();
        Self {
            value: merit(radio, scene, &places),
            places,
            proven,
        }
    }
}

/// Returns the best chain found for data in both directions, with relays at their own altitudes.
///
/// The search refines two chains and returns the better one: the best chain on a grid of x, and the chain `start`.
/// `None` if every SIR is 0.
fn both_ways(scene: &Scene, start: Option<&Plan>, tolerance: f64) -> Option<Best> {
    // With so large a gap Shannon's rate is proportional to the SIR, so the best rate has the best SIR.
    let link = Link {
        access: Access::Channels,
        bandwidth_hz: None,
        model: RateModel::Shannon { gap_db: 300.0 },
    };
    let radio = Radio {
        link,
        bandwidth_hz: 1.0,
    };
    let times = Times::new(scene, &radio, scene.reverse);
    let relays = u16::try_from(scene.relays.len()).ok()?;
    let table = Table::new(&times);
    let along = |plan: &Plan| plan.chain().iter().map(|at| at.x_m.into()).collect();
    let starts: [Option<Vec<f64>>; 2] =
        [table.start(relays).map(<[f64]>::to_vec), start.map(along)];
    let refined = starts.iter().flatten().map(|start| times.refined(start));
    let (time, x) = refined.min_by(|one, other| one.0.total_cmp(&other.0))?;
    if !time.is_finite() {
        return None;
    }
    let places = x.iter().zip(&scene.relays);
    let places: Vec<(f64, f64)> = places.map(|(&x, relay)| (x, relay.altitude_m)).collect();
    let best = Best::new(None, scene, &places, false);
    let there = best.value * (1.0 + 2.0 * tolerance);
    let back = scene.reverse * there;
    let proven = excludes(scene, Targets { there, back });
    Some(Best { proven, ..best })
}

/// First and last length of the trial moves of relays in a search, as fractions of the distance Tx-Rx.
const MOVES: [f64; 2] = [1.0 / 16.0, 1e-5];
/// Relative increase of the value in a round of moves, below which the moves are halved.
const GAIN: f64 = 1e-4;
/// Rounding error allowed in the distance of two relays, as a fraction of the distance Tx-Rx.
const ROUNDING: f64 = 2e-7;

/// Factors of the levels in the smooth minimum of the hops' levels, in ln(SIR), in order of use.
const SHARPNESS: [f64; 4] = [8.0, 40.0, 200.0, 1000.0];

/// Returns the best of the chain `start` and of chains that moves of its relays lead to.
///
/// In a chain with a large SIR most hops have equal SIRs, and each move of a few relays lowers one of them. Without a
/// `radio` the moves therefore first raise smooth minima of the SIRs, each closer to the minimum than the one before.
fn moved(radio: Option<&Radio>, scene: &Scene, start: Vec<Place>) -> Vec<Place> {
    let value = |places: &[Place]| merit(radio, scene, places);
    let plain = climbed(scene, start.clone(), value);
    if radio.is_some() {
        return plain;
    }
    let mut places = start;
    for sharpness in SHARPNESS {
        places = climbed(scene, places, |places| smooth(scene, places, sharpness));
    }
    let places = climbed(scene, places, value);
    if value(&places) > value(&plain) {
        places
    } else {
        plain
    }
}

/// Returns a smooth function that is slightly below the SIR of the worst hop, linear.
fn smooth(scene: &Scene, places: &[Place], sharpness: f64) -> f64 {
    let mut sirs = scene.hop_sirs(places);
    if scene.reverse > 0.0 {
        let back = scene.hop_sirs_back(places).into_iter();
        sirs.extend(back.map(|sir| sir / scene.reverse));
    }
    let least = sirs.iter().copied().reduce(f64::min).unwrap_or(0.0);
    if !(least > 0.0) {
        return 0.0;
    }
    let sum: f64 = sirs.iter().map(|sir| (sir / least).powf(-sharpness)).sum();
    least * sum.powf(-1.0 / sharpness)
}

/// Returns the chain `start` after moves that raise its `value`.
///
/// A move shifts relay k, or relays 1 to k, or relays k to N, along one coordinate.
fn climbed(scene: &Scene, start: Vec<Place>, value: impl Fn(&[Place]) -> f64) -> Vec<Place> {
    let (d, band) = (scene.distance_m, scene.band);
    let shifted = |at: Place, holds: bool, axis: usize, by: f64| match axis {
        0 => Place {
            x: (at.x + by).clamp(0.0, d),
            ..at
        },
        1 => Place {
            y: (at.y + by).clamp(band.left_m, band.right_m),
            ..at
        },
        _ if holds => at,
        _ => Place {
            h: (at.h + by).clamp(band.least_m, band.most_m),
            ..at
        },
    };
    let least = scene.min_separation_m - ROUNDING * d;
    let is_apart = |places: &[Place]| {
        places.windows(2).all(|pair| match pair {
            [a, b] => {
                a.x <= b.x && libm::hypot(libm::hypot(b.x - a.x, b.y - a.y), b.h - a.h) >= least
            }
            _ => false,
        })
    };
    let count = start.len();
    let mut best = (value(&start), start);
    let [mut width, last] = MOVES.map(|width| width * d);
    while width > last {
        let before = best.0;
        for group in (0..count).flat_map(|at| [at..at + 1, 0..at + 1, at..count]) {
            for (axis, by) in (0..3).flat_map(|axis| [(axis, width), (axis, -width)]) {
                let mut places = best.1.clone();
                let own = places.iter_mut().zip(&scene.relays);
                for (place, relay) in own.take(group.end).skip(group.start) {
                    *place = shifted(*place, relay.holds, axis, by);
                }
                let now = value(&places);
                if now > best.0 && is_apart(&places) {
                    best = (now, places);
                }
            }
        }
        if !(best.0 > before * (1.0 + GAIN)) {
            width *= 0.5;
        }
    }
    best.1
}

fn places(plan: &Plan) -> Vec<Place> {
    plan.chain().into_iter().map(Place::from).collect()
}

/// Returns the best altitude of a single relay at `x_m`.
///
/// The permitted altitudes are scanned, and the scan is refined four times. `None` if every SIR is 0.
fn at(scene: &Scene, x_m: f64) -> Option<Best> {
    const ROWS: u16 = 200;
    let band = scene.band;
    let (mut low, mut high) = (band.least_m, band.most_m);
    let mut best = (0.0, low);
    for _ in 0..5 {
        let step = (high - low) / f64::from(ROWS);
        for row in 0..=ROWS {
            let h = (low + step * f64::from(row)).min(band.most_m);
            let sir = scene.chain_sir(&[(x_m, h)]);
            if sir > best.0 {
                best = (sir, h);
            }
        }
        (low, high) = (
            (best.1 - step).max(band.least_m),
            (best.1 + step).min(band.most_m),
        );
    }
    (best.0 > 0.0).then(|| Best::new(None, scene, &[(x_m, best.1)], false))
}
