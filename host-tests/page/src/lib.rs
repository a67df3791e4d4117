//! Functions that the page calls: a run of `cargo chain` with the same options, scenario and report.
//!
//! | function | arguments | result |
//! | --- | --- | --- |
//! | [`chain`] | options as on the command line, and a scenario | the report of `cargo chain --json`, and the recorded run |

// A microcontroller has no browser: `cargo build --target thumbv7em-none-eabihf --examples` leaves this package empty.
#![cfg(not(target_os = "none"))]

mod film;

use clap::Parser as _;
use serde::Serialize;
use serde_json::value::RawValue;
use uav_relay_command::{self as command, Failure};
use uav_relay_scenario::Scenario;
use uav_relay_sim::cli::{Options, Prepared, Refused};
use uav_relay_sim::simulator::setup::Setup;
use wasm_bindgen::prelude::wasm_bindgen;

use film::FilmTold;

const NAME: &str = "the page";

/// Number of simulator events after which the program checks that the run is not too long.
const HAPPENINGS: u64 = 20_000;

/// Maximum length of a run, s of virtual time. A longer run is an error, so that the page stays responsive.
const LONGEST_S: u64 = 3_600;

/// Result of a run in the page, as JSON: the report, the recording, and an error message.
#[derive(Serialize)]
struct RunOutput {
    /// Report of the run, with the same characters as the output of `cargo chain --json`.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<Box<RawValue>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<FilmTold>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong: Option<String>,
}

/// Runs a simulated chain and returns the result as one JSON object.
///
/// The object has up to three members: `report`; `film`, the recording, if the argument `film` is true; `wrong`, a line
/// of text with the error, if the run has failed.
///
/// `options` are separated by spaces as on the command line of `cargo chain`; `scenario` is TOML text.
#[wasm_bindgen]
#[must_use]
pub fn chain(options: &str, scenario: &str, film: bool) -> String {
    let told = run(options, scenario, film).unwrap_or_else(|failure| RunOutput {
        report: None,
        film: None,
        wrong: Some(failure.line),
    });
    serde_json::to_string(&told).unwrap_or_default()
}

fn run(options: &str, scenario: &str, film: bool) -> Result<RunOutput, Failure> {
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
            return Ok(RunOutput {
                wrong: line.or_else(|| report.error.clone()),
                report: Some(raw(&*report)?),
                film: None,
            });
        }
    };
    let setup = Setup {
        film,
        ..run.setup.clone()
    };
    let chain = run.fly(setup, |chain| {
        while !chain.step(HAPPENINGS) {
            if chain.progress().1.as_micros() > LONGEST_S * 1_000_000 {
                return Err(Failure::unmet(format!(
                    "the relays have not agreed on final positions after {LONGEST_S} s"
                )));
            }
        }
        Ok(())
    })?;
    let outcome = chain.finish();
    let report = run.report(&outcome);
    Ok(RunOutput {
        wrong: report.error.clone(),
        report: Some(raw(&report)?),
        film: film.then(|| FilmTold::of(&run, &outcome)),
    })
}

fn raw(report: &impl Serialize) -> Result<Box<RawValue>, Failure> {
    let text = command::json(report)?;
    RawValue::from_string(text.trim_end().to_owned())
        .map_err(|error| Failure::input(error.to_string()))
}
