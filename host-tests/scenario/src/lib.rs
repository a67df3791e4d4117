//! Scenario files of the host tools: the parameters of a flight that are known before take-off.
//!
//! | module | content |
//! | --- | --- |
//! | [`Scenario`] | a scenario file, read and checked |
//! | [`area`] | areas of interferers and no-fly areas |
//! | [`mission`] | the mission that relays fly in a scenario |
//! | [`scene`], [`hypothetical`] | several interferers whose powers add up, and the hypothetical one that replaces them |
//! | [`deployment`] | settings of a chain's programs, in sections of the same file |
//! | [`fleet`] | fleets with more relays than their chain: first chain and spares |
//! | [`endpoint`] | UDP address of an autopilot |
//! | [`key`] | secret keys, from files |
//! | [`number`] | conversion from the f64 of files to the f32 of relays |
//!
//! A file is read in three steps: `check` compares its shape, keys, types and ranges with the table in `keys`; serde
//! converts it to typed values; `file` checks conditions on several keys. Mistakes are reported as a [`ScenarioError`],
//! one line that names the file, the key, the value and the allowed values.

pub mod area;
mod check;
pub mod deployment;
pub mod endpoint;
mod error;
mod file;
pub mod fleet;
pub mod hypothetical;
pub mod key;
mod keys;
pub mod link;
pub mod mission;
pub mod number;
pub mod scene;
mod spec;

use std::path::Path;

pub use error::{Problem, ScenarioError};
pub use keys::all as keys;
pub use spec::{
    AirGround, BetaPoint, ChannelSpec, Field, Interference, Line, ListenSpec, Noise, Planned,
    PlannedMethod, PlannedPlace, RelayOverride, Scenario, Source, TerrainSpec,
};

/// Text of the scenario file that tools use by default, as TOML.
pub const DEFAULT: &str = include_str!("default.toml");

impl Scenario {
    /// Reads a scenario file of at most 1 MiB.
    ///
    /// # Errors
    /// If the file cannot be read as text, or has a mistake that [`Scenario::parse`] rejects.
    pub fn load(path: &Path) -> Result<Self, ScenarioError> {
        let text = check::text_of(path)?;
        Self::parse(&path.display().to_string(), &text)
    }

    /// Parses a scenario from TOML text; `file_name` is used only in error messages.
    ///
    /// # Errors
    /// The first mistake found: invalid TOML, an unknown or missing key, a value of the wrong type or out of its range,
    /// or keys that contradict each other. NaN and infinities are out of every range.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let table = check::table_of(file_name, text)?;
        check::table(file_name, &table)?;
        let (scenario, sections) = deployment::split(table);
        // Other programs use the sections, but a mistake in one is reported here too.
        deployment::from_table(file_name, &sections)?;
        let raw = file::from_table(file_name, &scenario)?;
        file::build(file_name, raw)
    }
}

impl deployment::Deployment {
    /// Reads a scenario file: the scenario, and the settings of the programs.
    ///
    /// # Errors
    /// If [`Scenario::load`] rejects the file, if one of the four sections has a mistake, or if the numbers of relays in
    /// the chain and in `[plan]` differ.
    pub fn load(path: &Path) -> Result<(Scenario, Self), ScenarioError> {
        let (name, text) = (path.display().to_string(), check::text_of(path)?);
        let scenario = Scenario::parse(&name, &text)?;
        let sections = Self::parse(&name, &text)?;
        let planned = scenario.plan.as_ref().map(|plan| plan.uavs);
        sections.check_plan(&name, planned)?;
        Ok((scenario, sections))
    }

    /// Parses only the settings in `[network]`, `[fleet]`, `[companion]` and `[ground]` of a scenario file.
    ///
    /// Unlike [`Self::load`], it accepts a number of relays in the chain that differs from the number in `[plan]`.
    /// `file_name` is used only in error messages.
    ///
    /// # Errors
    /// If the text is not valid TOML, or if a section has a mistake.
    pub fn parse(file_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let table = check::table_of(file_name, text)?;
        check::table(file_name, &table)?;
        let (_, sections) = deployment::split(table);
        deployment::from_table(file_name, &sections)
    }
}
