//! Settings of the programs in a chain, apart from the scenario: network, ports and files.
//!
//! They are the sections `[network]`, `[fleet]`, `[companion]` and `[ground]` of the scenario file. Tools that do not
//! fly only check them.

use std::path::PathBuf;

use serde::Deserialize;
use toml::Table;

use super::keys::SECTIONS;
use crate::Scenario;
use crate::check::{self, mistake};
use crate::error::{Problem, ScenarioError};
use crate::fleet::FleetSize;

/// Default network number of all programs. Relays ignore frames with any other network number.
pub const NETWORK: u16 = 1;

/// Relative tolerance of the target SIR on companion computers. No option changes it.
pub const COMPANION_TOLERANCE: f64 = 1e-4;

/// Settings of the programs, from a scenario file: `[network]`, `[fleet]`, `[companion]`, `[ground]`.
///
/// If a value is `None`, the program uses its default.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Deployment {
    /// Section `[network]`: settings that all members of the network share.
    pub network: Network,
    /// Section `[fleet]`: replacement of drones whose batteries run low.
    pub fleet: Fleet,
    /// Section `[companion]`: the companion computer of one drone.
    pub companion: Companion,
    /// Section `[ground]`: the ground station.
    pub ground: Ground,
}

/// Section `[network]` of a scenario file: settings that all members of the network share.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Network {
    /// Network number, 0 to 65535. Relays ignore frames with any other number.
    pub id: Option<u16>,
    /// Number of relays, 1 to 1000. With `fleet.flying` it is the number of drones of the fleet.
    pub relays: Option<u16>,
    /// File with the secret key that signs the frames of the network.
    pub key_file: Option<PathBuf>,
    /// Placement method: `align`, `joint` or `adjust`.
    pub method: Option<String>,
    /// Data rate of the serial ports between relays, bit/s, 1200 to 4000000.
    pub baud: Option<u32>,
    /// Silence of a neighbour after which the relay requests a heartbeat, ms, 1 to 3600000.
    pub probe_after_ms: Option<u32>,
    /// Silence after which a neighbour counts as lost, ms, 1 to 3600000.
    pub dead_after_ms: Option<u32>,
}

/// Section `[fleet]` of a scenario file: replacement of drones whose batteries run low.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Fleet {
    /// Number of relays that the leader keeps in the chain while spares wait, 1 to 1000. More than half of
    /// `network.relays`, and at most all of them.
    pub flying: Option<u16>,
    /// Duration of the motion to newly agreed positions, s, 0 to 3600. At most four times `network.dead_after_ms`.
    pub respacing_s: Option<f32>,
}

/// Section `[companion]` of a scenario file: the companion computer of one drone. Paths are relative to the file's
/// folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Companion {
    /// Index of this drone's relay, 1 to 1000; relay 1 is next to Tx.
    pub index: Option<u16>,
    /// Serial port of the link to the neighbour toward the transmitter.
    pub upstream: Option<PathBuf>,
    /// Serial port of the link to the neighbour toward the receiver.
    pub downstream: Option<PathBuf>,
    /// Serial port of a radio channel that all relays share. This port replaces `upstream` and `downstream`.
    pub shared: Option<PathBuf>,
    /// File that stores the epoch: a start counter that protects against replayed frames.
    pub epoch_file: Option<PathBuf>,
    /// File that stores the newest mission that was uploaded to the relay.
    pub upload_file: Option<PathBuf>,
    /// File that stores the relay's votes on views (memberships of the chain).
    ///
    /// Because of this file, a relay that has voted before a reboot does not vote again after the reboot.
    pub view_file: Option<PathBuf>,
    /// Autopilot: a serial port, or a UDP address as parsed by [`Endpoint`](crate::endpoint::Endpoint).
    pub autopilot: Option<String>,
    /// Data rate of the autopilot's serial port, bit/s, 1200 to 4000000.
    pub autopilot_baud: Option<u32>,
    /// File with the key that signs the MAVLink messages exchanged with the autopilot.
    pub autopilot_key_file: Option<PathBuf>,
    /// Greatest speed of the drone, m/s, 0.1 to 20.
    pub speed_m_s: Option<f32>,
    /// Flight time that the drone keeps as a reserve, s, 0 to 3600. With `None` the relay never leaves the chain by
    /// itself.
    pub reserve_s: Option<f32>,
    /// Flight time with a full battery, s, 1 to 21600.
    pub flight_time_s: Option<f32>,
    /// Speed of the drone during its return home, m/s, 0.1 to 20.
    pub return_speed_m_s: Option<f32>,
    /// Mean speed of descent for landing, m/s, 0.1 to 20.
    pub descent_m_s: Option<f32>,
    /// True if the relay is a spare: it waits outside of the chain until the leader calls it.
    pub spare: Option<bool>,
    /// FIFO to which a different program writes the drone's position.
    pub positions: Option<PathBuf>,
    /// Largest position error of a hovering drone, m, 0 to 1000.
    pub position_error_m: Option<f32>,
    /// True for log lines in JSON.
    pub json: Option<bool>,
    /// Log file of the companion; `None` for standard output.
    pub log_file: Option<PathBuf>,
    /// Unix socket at which the companion reports its status and counters.
    pub status_socket: Option<PathBuf>,
    /// File that captures the traffic on the companion's ports.
    pub capture: Option<PathBuf>,
}

/// Section `[ground]` of a scenario file: the ground station. Paths are relative to the file's folder.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Ground {
    /// Serial port of the link from the ground station to the chain.
    pub tty: Option<PathBuf>,
    /// True if the port leads to a channel that all relays share.
    pub shared: Option<bool>,
    /// End of the chain at which the ground station stands: `tx` (transmitter) or `rx` (receiver).
    pub end: Option<String>,
    /// File that stores the epoch, a start counter that prevents replays of frames from earlier starts.
    pub epoch_file: Option<PathBuf>,
    /// Time after which the ground station gives up an upload, s, 1 to 86400.
    pub timeout_s: Option<u32>,
    /// True if the ground station continues to run after an upload; false if it exits after the upload.
    pub stand: Option<bool>,
    /// Source of interference measurements: a FIFO, a file, or `udp:[HOST:]PORT`.
    pub measurements: Option<String>,
    /// Address and port at which a page shows the chain in a browser.
    pub web: Option<String>,
    /// File with the password of the ground station's web page.
    pub web_password: Option<PathBuf>,
    /// PMTiles archive with pictures of a map for the ground station's web page.
    pub tiles: Option<PathBuf>,
    /// True for log lines in JSON.
    pub json: Option<bool>,
    /// Log file of the ground station, in place of its standard output.
    pub log_file: Option<PathBuf>,
    /// Unix socket at which the ground station reports its status and counters.
    pub status_socket: Option<PathBuf>,
    /// File that captures the traffic on the ground station's port.
    pub capture: Option<PathBuf>,
}

pub(super) fn split(mut table: Table) -> (Table, Table) {
    let sections = SECTIONS
        .iter()
        .filter_map(|key| table.remove_entry(key.name))
        .collect();
    (table, sections)
}

/// Converts the `[network]`, `[fleet]`, `[companion]` and `[ground]` tables of a file to their types.
///
/// [`check::table`] must have accepted the tables before.
pub(super) fn from_table(file: &str, sections: &Table) -> Result<Deployment, ScenarioError> {
    let sections = sections.clone();
    let sections: Deployment = sections
        .try_into()
        .map_err(|error| check::internal_mismatch(file, &error))?;
    sections.check_fleet(file)?;
    Ok(sections)
}

impl Deployment {
    /// Returns the numbers of relays in the fleet and in the chain; `None` without `network.relays`.
    pub fn fleet_size(&self) -> Option<FleetSize> {
        let relays = self.network.relays?;
        let flying = self.fleet.flying.unwrap_or(relays);
        Some(FleetSize { relays, flying })
    }

    /// Returns the error `problem` of the number of relays in the chain.
    ///
    /// Its key is `fleet.flying`, or `network.relays` if `fleet.flying` is not given.
    fn size_error(&self, file: &str, problem: Problem, allowed: String) -> ScenarioError {
        let (key, value) = match self.fleet.flying {
            Some(flying) => ("fleet.flying", Some(flying)),
            None => ("network.relays", self.network.relays),
        };
        mistake(file, key, value.map(|it| it.to_string()), problem, allowed)
    }

    /// Checks that a number of relays that fly suits the number of all relays, and their ports.
    fn check_fleet(&self, file: &str) -> Result<(), ScenarioError> {
        let Some(flying) = self.fleet.flying else {
            return Ok(());
        };
        let Some(relays) = self.network.relays else {
            let allowed = "1 to 1000, the number of drones of which fleet.flying fly".to_owned();
            return Err(mistake(
                file,
                "network.relays",
                None,
                Problem::Missing,
                allowed,
            ));
        };
        let least = relays / 2 + 1;
        if !(least..=relays).contains(&flying) {
            let allowed = format!("{least} to {relays}, more than half of network.relays");
            return Err(self.size_error(file, Problem::OutOfRange, allowed));
        }
        let Companion {
            upstream,
            downstream,
            ..
        } = &self.companion;
        if upstream.is_some() || downstream.is_some() {
            let allowed = "companion.shared in place of upstream and downstream, because spares join only on a channel that all relays share; or leave fleet.flying out".to_owned();
            return Err(self.size_error(file, Problem::NeedsChannel, allowed));
        }
        Ok(())
    }

    /// Checks that no `[[relay]]` of `scenario` differs from the others, if the fleet has spares.
    ///
    /// Any relay of such a fleet may fly, so its positions are known before flight only for identical relays.
    ///
    /// # Errors
    /// The error names `fleet.flying`, its value and the remedy.
    pub fn check_identical(&self, file: &str, scenario: &Scenario) -> Result<(), ScenarioError> {
        let has_spares = self.fleet_size().is_some_and(|it| it.flying < it.relays);
        if !has_spares || scenario.relays.is_empty() {
            return Ok(());
        }
        let allowed =
            "identical relays, because each of them may fly: leave [[relay]] out, or fleet.flying"
                .to_owned();
        Err(self.size_error(file, Problem::RelaysDiffer, allowed))
    }

    /// Checks that the chain and `[plan]` have the same number of relays, if both numbers are given.
    ///
    /// The chain has `fleet.flying` relays, or else `network.relays`.
    ///
    /// # Errors
    /// The error names the key, its value and the plan's number of relays.
    pub fn check_plan(&self, file: &str, planned: Option<u16>) -> Result<(), ScenarioError> {
        match (self.fleet_size(), planned) {
            (Some(size), Some(planned)) if size.flying != planned => {
                let allowed =
                    format!("{planned}, the number of relays in [plan]; or leave the key out");
                Err(self.size_error(file, Problem::OtherNumber, allowed))
            }
            _ => Ok(()),
        }
    }
}
