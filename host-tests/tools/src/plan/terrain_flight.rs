//! Flight of relays over terrain: search for their altitudes, and checks.
//!
//! Relays in flight know no terrain. They keep the altitude in their configuration, and choose x by Algorithm 1. The
//! search therefore changes only altitudes. By dynamic programming it finds the best altitudes for the x of the relays.
//! At these altitudes the relays choose other x, so the search is repeated. Then the altitude of one relay after the
//! other is changed. At last each relay is raised as far as that costs almost no SIR.

use std::fmt;

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::{Duration, Method, Placement};
use uav_relay_scenario::area::NoFly;
use uav_relay_scenario::number::shortest;
use uav_relay_scenario::{PlannedMethod, Scenario, mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_terrain::diffraction::LIGHT_M_S;
use uav_relay_terrain::profile::Ground;
use uav_relay_terrain::room::{Limits, rooms};

use super::area::{entered, range};
use super::flown::alone;
use super::over_terrain::{Candidate, FINE_POINTS, MOST_RELAYS, Search};
use super::terrain::Elevation;
use super::{NoPlan, Plan, ProfiledMission, source};

/// Number of altitudes that are tried for each relay.
const LEVELS: u32 = 40;

/// Largest number of searches for altitudes. Each search uses the x that the relays choose at the previous altitudes.
const ROUNDS: u32 = 6;

/// Largest and smallest change of one relay's altitude in the search, m. The search begins with the largest.
const STEPS_M: [f64; 2] = [16.0, 0.5];

/// Largest relative loss of SIR that is accepted for higher, safer altitudes: 0.01 dB.
const SLACK: f64 = 0.0023;

/// Smallest relative increase of the SIR at which the search accepts new altitudes.
const GAIN: f64 = 1e-4;

/// Explanation of "room" for the user.
pub const ROOM: &str = "room: range of x in which a relay may drift; while all relays are in their rooms, no hop becomes blocked, no clear hop becomes grazing (ground in the first Fresnel zone), and no relay is in a no-fly area; a relay whose room is none may not drift even by the position error";

/// Scenario with altitudes, the positions that relays choose in it, and the rank of these positions.
///
/// The rank is the SIR of the worst hop, linear, reduced to nearly 0 if a position is not permitted.
struct Trial {
    scenario: Scenario,
    chain: Vec<Candidate>,
    rank: f64,
}

impl Trial {
    fn new(
        scenario: &Scenario,
        search: &mut Search<'_>,
        tolerance: f64,
        altitudes_m: &[f64],
    ) -> Result<Self, NoPlan> {
        let mut scenario = scenario.clone();
        for (index, altitude_m) in (1..).zip(altitudes_m) {
            scenario.relays.entry(index).or_default().altitude_m = Some(*altitude_m);
        }
        let relays = u16::try_from(altitudes_m.len()).unwrap_or(u16::MAX);
        let flown = alone(&scenario, relays, PlannedMethod::Align, tolerance)?;
        let chain = flown.places.iter().map(|(place, _)| {
            let [x_m, h_m] = [place.x_m, place.altitude_m].map(f64::from);
            search.candidate(x_m, h_m)
        });
        let chain: Vec<Candidate> = chain.collect::<Result<_, _>>().map_err(NoPlan::Wrong)?;
        let rank = search.rank(&chain).map_err(NoPlan::Wrong)?;
        Ok(Self {
            scenario,
            chain,
            rank,
        })
    }
}

/// Returns the scenario with altitudes of the relays that give the chain a high SIR over the terrain.
///
/// The search begins with the altitudes of `plan`, a plan over the terrain.
///
/// # Errors
/// [`NoPlan`]: the relays find no positions, or the terrain is not covered.
pub fn with_altitudes(
    scenario: &Scenario,
    elevation: &Elevation,
    plan: &Plan,
    tolerance: f64,
) -> Result<Scenario, NoPlan> {
    let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
    let scene = elevation.scene(scenario, relays).map_err(NoPlan::Wrong)?;
    let scene = scene.ok_or_else(source::nothing)?;
    let search = Search::with_points(scenario, &scene, elevation, FINE_POINTS);
    let mut search = search.map_err(NoPlan::Wrong)?;
    let rounded = |chain: &[Candidate]| -> Vec<f64> {
        let places = chain.iter().map(Candidate::placement);
        places.map(|place| shortest(place.altitude_m)).collect()
    };
    let start = plan.places.iter();
    let start: Vec<f64> = start.map(|(at, _)| shortest(at.altitude_m)).collect();
    let mut best = Trial::new(scenario, &mut search, tolerance, &start)?;
    for _ in 0..ROUNDS {
        let places = best.chain.iter().enumerate();
        let columns = places.map(|(relay, at)| search.above(relay, at.x_m, LEVELS));
        let columns: Vec<_> = columns.collect::<Result<_, _>>().map_err(NoPlan::Wrong)?;
        let Some((chain, _)) = search.best(&columns, 0.0) else {
            break;
        };
        let next = Trial::new(scenario, &mut search, tolerance, &rounded(&chain))?;
        if next.rank <= best.rank * (1.0 + GAIN) {
            break;
        }
        best = next;
    }
    let mut step_m = STEPS_M[0];
    while step_m >= STEPS_M[1] {
        let mut has_gained = false;
        for relay in 0..plan.places.len() {
            if scene.relays.get(relay).is_some_and(|relay| relay.holds) {
                continue;
            }
            for step_m in [-step_m, step_m] {
                let mut chain = best.chain.clone();
                if let Some(at) = chain.get_mut(relay) {
                    *at = search
                        .candidate(at.x_m, (at.h_m + step_m).clamp(0.1, 1e4))
                        .map_err(NoPlan::Wrong)?;
                }
                let next = Trial::new(scenario, &mut search, tolerance, &rounded(&chain))?;
                if next.rank > best.rank * (1.0 + GAIN) {
                    (best, has_gained) = (next, true);
                }
            }
        }
        if !has_gained {
            step_m *= 0.5;
        }
    }
    // A relay that closes a gap flies at its own altitude. Of altitudes with almost the same SIR, the highest is
    // safest.
    let least = best.rank * (1.0 - SLACK);
    for relay in 0..plan.places.len() {
        for share in [1.0, 0.75, 0.5, 0.25] {
            let mut chain = best.chain.clone();
            let Some(at) = chain.get_mut(relay) else {
                continue;
            };
            let allowed = search.above(relay, at.x_m, 2).map_err(NoPlan::Wrong)?;
            let highest_m = allowed.last().map_or(at.h_m, |highest| highest.h_m);
            *at = search
                .candidate(at.x_m, at.h_m + share * (highest_m - at.h_m))
                .map_err(NoPlan::Wrong)?;
            let next = Trial::new(scenario, &mut search, tolerance, &rounded(&chain))?;
            if next.rank >= least {
                best = next;
                break;
            }
        }
    }
    Ok(best.scenario)
}

/// Position of a relay in flight, and its room: an interval of x.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct FlownRelay {
    /// Number of the relay; 1 is next to Tx.
    pub index: u16,
    /// Distance of its position from Tx toward Rx, m.
    pub x_m: f32,
    /// Altitude of its position above the straight line Tx-Rx, m.
    pub altitude_m: f32,
    /// Room, m: interval of x in which no hop gets worse while the neighbours are in their rooms.
    ///
    /// The room contains no no-fly area. Absent if there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub room_m: Option<[f64; 2]>,
}

/// Chain over the terrain after the loss of one relay, when the remaining relays have closed the gap.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Without {
    /// Number of the lost relay.
    pub lost: u16,
    /// SIR of the worst hop with terrain, dB; absent if the remaining relays find no positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub terrain_sir_db: Option<f64>,
    /// Problems of this chain; absent if there are none.
    ///
    /// A problem is a blocked hop, or a relay or its path that is too low or in a no-fly area.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<String>,
}

/// Simulated flight: the positions that the relays choose, and the terrain below them.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Flight {
    /// SIR of the worst hop in the flight with terrain, dB.
    pub terrain_sir_db: f64,
    /// SIR of the plan for the terrain minus the SIR of the flight, dB; absent without such a plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss_db: Option<f64>,
    /// Largest distance of a relay from its position in the plan for the terrain, m.
    ///
    /// Absent if there is no such plan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off_m: Option<f64>,
    /// Positions of the relays.
    pub relays: Vec<FlownRelay>,
    /// Blocked hops that `--allow-blocked` accepts; absent if there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blocked: Option<String>,
    /// Reasons why relays have no room (interval of x in which a relay may drift), one for each such relay.
    #[serde(skip)]
    confined: Vec<String>,
    /// Chains after the loss of each relay; empty for one relay and for more than 50.
    pub without: Vec<Without>,
    /// Reason why the relays cannot fly over this terrain; `None` if they can.
    ///
    /// A reason is a blocked hop, or a relay that is too low or too high.
    #[serde(skip)]
    pub problem: Option<String>,
}

impl Flight {
    /// Simulates the flight over the terrain.
    ///
    /// `flown` has the positions that the relays of `scenario` agree on by `method`.
    ///
    /// # Errors
    /// [`NoPlan`]: the simulated relays do not agree on positions, or the terrain is not covered.
    pub fn new(
        scenario: &Scenario,
        elevation: &Elevation,
        flown: &Plan,
        (method, tolerance): (PlannedMethod, f64),
        allow_blocked: bool,
    ) -> Result<Self, NoPlan> {
        let relays = u16::try_from(flown.places.len()).unwrap_or(u16::MAX);
        let (places, losses) = if relays <= MOST_RELAYS {
            losses(scenario, relays, (method, tolerance))?
        } else {
            (flown.chain(), Vec::new())
        };
        let flown = settled(scenario, relays, tolerance, &places)?;
        let report = elevation.report(scenario, &flown).map_err(NoPlan::Wrong)?;
        let ground = elevation.ground(scenario).map_err(NoPlan::Wrong)?;
        let limits = Limits {
            position_error_m: elevation.position_error_m(),
            above_ground_m: elevation.band_m(),
            apart_m: scenario.min_separation_m,
            wavelength_m: LIGHT_M_S / scenario.channel.carrier_hz,
        };
        let mut rooms = rooms(&ground, &places, &report, limits).map_err(NoPlan::Wrong)?;
        let error_m = limits.position_error_m;
        let mut confined = Vec::new();
        for ((index, place), room) in (1..).zip(&places).zip(&mut rooms) {
            let entered = if room.is_some() {
                cut(room, place, &scenario.no_fly, error_m)
            } else {
                Some(
                    "one of its hops gets worse, blocked or grazing, or it passes Tx or Rx,"
                        .to_owned(),
                )
            };
            confined.extend(entered.map(|why| {
                format!("relay {index} has no room: {why} within the position error of {error_m} m (companion.position_error_m)")
            }));
        }
        let without = losses_over(scenario, elevation, &ground, tolerance, (&losses, &places))?;
        Ok(Self {
            terrain_sir_db: report.terrain_sir_db,
            loss_db: None,
            off_m: None,
            blocked: report.blocked().filter(|_| allow_blocked),
            confined,
            relays: (1..)
                .zip(&places)
                .zip(rooms)
                .map(|((index, place), room_m)| FlownRelay {
                    index,
                    x_m: place.x_m,
                    altitude_m: place.altitude_m,
                    room_m,
                })
                .collect(),
            without,
            problem: elevation.problem(&report, allow_blocked),
        })
    }

    /// Adds the differences from `plan`, whose worst hop has the SIR `terrain_sir_db` with terrain.
    #[must_use]
    pub fn compared(self, plan: &Plan, terrain_sir_db: f64) -> Self {
        let apart = plan.places.iter().zip(&self.relays).map(|((from, _), to)| {
            let [x, h] = [from.x_m - to.x_m, from.altitude_m - to.altitude_m].map(f64::from);
            x.hypot(from.y_m.into()).hypot(h)
        });
        Self {
            off_m: Some(apart.fold(0.0, f64::max)),
            loss_db: Some(terrain_sir_db - self.terrain_sir_db),
            ..self
        }
    }

    /// Returns the reason why the flight was not simulated; `None` if it was.
    pub fn unknown(&self) -> Option<String> {
        (self.relays.len() > usize::from(MOST_RELAYS))
            .then(|| format!("more than {MOST_RELAYS} relays"))
    }

    /// Returns warnings: accepted blocked hops, relays without room to drift, and problems after a loss.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        let blocked = self.blocked.iter();
        let blocked = blocked.map(|line| format!("{line}; accepted by --allow-blocked"));
        let confined = blocked.chain(self.confined.iter().cloned());
        confined.chain(self.without.iter().filter_map(|without| {
            let problem = without.problem.as_ref()?;
            Some(format!("without relay {}: {problem}", without.lost))
        }))
    }

    /// Returns the text about the room (interval of x) of relay `index`; empty for an unknown relay.
    pub fn room(&self, index: u16) -> String {
        let relay = self.relays.iter().find(|relay| relay.index == index);
        match relay.map(|relay| relay.room_m) {
            Some(Some([from, to])) => format!("x {from:.1} to {to:.1} m"),
            Some(None) => "none".to_owned(),
            None => String::new(),
        }
    }
}

impl fmt::Display for Flight {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let sir_db = self.terrain_sir_db;
        let what = self.unknown().map_or_else(
            || "simulated flight".to_owned(),
            |why| format!("flight (not simulated: {why})"),
        );
        write!(f, "{what}: worst hop {sir_db:.3} dB with terrain")?;
        if let (Some(loss_db), Some(off_m)) = (self.loss_db, self.off_m) {
            let than = if loss_db < 0.0 { "more" } else { "less" };
            write!(
                f,
                ", {:.3} dB {than} than the plan; the relays are up to {off_m:.1} m from the planned positions, because on board they compute x without the terrain",
                loss_db.abs()
            )?;
        }
        for relay in &self.relays {
            let (index, room) = (relay.index, self.room(relay.index));
            write!(
                f,
                "\nrelay {index}: x {:.1} m, altitude {:.1} m; room: {room}",
                relay.x_m, relay.altitude_m
            )?;
        }
        write!(f, "\n{ROOM}")?;
        for line in self.warnings() {
            write!(f, "\nwarning: {line}")?;
        }
        let worst = self.without.iter().filter(|one| one.problem.is_none());
        let worst = worst.filter_map(|one| Some((one.lost, one.terrain_sir_db?)));
        if let Some((lost, sir_db)) = worst.min_by(|one, other| one.1.total_cmp(&other.1)) {
            write!(
                f,
                "\nafter the loss of one relay (cases without a warning) no hop is blocked; the worst of these cases: {sir_db:.3} dB, without relay {lost}"
            )?;
        }
        Ok(())
    }
}

/// Cuts `room` (interval of x) to the part around the relay's `place` outside of all no-fly areas.
///
/// The areas are enlarged by the position error `error_m`, m. If the relay is inside such an area, `room` becomes
/// `None`, and the reason is returned.
fn cut(
    room: &mut Option<[f64; 2]>,
    place: &Placement,
    no_fly: &[NoFly],
    error_m: f64,
) -> Option<String> {
    let [x, y, h] = [place.x_m, place.y_m, place.altitude_m].map(f64::from);
    for area in no_fly {
        for [from, to] in area.intervals_m(y, h, error_m) {
            let Some([low, high]) = room else {
                return None;
            };
            if to <= x {
                *low = low.max(to);
            } else if from >= x {
                *high = high.min(from);
            } else {
                *room = None;
                return Some(format!("it is in {}", range(area)));
            }
        }
    }
    None
}

/// Returns the setup of a simulated flight on a shared channel without frame losses.
fn setup(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Setup, NoPlan> {
    let (mut mission, profiles) = mission::mission(scenario, relays, tolerance)?;
    let mut settings = Method::Align;
    if method == PlannedMethod::Joint {
        mission = mission::with_access(scenario, &mission)?;
        settings = Method::Joint;
    }
    let mut setup = Setup::on_shared_channel(mission);
    setup.settings.method = settings;
    setup.profiles = profiles;
    setup.held = mission::fixed_altitude_relays(scenario, relays);
    Ok(setup)
}

fn simulated(setup: Setup) -> Result<Outcome, NoPlan> {
    run(setup).map_err(|error| NoPlan::Wrong(error.to_string()))
}

/// Returns the plan with relays at `places`.
fn settled(
    scenario: &Scenario,
    relays: u16,
    tolerance: f64,
    places: &[Placement],
) -> Result<Plan, NoPlan> {
    Ok(ProfiledMission::new(scenario, relays, tolerance)?.plan(places, "", false))
}

/// Positions of the remaining relays after the loss of one relay, in a simulated flight.
struct Loss {
    lost: u16,
    /// Numbers of the remaining relays.
    left: Vec<u16>,
    /// Positions of the remaining relays; `None` if they agree on none.
    places: Option<Vec<Placement>>,
}

/// Simulates the flight of `relays` relays, and then the loss of each of them.
///
/// Returns the positions before a loss, and the losses; no losses for a single relay.
fn losses(
    scenario: &Scenario,
    relays: u16,
    (method, tolerance): (PlannedMethod, f64),
) -> Result<(Vec<Placement>, Vec<Loss>), NoPlan> {
    let setup = setup(scenario, relays, method, tolerance)?;
    let outcome = simulated(setup.clone())?;
    let taken = outcome.relays.iter().map(|relay| relay.setpoint);
    let places = taken
        .collect::<Option<_>>()
        .filter(|_| outcome.ending == Ending::Settled)
        .ok_or_else(source::nothing)?;
    let at = outcome.ended + Duration::from_millis(1_000);
    let loss = |lost: u16| {
        let mut setup = setup.clone();
        setup.kills = vec![(lost, at)];
        let outcome = simulated(setup)?;
        let left: Vec<u16> = (1..=relays).filter(|index| *index != lost).collect();
        let relays = left
            .iter()
            .map(|index| outcome.relays.get(usize::from(*index) - 1));
        let places: Option<Vec<Placement>> = relays.map(|relay| relay?.setpoint).collect();
        let is_known = matches!(outcome.ending, Ending::Settled | Ending::NoQuorum);
        Ok(Loss {
            lost,
            left,
            places: places.filter(|_| is_known),
        })
    };
    let lost = if relays > 1 { 1..relays + 1 } else { 0..0 };
    let losses: Vec<Result<Loss, NoPlan>> = lost.into_par_iter().map(loss).collect();
    Ok((places, losses.into_iter().collect::<Result<_, _>>()?))
}

/// Text for the user if the remaining relays agree on no positions after a loss.
const NOWHERE: &str = "the other relays find no positions";

/// Returns a warning for each relay whose loss leads a remaining relay into a no-fly area.
///
/// The simulated flight ignores the terrain. There are no warnings if there are no no-fly areas.
///
/// # Errors
/// [`NoPlan`]: the simulated relays do not agree on positions.
pub fn no_fly_warnings(
    scenario: &Scenario,
    relays: u16,
    how: (PlannedMethod, f64),
) -> Result<Vec<String>, NoPlan> {
    if scenario.no_fly.is_empty() {
        return Ok(Vec::new());
    }
    if relays > MOST_RELAYS {
        return Ok(vec![format!(
            "no-fly areas not checked after the loss of a relay: this is simulated only for chains of at most {MOST_RELAYS} relays"
        )]);
    }
    let (places, losses) = losses(scenario, relays, how)?;
    Ok(lines_of(&scenario.no_fly, &losses, &places))
}

/// Returns a text for each loss that leads a remaining relay into a no-fly area.
///
/// `places` are the positions before the loss.
fn lines_of(no_fly: &[NoFly], losses: &[Loss], places: &[Placement]) -> Vec<String> {
    let lines = losses.iter().filter_map(|loss| {
        let problems = match &loss.places {
            Some(to) => entered(no_fly, &loss.left, [&loss.before(places), to]),
            None => vec![NOWHERE.to_owned()],
        };
        let problem = problems.join("; ");
        (!problems.is_empty()).then(|| format!("without relay {}: {problem}", loss.lost))
    });
    lines.collect()
}

impl Loss {
    /// Returns the positions of the remaining relays before the loss. `places` has all relays.
    fn before(&self, places: &[Placement]) -> Vec<Placement> {
        let left = (1..).zip(places).filter(|(index, _)| *index != self.lost);
        left.map(|(_, place)| *place).collect()
    }
}

/// Checks terrain and no-fly areas below the remaining relays after each loss.
///
/// `places` are the positions before the loss.
fn losses_over(
    scenario: &Scenario,
    elevation: &Elevation,
    ground: &Ground<'_>,
    tolerance: f64,
    (losses, places): (&[Loss], &[Placement]),
) -> Result<Vec<Without>, NoPlan> {
    let closed = |loss: &Loss| without(scenario, elevation, ground, tolerance, (loss, places));
    let without: Vec<Result<Without, NoPlan>> = losses.par_iter().map(closed).collect();
    without.into_iter().collect()
}

/// Checks terrain and no-fly areas below the remaining relays after one loss.
///
/// `places` are the positions before the loss.
fn without(
    scenario: &Scenario,
    elevation: &Elevation,
    ground: &Ground<'_>,
    tolerance: f64,
    (loss, places): (&Loss, &[Placement]),
) -> Result<Without, NoPlan> {
    let lost = loss.lost;
    let Some(to) = &loss.places else {
        return Ok(Without {
            lost,
            terrain_sir_db: None,
            problem: Some(NOWHERE.to_owned()),
        });
    };
    let left = |index: &u16| *index != lost;
    let mut others = scenario.clone();
    others.relays = scenario
        .relays
        .iter()
        .filter(|(index, _)| left(index))
        .map(|(index, own)| (index - u16::from(*index > lost), own.clone()))
        .collect();
    let relays = u16::try_from(to.len()).unwrap_or(u16::MAX);
    let plan = settled(&others, relays, tolerance, to)?;
    let mut report = elevation.report(&others, &plan).map_err(NoPlan::Wrong)?;
    for (height, index) in report.heights.iter_mut().zip(&loss.left) {
        height.index = usize::from(*index);
    }
    let lines = [report.blocked(), elevation.problem(&report, true)];
    let mut problems: Vec<String> = lines.into_iter().flatten().collect();
    let from = loss.before(places);
    problems.extend(entered(&scenario.no_fly, &loss.left, [&from, to]));
    for (index, (from, to)) in loss.left.iter().zip(from.iter().zip(to)) {
        let least_m = elevation.spec.above_ground_m;
        if let Some([x_m, height_m]) = lowest(ground, *from, *to)
            .map_err(NoPlan::Wrong)?
            .filter(|[_, height_m]| *height_m < least_m - 0.01)
        {
            problems.push(format!(
                "relay {index} on its way from x = {:.0} m to {:.0} m is {height_m:.1} m above the ground at x = {x_m:.0} m; allowed: at least {least_m} m (terrain.above_ground_m)",
                from.x_m, to.x_m
            ));
        }
    }
    Ok(Without {
        lost,
        terrain_sir_db: Some(report.terrain_sir_db),
        problem: (!problems.is_empty()).then(|| problems.join("; ")),
    })
}

/// Returns the x and the height above the ground, m, of the point of a path closest to the ground.
///
/// The path is straight. `None` if its ends are the same.
fn lowest(ground: &Ground<'_>, from: Placement, to: Placement) -> Result<Option<[f64; 2]>, String> {
    let [start, end] = [ground.relay(from)?, ground.relay(to)?];
    if start == end {
        return Ok(None);
    }
    let profile = ground.profile([start, end])?;
    let length = profile.length_m().max(f64::MIN_POSITIVE);
    let heights = profile.points.iter().map(|[along, height]| {
        let share = along / length;
        let at = |from: f64, to: f64| from + share * (to - from);
        [
            at(start.x_m, end.x_m),
            at(start.amsl_m, end.amsl_m) - height,
        ]
    });
    Ok(heights.min_by(|one, other| one[1].total_cmp(&other[1])))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test fails by it")]

    use std::path::Path;

    use uav_relay::Placement;
    use uav_relay_scenario::Scenario;

    use super::{Flight, Loss, NOWHERE, losses_over};
    use crate::plan::terrain::Elevation;

    /// Checks the text for the user if the remaining relays agree on no positions after a loss.
    ///
    /// Simulated relays always agree on some, so the outcome is given here.
    #[test]
    fn a_loss_after_which_the_others_find_no_positions_is_named() {
        let example = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../examples/hills.toml");
        let scenario = Scenario::load(&example).unwrap();
        let elevation = Elevation::load(&scenario, &[], 1.0).unwrap().unwrap();
        let ground = elevation.ground(&scenario).unwrap();
        let places = [1000.0, 2500.0, 4000.0].map(|x_m| Placement::on_line(x_m, 150.0));
        let nowhere = |lost: u16| Loss {
            lost,
            left: (1..=3).filter(|index| *index != lost).collect(),
            places: None,
        };
        let found = Loss {
            places: Some(vec![places[0], places[2]]),
            ..nowhere(2)
        };
        let losses = [nowhere(1), found, nowhere(3)];
        let without =
            losses_over(&scenario, &elevation, &ground, 1e-4, (&losses, &places)).unwrap();
        for (at, loss) in without.iter().enumerate() {
            let is_known = at == 1;
            assert_eq!(loss.terrain_sir_db.is_some(), is_known);
            assert_eq!(loss.problem.as_deref() == Some(NOWHERE), !is_known);
        }
        let flight = Flight {
            terrain_sir_db: 1.0,
            loss_db: None,
            off_m: None,
            relays: Vec::new(),
            blocked: None,
            confined: Vec::new(),
            without,
            problem: None,
        };
        let text = flight.to_string();
        for lost in [1, 3] {
            let line = format!("warning: without relay {lost}: the other relays find no positions");
            assert_eq!(text.matches(&line).count(), 1, "{text}");
        }
        assert!(
            !text.contains("worst hop 1.000 dB, without relay"),
            "{text}"
        );
        // The same without terrain.
        let lines = super::lines_of(&scenario.no_fly, &losses, &places);
        assert_eq!(
            lines,
            [1, 3].map(|lost| format!("without relay {lost}: the other relays find no positions"))
        );
        let json = serde_json::to_value(&flight).unwrap();
        assert!(json["without"][0].get("terrain_sir_db").is_none(), "{json}");
    }
}
