//! What the programs of a chain need beside the scenario: which network they are, and where their ports and files are. It stands in sections of
//! the same file, `[network]`, `[companion]` and `[ground]`. Tools that fly nothing check them and go on.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Table;

use crate::check;
use crate::deployment_keys::SECTIONS;
use crate::error::{Problem, ScenarioError};

/// The number of the network where none is given: what every tool assumes, so that they agree.
pub const NETWORK: u16 = 1;

/// The sections; what a file leaves out is `None`, and the program's own default holds.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Deployment {
    /// What all members of the network share.
    pub network: Network,
    /// The companion of one drone.
    pub companion: Companion,
    /// The ground station.
    pub ground: Ground,
}

/// What all members of the network share.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Its number, 0 to 65535.
    pub id: Option<u16>,
    /// How many relays the chain has, 1 to 1000.
    pub relays: Option<u16>,
    /// The file with its key.
    pub key_file: Option<PathBuf>,
    /// How places are found: `align`, `joint` or `adjust`.
    pub method: Option<String>,
    /// Bit/s on its ports, 1200 to 4000000.
    pub baud: Option<u32>,
    /// After so many milliseconds of silence a neighbour is asked for a sign of life, 1 to 3600000.
    pub probe_after_ms: Option<u32>,
    /// After so many it counts as lost, 1 to 3600000.
    pub dead_after_ms: Option<u32>,
}

/// The companion of one drone. Paths in a file are relative to its folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Companion {
    /// Which relay it is, 1 to 1000.
    pub index: Option<u16>,
    /// The tty toward the transmitter.
    pub upstream: Option<PathBuf>,
    /// The tty toward the receiver.
    pub downstream: Option<PathBuf>,
    /// The tty to one channel that all relays hear, in place of both.
    pub shared: Option<PathBuf>,
    /// Where the number of its start is kept.
    pub epoch_file: Option<PathBuf>,
    /// Where the newest uploaded mission is kept.
    pub upload_file: Option<PathBuf>,
    /// Where its votes are kept.
    pub view_file: Option<PathBuf>,
    /// The autopilot: a tty, or a UDP address as [`Endpoint`](crate::endpoint::Endpoint) reads it.
    pub autopilot: Option<String>,
    /// Bit/s on its tty, 1200 to 4000000.
    pub autopilot_baud: Option<u32>,
    /// The file with the key that the autopilot signs with.
    pub autopilot_key_file: Option<PathBuf>,
    /// The drone's greatest speed, m/s, 0.1 to 20.
    pub speed_m_s: Option<f32>,
    /// The FIFO with positions.
    pub positions: Option<PathBuf>,
    /// How far off its place a hovering drone may be reported, m, 0 to 1000.
    pub position_error_m: Option<f32>,
    /// Whether its lines are JSON.
    pub json: Option<bool>,
    /// Where its lines go, in place of standard output.
    pub log_file: Option<PathBuf>,
    /// The socket that tells its counters.
    pub status_socket: Option<PathBuf>,
    /// Where what goes over its ports is written down.
    pub capture: Option<PathBuf>,
}

/// The ground station. Paths in a file are relative to its folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ground {
    /// The tty toward the chain.
    pub tty: Option<PathBuf>,
    /// Whether that leads to a channel that all relays hear.
    pub shared: Option<bool>,
    /// Which end of the chain it is: `tx` or `rx`.
    pub end: Option<String>,
    /// Where the number of its start is kept.
    pub epoch_file: Option<PathBuf>,
    /// Seconds after which it gives up, 1 to 86400.
    pub timeout_s: Option<u32>,
    /// Whether it stays at its post.
    pub stand: Option<bool>,
    /// Where it is told how strong the interference is: a FIFO, a file, or `udp:[HOST:]PORT`.
    pub measurements: Option<String>,
    /// Whether its lines are JSON.
    pub json: Option<bool>,
    /// Where its lines go, in place of standard output.
    pub log_file: Option<PathBuf>,
    /// The socket that tells its counters.
    pub status_socket: Option<PathBuf>,
    /// Where what goes over its port is written down.
    pub capture: Option<PathBuf>,
}

/// A file's table without the sections, and they.
pub(super) fn split(mut table: Table) -> (Table, Table) {
    let sections = SECTIONS
        .iter()
        .filter_map(|key| table.remove_entry(key.name))
        .collect();
    (table, sections)
}

/// The typed form of sections that [`check::table`] has passed.
pub(super) fn from_table(file: &str, sections: &Table) -> Result<Deployment, ScenarioError> {
    let sections = sections.clone();
    sections
        .try_into()
        .map_err(|error| check::unread(file, &error))
}

/// Refuses a `[network]` whose number of relays is not that of a plan.
///
/// # Errors
/// Names the key, its value and the number of the plan.
pub fn agree(file: &str, relays: Option<u16>, planned: Option<u16>) -> Result<(), ScenarioError> {
    match (relays, planned) {
        (Some(relays), Some(planned)) if relays != planned => Err(check::mistake(
            file,
            "network.relays",
            Some(relays.to_string()),
            Problem::OtherNumber,
            format!("{planned}, the number of relays of the plan; or leave network.relays out"),
        )),
        _ => Ok(()),
    }
}
