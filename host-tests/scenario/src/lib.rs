//! The scenario file of the host tools: what is agreed about the flight before any relay takes off.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`Scenario`] | a scenario file, read and checked |
//! | [`mission`] | from a scenario to the mission that relays fly |
//! | [`scene`], [`hypothetical`] | several interferers whose powers add up, and the one that stands for them |
//! | [`deployment`] | what the programs of a chain need beside the scenario, in sections of the same file |
//! | [`endpoint`] | the UDP address of an autopilot |
//! | [`key`] | the network's key, or an autopilot's, from a file |
//! | [`number`] | from the f64 of files to the f32 of relays |
//!
//! A file is read in three passes, each with one job: `check` compares its shape, its keys, their types and every range with the table in
//! `keys`; serde makes typed values of them; `file` checks what only several keys together can break.
//! Whatever is wrong comes back as a [`ScenarioError`], one line that names the file, the key, the value and
//! what is allowed.

mod check;
pub mod deployment;
mod deployment_keys;
pub mod endpoint;
mod error;
mod file;
pub mod hypothetical;
mod interferer;
pub mod key;
mod keys;
pub mod mission;
pub mod number;
mod plan;
mod power;
mod read;
pub mod scene;
mod site;
mod spec;

use std::path::Path;

pub use error::{Problem, ScenarioError};
pub use keys::all as keys;
pub use plan::{Planned, PlannedMethod, PlannedPlace};
pub use spec::{
    AirGround, BetaPoint, ChannelSpec, Field, Interference, Line, ListenSpec, Noise, RelayOverride,
    Scenario, Source,
};

/// The default scenario, as a file.
pub const DEFAULT: &str = include_str!("default.toml");

impl Scenario {
    /// Reads a scenario file of at most 1 MiB.
    ///
    /// # Errors
    /// A file that cannot be read as text, or any of the mistakes of [`Scenario::parse`].
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        let text = read::text_of(path)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Reads a scenario from TOML text; `file_name` only serves the error message.
    ///
    /// # Errors
    /// The first mistake found: TOML that does not parse, an unknown or missing key, a value of the wrong type or
    /// out of its range (NaN and infinities are out of every range), or keys that contradict each other.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let table = read::table_of(file_name, text)?;
        check::table(file_name, &table)?;
        let (scenario, sections) = deployment::split(table);
        // Other programs use them; a mistake in one is a mistake here, too.
        deployment::from_table(file_name, &sections)?;
        let raw = file::from_table(file_name, &scenario)?;
        file::build(file_name, raw)
    }
}

impl deployment::Deployment {
    /// Reads both parts of a file: the scenario, and the sections.
    ///
    /// # Errors
    /// As [`Scenario::load`], and a number of relays in `[network]` that is not that of `[plan]`.
    pub fn load(path: &Path) -> Result<(Scenario, Self), ScenarioError> {
        let (name, text) = (path.display().to_string(), read::text_of(path)?);
        let scenario = Scenario::parse(&name, &text)?;
        let sections = Self::parse(&name, &text)?;
        let planned = scenario.plan.as_ref().map(|plan| plan.uavs);
        deployment::agree(&name, sections.network.relays, planned)?;
        Ok((scenario, sections))
    }

    /// Reads the sections of a file whose plan is about to be replaced; `file_name` only serves the error message.
    ///
    /// # Errors
    /// TOML that does not parse, and any mistake in a section.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let table = read::table_of(file_name, text)?;
        check::table(file_name, &table)?;
        let (_, sections) = deployment::split(table);
        deployment::from_table(file_name, &sections)
    }
}
