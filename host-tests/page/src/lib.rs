//! What the page calls: a run of `cargo chain`, by the same options and the same scenario, with the same report.
//!
//! | function | takes | gives |
//! | --- | --- | --- |
//! | [`chain`] | options as on the command line, and a scenario | the report of `cargo chain --json`, and the run from its beginning to its end |

// On a microcontroller there is no browser: a plain `cargo build --target thumbv7em-none-eabihf --examples` leaves this package empty.
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
    /// What is played.
    #[serde(skip_serializing_if = "Option::is_none")]
    film: Option<FilmTold>,
    /// What is wrong.
    #[serde(skip_serializing_if = "Option::is_none")]
    wrong: Option<String>,
}

/// Runs a chain by `options`, separated by spaces as on the command line of `cargo chain`, in the scenario of that TOML text, and gives what
/// the page is told as JSON: `report`; `film` where that is asked for; and `wrong` with one line where something is wrong.
#[wasm_bindgen]
#[must_use]
pub fn chain(options: &str, scenario: &str, film: bool) -> String {
    let told = run(options, scenario, film).unwrap_or_else(|failure| Told {
        report: None,
        film: None,
        wrong: Some(failure.line),
    });
    serde_json::to_string(&told).unwrap_or_default()
}

fn run(options: &str, scenario: &str, film: bool) -> Result<Told, Failure> {
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
        film: film.then(|| FilmTold::of(&run, &outcome)),
    })
}

/// As the command prints it.
fn raw(report: &impl Serialize) -> Result<Box<RawValue>, Failure> {
    let text = command::json(report)?;
    RawValue::from_string(text.trim_end().to_owned())
        .map_err(|error| Failure::input(error.to_string()))
}
