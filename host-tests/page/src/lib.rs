//! What the page calls: a run of `cargo chain`, by the same options and the same scenario, with the same report.
//!
//! | function | takes | gives |
//! | --- | --- | --- |
//! | [`chain`] | options as on the command line, and a scenario | the report of `cargo chain --json`, and where all were meanwhile |

// On a microcontroller there is no browser: a plain `cargo build --target thumbv7em-none-eabihf --examples` leaves this package empty.
#![cfg(not(target_os = "none"))]

use clap::Parser as _;
use serde::Serialize;
use serde_json::value::RawValue;
use uav_relay::sensing::belief::Belief;
use uav_relay_command::{self as command, Failure};
use uav_relay_scenario::Scenario;
use uav_relay_sim::cli::{Options, Prepared, Refused};
use uav_relay_sim::simulator::sky::Stand;
use wasm_bindgen::prelude::wasm_bindgen;

/// How messages call the scenario of the page.
const NAME: &str = "the page";

/// Happenings of the simulator from one look at its clock to the next.
const HAPPENINGS: u64 = 20_000;

/// A run that takes longer, s of virtual time, is given up: a page that does not answer helps nobody.
const LONGEST_S: u64 = 3_600;

/// What the page is told.
#[derive(Serialize)]
struct Told {
    /// What `cargo chain --json` prints, character by character.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Box<RawValue>>,
    /// Where all were while relays listened.
    stands: Vec<StandTold>,
    /// What is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong: Option<String>,
}

/// Where all were at some time.
#[derive(Serialize)]
struct StandTold {
    /// When, s.
    at_s: f64,
    /// Of each relay, m: along the line, to its right, above ground.
    places: Vec<[f32; 3]>,
    /// The interferer that is believed in: W, m, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    believed: Option<[f32; 3]>,
}

impl StandTold {
    fn of(stand: &Stand) -> Self {
        let place = |at: &uav_relay::Placement| [at.x_m, at.y_m, at.altitude_m];
        Self {
            at_s: stand.at.as_micros() as f64 / 1e6,
            places: stand.places.iter().map(place).collect(),
            believed: match stand.believed.belief {
                Belief::Source { source, .. } => Some([source.power_w, source.x_m, source.y_m]),
                _ => None,
            },
        }
    }
}

/// Runs a chain by `options`, separated by spaces as on the command line of `cargo chain`, in the scenario of that TOML text, and gives what
/// the page is told as JSON: `report`, `stands`, and `wrong` with one line where something is wrong.
#[wasm_bindgen]
#[must_use]
pub fn chain(options: &str, scenario: &str) -> String {
    let told = run(options, scenario).unwrap_or_else(|failure| Told {
        report: None,
        stands: Vec::new(),
        wrong: Some(failure.line),
    });
    serde_json::to_string(&told).unwrap_or_default()
}

fn run(options: &str, scenario: &str) -> Result<Told, Failure> {
    let words = core::iter::once("chain").chain(options.split_whitespace());
    let options =
        Options::try_parse_from(words).map_err(|error| Failure::input(error.to_string()))?;
    let scenario =
        Scenario::parse(NAME, scenario).map_err(|error| Failure::input(error.to_string()))?;
    let mut run = match Prepared::new(&options, scenario, Some(NAME)) {
        Ok(run) => run,
        Err(Refused::Failed(failure)) => return Err(failure),
        Err(Refused::Reported(report, failure)) => {
            let line = failure.map(|failure| failure.line);
            return Ok(Told {
                wrong: line.or_else(|| report.error.clone()),
                report: Some(raw(&*report)?),
                stands: Vec::new(),
            });
        }
    };
    let chain = run.fly(run.setup.clone(), |chain| {
        while !chain.step(HAPPENINGS) {
            if chain.progress().1.as_micros() > LONGEST_S * 1_000_000 {
                return Err(Failure::unmet(format!(
                    "the chain has not settled after {LONGEST_S} s"
                )));
            }
        }
        Ok(())
    })?;
    let outcome = chain.finish();
    let report = run.report(&outcome);
    Ok(Told {
        wrong: report.error.clone(),
        report: Some(raw(&report)?),
        stands: outcome.stands.iter().map(StandTold::of).collect(),
    })
}

/// As the command prints it.
fn raw(report: &impl Serialize) -> Result<Box<RawValue>, Failure> {
    let text = command::json(report)?;
    RawValue::from_string(text.trim_end().to_owned())
        .map_err(|error| Failure::input(error.to_string()))
}
