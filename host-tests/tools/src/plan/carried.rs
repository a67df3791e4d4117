//! Positions with the largest data rate: on the line Tx-Rx, or with free altitudes.
//!
//! | hops | directions | positions |
//! | --- | --- | --- |
//! | equal slots or own channels | one, or both with r = 1 | those of the largest SIR, by Algorithm 1 |
//! | equal slots or own channels | both, r < 1 | Algorithm 1 with the ratio of SIRs that both rates need, and a shortest path |
//! | equal slots or own channels, free altitudes | both, r < 1 | the joint method with that ratio (`altitude`) |
//! | fitted slots | one or both | a shortest path (`path`) |
//!
//! A rate R to Rx and r R back need the SINRs g(R) and g(r R). Their ratio is not r, and depends on R. So Algorithm 1
//! is repeated for several R, by bisection, each time with this ratio.

use std::cell::OnceCell;

use uav_relay::optimiser::plan as silent;
use uav_relay::{Mission, MissionConfig, Placement, Schedule};
use uav_relay_scenario::link::{Access, Radio};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario};
use uav_relay_sim::report::WorstBack;

use crate::fewest;

use super::bound::{Targets, excludes};
use super::path::{Table, Times};
use super::{NoPlan, Plan, PlanRequest, ProfiledMission, altitude, source, steps};

/// Largest relative excess of a chain's time per bit over the smallest time, both on the coarse grid.
///
/// The smallest time is that of the best number of relays. A precise search for another number of relays cannot make up
/// for a larger excess.
const WORTH: f64 = 0.05;

/// Number of bisection steps that find the largest data rate.
const HALVINGS: u8 = 18;

/// Planner of relay positions with the largest data rate.
#[derive(Debug)]
pub struct Carried<'a> {
    scenario: &'a Scenario,
    radio: &'a Radio,
    tolerance: f64,
    /// True if the relays may choose their altitudes and lateral offsets.
    free_altitude: bool,
    /// Largest number of relays for which `table` has positions.
    most: u16,
    table: OnceCell<Option<Table>>,
}

impl<'a> Carried<'a> {
    /// Creates the planner for up to `most` relays; `None` if the positions with the best SIR are used.
    ///
    /// They are used if they also maximise the data rate: with equal time slots or a frequency for each hop, for data
    /// in one direction or at equal rates in both. They are also used for fitted slots with free altitudes, for a
    /// requested x, and for any interference other than a single interferer.
    pub fn new(
        scenario: &'a Scenario,
        ask: &PlanRequest,
        radio: &'a Radio,
        most: u16,
    ) -> Option<Self> {
        let is_alone =
            matches!(&scenario.interference, Interference::Sources(sources) if sources.len() == 1);
        let is_between = scenario.reverse > 0.0 && scenario.reverse < 1.0;
        let differs = match radio.link.access {
            Access::Fitted => !ask.free_altitude,
            _ => is_between,
        };
        (is_alone && differs && ask.x_m.is_none()).then(|| Self {
            scenario,
            radio,
            tolerance: ask.tolerance,
            free_altitude: ask.free_altitude,
            most,
            table: OnceCell::new(),
        })
    }

    fn table(&self) -> Option<&Table> {
        let table = self.table.get_or_init(|| {
            let most = Scene::new(self.scenario, self.most)?;
            Some(Table::new(&Times::new(
                &most,
                self.radio,
                self.scenario.reverse,
            )))
        });
        table.as_ref()
    }

    /// Returns the largest number of relays for which a precise search is worthwhile.
    ///
    /// With more relays, one bit takes over 5 % more time on the coarse grid than with the best number of relays. A
    /// precise search cannot make up for this. The planner uses this limit for fitted time slots (as long as each hop
    /// needs).
    pub fn most_worth(&self) -> u16 {
        self.table().map_or(0, |table| table.largest_within(WORTH))
    }

    /// Returns the positions of `relays` relays with the largest data rate.
    ///
    /// `relays` is at most `most` of [`Carried::new`].
    ///
    /// # Errors
    /// [`NoPlan`] if the scenario is not a valid mission, or if no positions give every hop an SIR above 0.
    pub fn plan(&self, relays: u16) -> Result<Plan, NoPlan> {
        if self.free_altitude {
            return altitude::best_for_rate(self.scenario, relays, self.tolerance, self.radio);
        }
        let by_sir = source::best(self.scenario, relays, self.tolerance)?;
        let briefed = ProfiledMission::new(self.scenario, relays, self.tolerance)?;
        let Some(scene) = Scene::new(self.scenario, relays) else {
            return Ok(by_sir);
        };
        let times = Times::new(&scene, self.radio, self.scenario.reverse);
        let table = self.table();
        let x = |places: &[Placement]| places.iter().map(|at| at.x_m.into()).collect::<Vec<f64>>();
        let mut starts = vec![x(&by_sir.chain())];
        if self.radio.link.access != Access::Fitted {
            let rate = 1.0 / times.total(&x(&by_sir.chain()));
            if let Some(places) = self.by_ratio(&briefed, rate) {
                starts = vec![x(&places)];
            }
        }
        starts.extend(
            table
                .and_then(|table| table.start(relays))
                .map(<[f64]>::to_vec),
        );
        let best = starts.iter().map(|start| times.refined(start));
        let mut best = best.min_by(|one, other| one.0.total_cmp(&other.0));
        if self.radio.link.access == Access::Fitted
            && let Some(shorter) =
                steps::shorter(&times, best.as_ref().map_or(f64::INFINITY, |best| best.0))
        {
            best = Some(times.refined(&shorter));
        }
        let Some((_, x)) = best.filter(|(time, _)| time.is_finite()) else {
            return Ok(by_sir);
        };
        let places: Vec<Placement> = (1..)
            .zip(&x)
            .map(|(index, &x)| Placement::on_line(narrow(x), briefed.profile(index).altitude_m))
            .collect();
        let fits = self.radio.link.access == Access::Fitted;
        let how = if fits {
            "a shortest-path search for time slots fitted to the hops"
        } else {
            "Algorithm 1 for the data rates of both directions"
        };
        let plan = briefed.plan(&places, how, false);
        let chain = plan.chain();
        let sirs = scene.hop_sirs(&chain);
        let back = WorstBack::of(&plan.mission, &sirs, &scene.hop_sirs_back(&chain));
        Ok(Plan { sirs, back, ..plan })
    }

    /// Returns `plan`, with `proven` set if it is proven that no positions have a larger data rate.
    ///
    /// There is no proof for fitted time slots (as long as each hop needs), and none for free altitudes.
    #[must_use]
    pub fn proven(&self, plan: Plan) -> Plan {
        if self.free_altitude {
            return plan;
        }
        let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
        let Some(scene) = Scene::new(self.scenario, relays) else {
            return plan;
        };
        let x: Vec<f64> = plan.places.iter().map(|(at, _)| at.x_m.into()).collect();
        let reverse = self.scenario.reverse;
        let time = Times::new(&scene, self.radio, reverse).total(&x);
        let more = (1.0 + 2.0 * self.tolerance) / time;
        let proven = self.radio.link.access != Access::Fitted
            && carries_no(&scene, self.radio, reverse, more);
        Plan { proven, ..plan }
    }

    /// Returns the positions with the largest data rate by Algorithm 1, repeated by bisection on the rate.
    ///
    /// For a rate R, Algorithm 1 gets the ratio of two SIRs: the SIR that R toward Rx requires, and the SIR that
    /// `reverse` times R toward Tx requires. `least` is a rate that is known to be possible, bit/s/Hz.
    fn by_ratio(&self, briefed: &ProfiledMission, least: f64) -> Option<Vec<Placement>> {
        let reverse = self.scenario.reverse;
        let model = &self.radio.link.model;
        let ratio = |rate: f64| Some((model.sinr(rate)?, model.sinr(reverse * rate)?));
        let placed = |rate: f64| {
            let (there, back) = ratio(rate)?;
            let mission = &briefed.mission;
            let config = MissionConfig {
                reverse: narrow((back / there).min(1.0)),
                ..*mission.config()
            };
            let mission = Mission::try_new(config).ok()?;
            let profile_of = |index| briefed.profile(index);
            let agreed = silent::solve(&mission, Schedule::Bracketed, profile_of).ok()?;
            (f64::from(agreed.target) >= there).then_some(())?;
            fewest::places(&mission, agreed.target, profile_of)
        };
        let mut best = None;
        let (mut low, mut high) = (least, if least > 0.0 { 1.25 * least } else { 1.0 });
        while let Some(places) = placed(high)
            && high < 1e3
        {
            best = Some(places);
            low = high;
            high *= 2.0;
        }
        for _ in 0..HALVINGS {
            let middle = f64::midpoint(low, high);
            match placed(middle) {
                Some(places) => (low, best) = (middle, Some(places)),
                None => high = middle,
            }
        }
        best
    }
}

/// Returns true if it is proven that no positions carry `bits_per_hz`, bit/s/Hz, over each hop to Rx.
///
/// With `reverse` above 0 each hop must also carry `reverse` times that rate toward Tx.
pub fn carries_no(scene: &Scene, radio: &Radio, reverse: f64, bits_per_hz: f64) -> bool {
    let model = &radio.link.model;
    let Some(there) = model.sinr(bits_per_hz) else {
        return true;
    };
    let back = if reverse > 0.0 {
        model.sinr(reverse * bits_per_hz)
    } else {
        Some(0.0)
    };
    back.is_none_or(|back| excludes(scene, Targets { there, back }))
}
