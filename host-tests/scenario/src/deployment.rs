//! Settings of a chain's programs beside the scenario: network, ports and files.
//!
//! They are sections `[network]`, `[companion]` and `[ground]` of the scenario file. Tools that do not fly only check them.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Table;

use super::keys::SECTIONS;
use crate::check;
use crate::error::{Problem, ScenarioError};

/// Default network number of all tools.
pub const NETWORK: u16 = 1;

/// Sections of the file; a missing value is `None`, and the program's default applies.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Deployment {
    /// Settings that all members of the network share.
    pub network: Network,
    /// Companion computer of one drone.
    pub companion: Companion,
    /// Ground station.
    pub ground: Ground,
}

/// Settings that all members of the network share.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Network number, 0 to 65535.
    pub id: Option<u16>,
    /// Number of relays in the chain, 1 to 1000.
    pub relays: Option<u16>,
    /// File with the network key.
    pub key_file: Option<PathBuf>,
    /// Placement method: `align`, `joint` or `adjust`.
    pub method: Option<String>,
    /// Data rate of the ports, bit/s, 1200 to 4000000.
    pub baud: Option<u32>,
    /// Silence before a neighbour is probed, ms, 1 to 3600000.
    pub probe_after_ms: Option<u32>,
    /// Silence after which a neighbour is lost, ms, 1 to 3600000.
    pub dead_after_ms: Option<u32>,
}

/// Companion computer of one drone. Paths in a file are relative to its folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Companion {
    /// Index of its relay, 1 to 1000.
    pub index: Option<u16>,
    /// Serial port toward the transmitter.
    pub upstream: Option<PathBuf>,
    /// Serial port toward the receiver.
    pub downstream: Option<PathBuf>,
    /// Serial port to a channel that all relays share, in place of both.
    pub shared: Option<PathBuf>,
    /// File with the persisted epoch.
    pub epoch_file: Option<PathBuf>,
    /// File with the newest uploaded mission.
    pub upload_file: Option<PathBuf>,
    /// File with the persisted votes on views.
    pub view_file: Option<PathBuf>,
    /// Autopilot: a serial port, or a UDP address as parsed by [`Endpoint`](crate::endpoint::Endpoint).
    pub autopilot: Option<String>,
    /// Data rate of the autopilot's serial port, bit/s, 1200 to 4000000.
    pub autopilot_baud: Option<u32>,
    /// File with the key that the autopilot signs with.
    pub autopilot_key_file: Option<PathBuf>,
    /// Greatest speed of the drone, m/s, 0.1 to 20.
    pub speed_m_s: Option<f32>,
    /// FIFO with positions.
    pub positions: Option<PathBuf>,
    /// Largest reported position error of a hovering drone, m, 0 to 1000.
    pub position_error_m: Option<f32>,
    /// True for log lines in JSON.
    pub json: Option<bool>,
    /// Log file in place of standard output.
    pub log_file: Option<PathBuf>,
    /// Socket that reports counters.
    pub status_socket: Option<PathBuf>,
    /// Capture file for the traffic on its ports.
    pub capture: Option<PathBuf>,
}

/// Ground station. Paths in a file are relative to its folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ground {
    /// Serial port toward the chain.
    pub tty: Option<PathBuf>,
    /// True if the port leads to a channel that all relays share.
    pub shared: Option<bool>,
    /// End of the chain: `tx` or `rx`.
    pub end: Option<String>,
    /// File with the persisted epoch.
    pub epoch_file: Option<PathBuf>,
    /// Time limit, s, 1 to 86400.
    pub timeout_s: Option<u32>,
    /// True to keep running as an end of the chain.
    pub stand: Option<bool>,
    /// Source of interference measurements: a FIFO, a file, or `udp:[HOST:]PORT`.
    pub measurements: Option<String>,
    /// True for log lines in JSON.
    pub json: Option<bool>,
    /// Log file in place of standard output.
    pub log_file: Option<PathBuf>,
    /// Socket that reports counters.
    pub status_socket: Option<PathBuf>,
    /// Capture file for the traffic on its port.
    pub capture: Option<PathBuf>,
}

pub(super) fn split(mut table: Table) -> (Table, Table) {
    let sections = SECTIONS
        .iter()
        .filter_map(|key| table.remove_entry(key.name))
        .collect();
    (table, sections)
}

/// Converts sections that [`check::table`] has accepted.
pub(super) fn from_table(file: &str, sections: &Table) -> Result<Deployment, ScenarioError> {
    let sections = sections.clone();
    sections
        .try_into()
        .map_err(|error| check::unread(file, &error))
}

/// Rejects a `[network]` whose number of relays differs from a plan's.
///
/// # Errors
/// Names the key, its value and the plan's number.
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
