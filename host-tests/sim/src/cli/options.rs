//! Options of `cargo chain` and their ranges.

use std::path::PathBuf;

use clap::{Args, Parser, ValueEnum};
use uav_relay::{Instant, Interference, Interferer, Listen, Mission, MissionConfig};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::number::narrow;
use uav_relay_scenario::scene::Scene;

use super::data::Data;
use super::hostile::Hostile;
use super::web::Web;
use crate::command::{Failure, file, given_option, number, quantity, whole};
use crate::simulator::setup::Setup;
use crate::simulator::true_interference::TrueInterference;

/// Simulates N relays that exchange real frames and move to the positions with the best worst-hop SIR
#[derive(Parser, Debug)]
#[command(name = "chain", bin_name = "cargo chain", disable_version_flag = true)]
pub struct Options {
    /// Scenario file (TOML); default: the paper's multi-hop scenario
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
    /// Number of relays, 1 to 1000
    #[arg(long, value_name = "N", default_value_t = 8, allow_negative_numbers = true, value_parser = whole(1_u16, 1000))]
    pub uavs: u16,
    /// Planning method
    #[arg(long, value_name = "M", value_enum, default_value_t = Method::Align)]
    pub method: Method,
    /// Step of the target SIR in align-step and stochastic-step, linear, 1e-6 to 1e6; default 0.1
    #[arg(long, value_name = "E", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 1e6))]
    pub epsilon: Option<f64>,
    /// Largest number of rounds of `adjust`, 1 to 65535; default 500
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = whole(1_u16, 65_535))]
    pub rounds: Option<u16>,
    /// Largest change of altitude in a round of `adjust`, m, 0 to 1e5; default 10
    #[arg(long = "explore", value_name = "M", allow_negative_numbers = true, value_parser = |text: &str| quantity(text, 0.0, 1e5, "m").map(narrow))]
    pub explore_m: Option<f32>,
    /// Search in `adjust` on a grid of C positions along the line by R altitudes, 2 to 255 each. The default is a search from coarse
    /// to fine
    #[arg(long, value_name = "CxR", value_parser = grid)]
    pub grid: Option<uav_relay::Local>,
    /// Repeat a stochastic run R times, 1 to 100: fly, measure the true field, and agree again. In the first run the relays assume the
    /// field of Rx at every position
    #[arg(long, value_name = "R", allow_negative_numbers = true, value_parser = whole(1_u8, 100))]
    pub closed_loop: Option<u8>,
    /// Relative tolerance of the achieved SIR, 1e-6 to 0.1; default 1e-4. Not for the methods align-step and stochastic-step
    #[arg(long, value_name = "T", allow_negative_numbers = true, value_parser = |text: &str| number(text, 1e-6, 0.1))]
    pub tolerance: Option<f64>,
    /// Probability that a frame is lost, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub loss: f64,
    /// Probability that a frame is corrupted, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub corrupt: f64,
    /// Probability that a frame arrives twice, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub duplicate: f64,
    /// Probability that a frame is overtaken by others, 0 to 0.9
    #[arg(long, value_name = "P", default_value_t = 0.0, allow_negative_numbers = true, value_parser = probability)]
    pub reorder: f64,
    /// Search the target SIR without a prediction. The leader then does not compute the chain first, and more messages are needed
    #[arg(long)]
    pub no_predict: bool,
    /// Seed of every random draw; the same seed gives the same run, byte for byte
    #[arg(long, value_name = "S", default_value_t = 1, allow_negative_numbers = true, value_parser = whole(0, u64::MAX))]
    pub seed: u64,
    /// Print only one JSON object on standard output
    #[arg(long)]
    pub json: bool,
    /// Draw the chain with each hop's SIR. A side view, and a top view if relays or an interferer are beside the line
    #[arg(long, value_name = "FILE", value_parser = file)]
    pub svg: Option<PathBuf>,
    /// Write every transmitted frame to a pcapng capture with virtual times. `cargo decode` and Wireshark read it
    #[arg(long, value_name = "FILE", value_parser = file)]
    pub capture: Option<PathBuf>,
    /// Options for the relays' measurements of the interference.
    #[command(flatten)]
    pub listening: Listening,
    /// Options for the simulated data traffic through the chain.
    #[command(flatten)]
    pub data: Data,
    /// Options for failures, attacks and uploads during the run.
    #[command(flatten)]
    pub hostile: Hostile,
    /// Options of the page that shows the run.
    #[command(flatten)]
    pub web: Web,
}

/// Method by which relays agree on their positions.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub enum Method {
    /// Algorithm 1; the range of possible target SIRs is narrowed down from both sides
    Align,
    /// Algorithm 1; the target SIR is lowered in fixed steps, as in the paper
    AlignStep,
    /// Algorithm 1, then Algorithm 2
    Adjust,
    /// Positions along the line, lateral offsets and altitudes together
    #[value(alias = "altitude")]
    Joint,
    /// Algorithm 4 (interference field); targets as with align
    Stochastic,
    /// Algorithm 4 (interference field); targets as with align-step
    StochasticStep,
}

impl Options {
    /// Returns the options, with `--uavs` replaced by the number of drones in `--fleet`, if that is given.
    pub fn settled(mut self) -> Self {
        self.uavs = self.hostile.flight.fleet().unwrap_or(self.uavs);
        self
    }

    /// Rejects options that have no effect with the chosen method. `method` is its name, for the message.
    pub(super) fn agree(&self, method: &str) -> Result<(), Failure> {
        let is_step = matches!(self.method, Method::AlignStep | Method::StochasticStep);
        let is_adjust = self.method == Method::Adjust;
        let step = (
            "has no fixed step",
            ", or use --method align-step or stochastic-step",
        );
        let rounds = ("has no rounds of adjustment", ", or use --method adjust");
        let bracket = ("tries the target SIRs in fixed steps", "");
        let ignored: [(Option<String>, (&str, &str)); 6] = [
            (
                given_option("--epsilon", self.epsilon.filter(|_| !is_step)),
                step,
            ),
            (
                given_option("--rounds", self.rounds.filter(|_| !is_adjust)),
                rounds,
            ),
            (
                given_option("--explore", self.explore_m.filter(|_| !is_adjust)),
                rounds,
            ),
            (self.grid.filter(|_| !is_adjust).map(grid_text), rounds),
            (
                given_option("--tolerance", self.tolerance.filter(|_| is_step)),
                bracket,
            ),
            (
                (is_step && self.no_predict).then(|| "--no-predict".to_owned()),
                bracket,
            ),
        ];
        for (option, (why, instead)) in ignored {
            if let Some(option) = option {
                let name = option.split(' ').next().unwrap_or_default();
                let line = format!(
                    "{option}: has no effect with --method {method}, which {why}; leave {name} out{instead}"
                );
                return Err(Failure::input(line));
            }
        }
        if self.closed_loop.is_some() && !self.method.is_for_fields() {
            let line = format!(
                "--closed-loop: has no effect with --method {method}, because relays measure an interference field only with --method stochastic and stochastic-step; leave --closed-loop out, or use one of these methods"
            );
            return Err(Failure::input(line));
        }
        Ok(())
    }
}

fn grid_text(grid: uav_relay::Local) -> String {
    match grid {
        uav_relay::Local::Grid { columns, rows } => format!("--grid {columns}x{rows}"),
        uav_relay::Local::Fine => "--grid".to_owned(),
    }
}

impl Method {
    /// Returns true if the method needs a scenario with a random field: distributions of the interference. The other
    /// methods need a scenario with an interferer.
    pub const fn is_for_fields(self) -> bool {
        matches!(self, Self::Stochastic | Self::StochasticStep)
    }
}

fn probability(text: &str) -> Result<f64, String> {
    number(text, 0.0, 0.9)
}

fn grid(text: &str) -> Result<uav_relay::Local, String> {
    let form = "must be CxR: C columns and R rows, 2 to 255 each";
    let (columns, rows) = text.split_once('x').ok_or(form)?;
    let side = |text: &str| text.parse().ok().filter(|side| *side >= 2).ok_or(form);
    Ok(uav_relay::Local::Grid {
        columns: side(columns)?,
        rows: side(rows)?,
    })
}

/// Command-line options for measurements.
#[derive(Args, Debug)]
#[command(next_help_heading = "Listening")]
pub struct Listening {
    /// Hide the interferers from the relays. Each measures the interference at its position once a second, and together they
    /// estimate an equivalent interferer. The table `listen` of the scenario applies, if there is one
    #[arg(long)]
    listen: bool,
    /// Independent samples per measurement, 1 to 1000000; default 1000
    #[arg(long, value_name = "K", allow_negative_numbers = true, value_parser = whole(1_u32, 1_000_000))]
    samples: Option<u32>,
    /// Standard deviation of the random loss (shadowing) at each position, dB, 0 to 20; default 0
    #[arg(long, value_name = "DB", allow_negative_numbers = true, value_parser = |text: &str| quantity(text, 0.0, 20.0, "dB"))]
    shadow: Option<f64>,
    /// Velocity of all interferers, m/s along the line and to its right, each -100 to 100
    #[arg(long, value_name = "VX,VY", allow_hyphen_values = true, value_parser = velocity)]
    move_interferer: Option<[f64; 2]>,
    /// Virtual duration of the measurements, s, 10 to 1e5; default 120
    #[arg(long, value_name = "S", allow_negative_numbers = true, value_parser = |text: &str| quantity(text, 10.0, 1e5, "s"))]
    listen_for: Option<f64>,
}

impl Listening {
    /// Rejects options about measurements if `--listen` (the relays locate the interferer) is missing.
    pub fn agree(&self) -> Result<(), Failure> {
        let velocity = self
            .move_interferer
            .map(|[along, aside]| format!("{along},{aside}"));
        let told = [
            given_option("--samples", self.samples),
            given_option("--shadow", self.shadow),
            given_option("--move-interferer", velocity),
            given_option("--listen-for", self.listen_for),
        ];
        match told.into_iter().flatten().next() {
            Some(option) if !self.listen => Err(Failure::input(format!(
                "{option}: has no effect without --listen"
            ))),
            _ => Ok(()),
        }
    }

    /// Hides the interferers of `scenario` from the relays, if `--listen` is given. The relays then have to locate
    /// them.
    ///
    /// `uavs` is the number of relays. Without `--listen`, `setup` stays as it is.
    pub fn prepare(
        &self,
        setup: &mut Setup,
        scenario: &Scenario,
        uavs: u16,
    ) -> Result<(), Failure> {
        if !self.listen {
            return Ok(());
        }
        if setup.soak.is_some() || !setup.uploads.is_empty() || setup.attack.is_some() {
            let line = "--listen cannot be combined with --soak, --upload, --forge or --replay";
            return Err(Failure::input(line.to_owned()));
        }
        let Some(scene) = Scene::new(scenario, uavs) else {
            let line = "--listen needs an [[interferer]], but the scenario has a [field]";
            return Err(Failure::input(line.to_owned()));
        };
        let unknown = Mission::try_new(MissionConfig {
            interference: Interference::Unknown,
            ..*setup.mission.config()
        });
        setup.mission = unknown.map_err(|error| Failure::input(error.to_string()))?;
        let mut listen = match (scenario.listen, self.move_interferer) {
            (Some(spec), _) => spec.of(uavs),
            (None, Some(_)) => Listen::following(uavs),
            (None, None) => Listen::default(),
        };
        let samples = self.samples.unwrap_or(1_000);
        #[expect(clippy::cast_possible_truncation, reason = "of 1e-3 to 1")]
        let error = (1.0 / f64::from(samples).sqrt()).max(1e-3) as f32;
        let said = scenario.listen.and_then(|spec| spec.relative_error);
        if said.is_none() {
            listen.relative_error = error;
        }
        setup.settings.listen = Some(listen);
        let mut true_interference = TrueInterference::of(scene);
        true_interference.samples = samples;
        true_interference.shadow_db = self.shadow.unwrap_or_default();
        true_interference.velocity_mps = self.move_interferer.unwrap_or_default();
        true_interference.seed = setup.seed;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "10 to 1e5"
        )]
        let until = (self.listen_for.unwrap_or(120.0) * 1e3) as u64;
        true_interference.until = Instant::from_millis(until);
        setup.true_interference = Some(true_interference);
        Ok(())
    }

    /// Returns `mission` with its interferer moved to the position that it has at the time `then`. Without
    /// `--move-interferer`, returns `mission` unchanged.
    pub fn moved(&self, mission: Mission, then: Instant) -> Mission {
        let (Some([along, aside]), Some(source)) = (self.move_interferer, mission.known_source())
        else {
            return mission;
        };
        let seconds = then.as_micros() as f64 * 1e-6;
        let there = Interferer {
            x_m: narrow(f64::from(source.x_m) + along * seconds),
            y_m: narrow(f64::from(source.y_m) + aside * seconds),
            ..source
        };
        Mission::try_new(MissionConfig {
            interference: Interference::Source(there),
            ..*mission.config()
        })
        .unwrap_or(mission)
    }
}

fn velocity(text: &str) -> Result<[f64; 2], String> {
    let form = "must be VX,VY: the speed along the line and to its right, m/s, each -100 to 100";
    let (along, aside) = text.split_once(',').ok_or(form)?;
    let speed = |text: &str| quantity(text, -100.0, 100.0, "m/s");
    Ok([speed(along)?, speed(aside)?])
}
