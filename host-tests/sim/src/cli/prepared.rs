//! Run prepared from command-line options and a scenario.

use clap::ValueEnum as _;
use uav_relay::{Instant, Measure, Mission, Placement, Profile, Schedule, Sites, Wiring};
use uav_relay_scenario::mission::{self, Refusal};
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::{Interference, Scenario};

use super::options::{Method, Options};
use crate::command::{self, Failure};
use crate::report::rotation::{RotationFigures, RotationReport, RotationRuns};
use crate::report::{
    self, AirReport, AllInterferersReport, ChainReport, SensingReport, TrafficReport, timeline,
};
use crate::simulator::chain::Chain;
use crate::simulator::chain::run as simulate;
use crate::simulator::faults::Faults;
use crate::simulator::outcome::{Outcome, RelayEnd};
use crate::simulator::rotation::RotationSpec;
use crate::simulator::route::TrueHops;
use crate::simulator::setup::Setup;
use crate::simulator::traffic::{TrafficSpec, traffic};
use crate::simulator::true_interference::beta_w;
use crate::svg::{OtherInterferers, Picture, lateral_view};

/// Run that is ready to start: its setup, and the mission with the true interference for the report.
#[derive(Debug)]
pub struct Prepared<'a> {
    options: &'a Options,
    scenario: Scenario,
    method: String,
    /// Setup of the simulated run: relays, links, faults and events.
    pub setup: Setup,
    told: Mission,
    /// Data traffic that the options request; `None` if they request no traffic.
    data: Option<TrafficSpec>,
}

/// Reason why a run was not started.
#[derive(Debug)]
pub enum Refused {
    /// Invalid options or scenario.
    Failed(Failure),
    /// The distance from Tx to Rx is too short for the relays, as the report states.
    ///
    /// For the default scenario there is also a failure, which names the option `--uavs` as wrong, because the user
    /// cannot change that scenario.
    Reported(Box<ChainReport>, Option<Failure>),
}

impl From<Failure> for Refused {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// Number of interference samples that each relay takes in one repetition of a `--closed-loop` run.
const SAMPLES: u32 = 10_000;

/// Returns the largest number of chains that flew at the same time, each by its own agreement.
fn chains(outcome: &Outcome) -> usize {
    outcome.watched.map_or(0, |it| it.most_flying)
}

impl<'a> Prepared<'a> {
    /// Prepares a run from options and a scenario.
    ///
    /// `name` is the scenario's file name for messages; `None` for the default scenario.
    ///
    /// # Errors
    /// [`Refused`]: contradictory options, or a chain that cannot be placed.
    pub fn new(
        options: &'a Options,
        scenario: Scenario,
        name: Option<&str>,
    ) -> Result<Self, Refused> {
        let is_default = name.is_none();
        let name = name.unwrap_or("default scenario");
        let method = options
            .method
            .to_possible_value()
            .map_or_else(String::new, |value| value.get_name().to_owned());
        if !scenario.knows_interference() {
            let line = "[[interferer]]: is missing: only `cargo provision` accepts a scenario with [listen] and without [[interferer]]";
            return Err(Failure::input(line.to_owned()).into());
        }
        agree(options, &method, &scenario)?;
        if let Some(line) = mission::undescribed_relay_error(&scenario, options.uavs) {
            return Err(Failure::input(format!("{name}: {line}")).into());
        }
        let tolerance = options.tolerance.unwrap_or(1e-4);
        let refused = |line: &str| {
            Box::new(ChainReport::refused(
                &method,
                options.uavs,
                options.seed,
                line,
            ))
        };
        let briefed = mission::mission(&scenario, options.uavs, tolerance);
        let briefed = briefed.and_then(|(mission, profiles)| match options.method {
            Method::Joint => Ok((mission::with_access(&scenario, &mission)?, profiles)),
            _ => Ok((mission, profiles)),
        });
        let (mission, profiles) = match briefed {
            Ok(briefed) => briefed,
            // Without a scenario file, a message about its keys would not help the user.
            Err(Refusal::NoRoom { .. }) if is_default => {
                let fits = |uavs: &u16| mission::mission(&scenario, *uavs, tolerance).is_ok();
                let most = (1..options.uavs).rev().find(fits).unwrap_or(1);
                let line = format!(
                    "--uavs {}: must be within 1 to {most} without a --scenario, because relays keep {} m apart on the {} m from Tx to Rx",
                    options.uavs, scenario.min_separation_m, scenario.distance_m
                );
                return Err(Refused::Reported(
                    refused(&line),
                    Some(Failure::input(line)),
                ));
            }
            Err(refusal @ Refusal::NoRoom { .. }) => {
                return Err(Refused::Reported(refused(&refusal.to_string()), None));
            }
            Err(refusal) => return Err(Failure::input(format!("{name}: {refusal}")).into()),
        };
        let sites = scenario.line.map(|line| Sites {
            tx: line.sites[0],
            rx: line.sites[1],
        });
        let mut setup = setup(options, mission, sites)?;
        let axis = scenario.line.map(|line| line.axis);
        options.hostile.flight.prepare(&mut setup, axis)?;
        options.web.prepare(&mut setup);
        setup.profiles = profiles;
        setup.held = mission::fixed_altitude_relays(&scenario, options.uavs);
        let told = setup.mission;
        let data = options.data.spec(&scenario)?;
        setup.track = data.is_some();
        options
            .listening
            .prepare(&mut setup, &scenario, options.uavs)?;
        Ok(Self {
            options,
            scenario,
            method,
            setup,
            told,
            data,
        })
    }

    /// Runs the simulation of `setup` and returns the chain at its end. `watch` steps a chain until its run ends.
    ///
    /// With `--closed-loop`, the relays then measure the interference and agree on positions again. This is repeated as
    /// often as the option requests.
    ///
    /// # Errors
    /// A setting that a relay rejects, or an error of `watch`.
    pub fn fly(
        &self,
        mut setup: Setup,
        mut watch: impl FnMut(&mut Chain) -> Result<(), Failure>,
    ) -> Result<Chain, Failure> {
        let start = |setup| Chain::new(setup).map_err(|error| Failure::input(error.to_string()));
        let (Interference::Field(field), Some(rounds)) =
            (&self.scenario.interference, self.options.closed_loop)
        else {
            let mut chain = start(setup)?;
            watch(&mut chain)?;
            return Ok(chain);
        };
        let i_max_w = narrow(field.i_max_w);
        setup.mission = mission::with_uniform_field(&setup.mission);
        setup.settings.measure = Some(Measure {
            i_max_w,
            samples: SAMPLES,
        });
        let mut chain = start(setup)?;
        watch(&mut chain)?;
        for _ in 0..rounds {
            chain.measure(SAMPLES, |place, rng| {
                let (alpha, beta) = mission::shapes(field, f64::from(place.x_m));
                beta_w(rng, alpha, beta, i_max_w)
            });
            chain.restart();
            watch(&mut chain)?;
        }
        Ok(chain)
    }

    /// Returns the report of a run. The SIRs in it are computed with the true interference at the run's end.
    ///
    /// The mission in `self.setup` is replaced by a mission with the true interference.
    pub fn report(&mut self, outcome: &Outcome) -> ChainReport {
        let (options, scenario) = (self.options, &self.scenario);
        let listened = SensingReport::of(&self.setup, outcome);
        self.setup.mission = options.listening.moved(self.told, outcome.ended);
        let setup = &self.setup;
        let flown = report::flown(setup, outcome);
        let mut report = ChainReport::new(&self.method, &flown, outcome, options.seed);
        let is_shared = setup.settings.wiring == Wiring::Shared;
        report.channel = is_shared.then_some("shared");
        report.reach = is_shared.then_some(setup.radio_reach);
        report.air = AirReport::of(setup, outcome);
        report.listened = listened;
        let planned = options.hostile.uploads.are_planned();
        if let (None, false, Some(sir)) = (&listened, planned, report.sir) {
            report.against_all = AllInterferersReport::of(scenario, &report.relays, sir);
        }
        report
    }

    /// Returns the data traffic of a run. `None` if the options request no traffic, or if the relays have never agreed
    /// on positions.
    ///
    /// # Errors
    /// More traffic than can be simulated.
    pub fn traffic(&self, outcome: &Outcome) -> Result<Option<TrafficReport>, Failure> {
        let Some(spec) = &self.data else {
            return Ok(None);
        };
        let hops = TrueHops::new(&self.scenario, &self.setup, &self.told);
        let traffic = traffic(spec, &hops, outcome, self.options.uavs.into());
        let traffic = traffic.map_err(|error| Failure::input(error.to_string()))?;
        Ok(traffic.map(|traffic| TrafficReport::new(spec, &traffic)))
    }

    /// Returns the report of a run in which drones with low batteries are replaced. For comparison it has a second run,
    /// in which drones do not announce that they leave. `None` without a fleet.
    ///
    /// # Errors
    /// A setting that a relay rejects.
    pub fn rotation(&self, outcome: &Outcome) -> Result<Option<RotationReport>, Failure> {
        let (Some(spec), Some(rotated)) = (&self.setup.rotation, &outcome.rotated) else {
            return Ok(None);
        };
        let mut plain = self.setup.clone();
        plain.rotation = Some(RotationSpec {
            announced: false,
            ..spec.clone()
        });
        let plain = simulate(plain).map_err(|error| Failure::input(error.to_string()))?;
        Ok(Some(RotationReport::new(
            spec,
            (rotated, chains(outcome)),
            plain
                .rotated
                .as_ref()
                .map(|rotated| (rotated, chains(&plain))),
        )))
    }

    /// Simulates the run with `count` seeds, from its own seed on. The result is empty without a fleet.
    ///
    /// # Errors
    /// A setting that a relay rejects.
    pub fn rotations(&self, count: u64) -> Result<RotationRuns, Failure> {
        let mut runs = RotationRuns::default();
        for seed in (self.setup.seed..).take(usize::try_from(count).unwrap_or(usize::MAX)) {
            let mut setup = self.setup.clone();
            setup.seed = seed;
            let outcome = simulate(setup).map_err(|error| Failure::input(error.to_string()))?;
            if let (Some(spec), Some(rotated)) = (&self.setup.rotation, &outcome.rotated) {
                let figures = RotationFigures::new(spec, rotated, chains(&outcome));
                runs.runs.push((seed, figures));
            }
        }
        Ok(runs)
    }

    /// Returns the linear SIR of every hop from Tx to Rx, for the interferer's position at the time `then`.
    ///
    /// `places` has the relays' indices (from 1) and positions in the order of the chain. The SIRs are for the mission
    /// that the relays have at the start, also after an upload.
    pub fn sirs_at(&self, then: Instant, places: &[(u16, Placement)]) -> Vec<f64> {
        let (mission, places) = self.chain_at(then, places);
        report::hop_sirs(&mission, &places)
    }

    /// Returns the linear SIR of every hop from Rx to Tx, for the interferer's position at the time `then`.
    ///
    /// The arguments are as in [`Prepared::sirs_at`]. Empty if the mission is for the direction from Tx to Rx only.
    pub fn sirs_back_at(&self, then: Instant, places: &[(u16, Placement)]) -> Vec<f64> {
        let (mission, places) = self.chain_at(then, places);
        if mission.reverse() > 0.0 {
            report::hop_sirs_back(&mission, &places)
        } else {
            Vec::new()
        }
    }

    /// Returns the input for a chain's SIRs: the mission, and each relay's position, altitude and power.
    ///
    /// The mission has the interferer's position at the time `then`.
    fn chain_at(
        &self,
        then: Instant,
        places: &[(u16, Placement)],
    ) -> (Mission, Vec<(Placement, Profile)>) {
        let mission = self.options.listening.moved(self.told, then);
        let usual = mission.config().common;
        let own = |index: u16| {
            let mut own = self.setup.profiles.iter();
            own.find(|(of, _)| *of == index)
                .map_or(usual, |(_, profile)| *profile)
        };
        let places = places
            .iter()
            .map(|(index, place)| (*place, own(*index)))
            .collect();
        (mission, places)
    }

    /// Returns the picture of the chain at the end of a run.
    ///
    /// [`report`](Self::report) must be called before, because it puts the true interference into the mission.
    pub fn picture(&self, outcome: &Outcome, report: &ChainReport) -> Picture {
        let flown = report::flown(&self.setup, outcome);
        picture_of(&flown, &self.scenario, outcome, report)
    }
}

/// Checks the options against each other and against the scenario.
///
/// `method` is the name of the planning method, for error messages.
fn agree(options: &Options, method: &str, scenario: &Scenario) -> Result<(), Failure> {
    options.agree(method)?;
    options.listening.agree()?;
    let uploads = options.hostile.uploads.are_planned();
    options.data.agree(&scenario.interference, uploads)?;
    options
        .hostile
        .agree(options.uavs, options.closed_loop.is_some())?;
    let is_field = matches!(scenario.interference, Interference::Field(_));
    if options.method.is_for_fields() != is_field {
        let line = if is_field {
            format!(
                "--method {method} needs an [[interferer]], but the scenario has a [field]: use --method stochastic or stochastic-step"
            )
        } else {
            format!(
                "--method {method} needs a --scenario with a [field] (distributions of the interference)"
            )
        };
        return Err(Failure::input(line));
    }
    if uploads && is_field {
        let line = "--upload needs an [[interferer]], but the scenario has a [field]";
        return Err(Failure::input(line));
    }
    if let Some(one) = mission::hypothetical(scenario) {
        command::print_line(&format!(
            "note: one interferer of {:.3} W at x = {:.3} m, y = {:.3} m replaces all interferers of the scenario, and the SIRs are \
             computed with it; `cargo plan` computes the SIRs with all",
            one.power_w, one.x_m, one.y_m
        ));
        if uploads {
            command::print_line(
                "note: --upload changes the interferer that the relays use; all other values stay",
            );
        }
    }
    Ok(())
}

fn setup(options: &Options, mission: Mission, sites: Option<Sites>) -> Result<Setup, Failure> {
    let mut setup = Setup::new(mission);
    setup.settings.schedule = match options.method {
        Method::AlignStep | Method::StochasticStep => Schedule::FixedStep {
            step: options.epsilon.unwrap_or(0.1),
        },
        _ => Schedule::Bracketed,
    };
    setup.settings.method = match options.method {
        Method::Joint => uav_relay::Method::Joint,
        Method::Adjust => uav_relay::Method::Adjust(uav_relay::Adjust {
            rounds: options.rounds.unwrap_or(500),
            explore_m: options.explore_m.unwrap_or(10.0),
            local: options.grid.unwrap_or_default(),
        }),
        _ => uav_relay::Method::Align,
    };
    setup.settings.predict = !options.no_predict;
    setup.seed = options.seed;
    options.hostile.prepare(&mut setup, sites)?;
    options.hostile.air.prepare(&mut setup, options.loss)?;
    setup.faults = Faults {
        loss: options.loss,
        corrupt: options.corrupt,
        duplicate: options.duplicate,
        reorder: options.reorder,
    };
    Ok(setup)
}

fn picture_of(
    mission: &Mission,
    scenario: &Scenario,
    outcome: &Outcome,
    report: &ChainReport,
) -> Picture {
    let mut hop_sir: Vec<f64> = report.relays.iter().map(|relay| relay.sir).collect();
    hop_sir.extend(report.rx_sir);
    let back = report.relays.iter().filter_map(|relay| relay.sir_back);
    let back = back.chain(report.back.map(|back| back.rx_sir_back));
    let silent = (1..)
        .zip(&outcome.relays)
        .filter(|(_, relay)| relay.killed.is_some());
    let left_out: Vec<usize> = report.lost.iter().map(|relay| relay.index.into()).collect();
    let lost = silent
        .map(|(index, _)| index)
        .filter(|index| !left_out.contains(index))
        .collect();
    let place = |relay: &RelayEnd| {
        let at = |place: Placement| (f64::from(place.x_m), f64::from(place.altitude_m));
        relay.setpoint.map_or((f64::NAN, f64::NAN), at)
    };
    let aside = outcome.relays.iter().map(|relay| {
        relay
            .setpoint
            .map_or(f64::NAN, |place| f64::from(place.y_m))
    });
    let nodes = if report.relays.is_empty() && report.lost.is_empty() {
        Vec::new()
    } else {
        outcome.relays.iter().map(place).collect()
    };
    let before = scenario.sources();
    let believed = report.listened.and_then(|listened| listened.believed);
    let uploaded = report.version.is_some_and(|version| version > 0);
    let (interferers, others, others_are) =
        if let (true, uav_relay::Interference::Source(at)) = (uploaded, mission.interference()) {
            let now = [at.power_w, at.x_m, at.y_m].map(f64::from);
            (vec![now.into()], before, OtherInterferers::Before)
        } else {
            let believed = believed.map(|at| [at.power_w, at.x_m, at.y_m].map(f64::from).into());
            (
                before,
                believed.into_iter().collect(),
                OtherInterferers::NewEstimate,
            )
        };
    let shown: Vec<_> = interferers.iter().chain(&others).copied().collect();
    let lateral_view = lateral_view(mission, aside, &shown);
    Picture {
        title_method: report.method.clone(),
        distance_m: f64::from(mission.config().distance_m),
        interferers,
        others,
        others_are,
        nodes,
        lateral_view,
        hop_sir,
        hop_sir_back: report.back.map_or_else(Vec::new, |_| back.collect()),
        reverse: report.back.map_or(0.0, |back| back.reverse),
        lost,
        left_out,
        events: timeline::words(&report.timeline),
    }
}
