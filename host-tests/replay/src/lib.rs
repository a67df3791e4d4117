//! Replay of a recorded flight: one page with the screen, a time bar, and a report.
//!
//! | module | content |
//! | --- | --- |
//! | [`recording`] | frames of one capture file |
//! | [`clocks`] | frames of all files, by one clock |
//! | [`flight`] | snapshots, log and figures of the flight, from the relays' reports |
//! | [`page`](mod@page) | the page |

pub mod clocks;
pub mod flight;
pub mod page;
pub mod recording;

use std::path::{Path, PathBuf};

use uav_relay_scenario::Scenario;
use uav_relay_scenario::deployment::Deployment;
use uav_relay_scenario::mission::{mission, with_access};

use flight::{Flight, Loaded};
use recording::Recording;

/// Relative tolerance of the SIR in missions. It is the same in the Linux programs and the simulator.
const TOLERANCE: f64 = 1e-4;

/// Replay of a flight: its page, and warnings.
#[derive(Debug)]
pub struct Replay {
    /// Flight that the page shows.
    pub flight: Flight,
    /// Page as HTML.
    pub html: String,
    /// Warnings about the input files, one line each.
    pub warnings: Vec<String>,
}

/// Reads the captures `files` of one flight, and creates its page. The first file has the reference clock.
///
/// Without `scenario` the default scenario is used, if the relays report the digest of that scenario's mission.
/// Otherwise the mission is unknown.
///
/// # Errors
/// One line that names the file and the fault.
pub fn replay(files: &[PathBuf], scenario: Option<&Path>) -> Result<Replay, String> {
    let recordings: Result<Vec<Recording>, String> =
        files.iter().map(|file| Recording::load(file)).collect();
    let recordings = recordings?;
    let digest = recordings.iter().find_map(|it| it.mission);
    let clocks::Merged {
        frames,
        files,
        mut warnings,
    } = clocks::merge(recordings)?;
    let largest = flight::largest(&frames);
    if largest == 0 {
        let names: Vec<&str> = files.iter().map(|it| it.name.as_str()).collect();
        return Err(format!(
            "{}: no reports of relays: a ground station has to request them during the flight (linux_ground --web, cargo chain --watch)",
            names.join(", ")
        ));
    }
    let loaded = match scenario {
        Some(file) => {
            let (scenario, sections) = Deployment::load(file).map_err(|error| error.to_string())?;
            let planned = scenario.plan.as_ref().map(|plan| plan.uavs);
            let relays = sections.network.relays.or(planned).unwrap_or(largest);
            let name = file.display();
            let loaded =
                loaded(&scenario, relays, digest).map_err(|why| format!("{name}: {why}"))?;
            let loaded = loaded.ok_or_else(|| {
                let flown = digest.unwrap_or_default();
                format!("{name}: its mission of {relays} relays is not the one that the chain loaded (digest 0x{flown:04x})")
            })?;
            Some(Loaded {
                flying: sections.fleet.flying,
                ..loaded
            })
        }
        None => loaded(&Scenario::default(), largest, digest).ok().flatten(),
    };
    if loaded.is_none() {
        warnings.push(
            "mission unknown: give --scenario FILE for Rx, SIRs and the interferer".to_owned(),
        );
    }
    let relays = loaded.as_ref().map_or(largest, |it| it.mission.relays());
    let flight = Flight::new(&frames, relays, loaded.as_ref());
    let html = page::page(&flight, &files, &warnings);
    Ok(Replay {
        flight,
        html,
        warnings,
    })
}

/// Returns the scenario's mission with equal or fitted time slots, whichever has the digest `digest`.
///
/// `None` if neither has this digest. If `digest` is `None`, the mission has equal time slots.
fn loaded(scenario: &Scenario, relays: u16, digest: Option<u16>) -> Result<Option<Loaded>, String> {
    let (plain, profiles) =
        mission(scenario, relays, TOLERANCE).map_err(|error| error.to_string())?;
    let fitted = with_access(scenario, &plain).ok();
    let mut missions = [Some(plain), fitted].into_iter().flatten();
    let found = missions.find(|it| digest.is_none_or(|digest| it.digest() == digest));
    Ok(found.map(|mission| Loaded {
        mission,
        flying: None,
        profiles,
        axis: scenario.line.map(|line| line.axis),
    }))
}
