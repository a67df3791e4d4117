//! What the section `[network]` of a file says, held against the options, and against what the firmware can be told.

use std::path::Path;

use clap::ValueEnum as _;
use uav_relay::{Duration, Settings};
use uav_relay_scenario::deployment::Network;
use uav_relay_sim::command;
use uav_relay_tools::provision::config::{BAUD, MOST_PROBE_AFTER_MS};

use super::options::{Method, Options};

/// After which silence relays ask a neighbour for a sign of life, and after which that counts as lost; `probe_after_ms` is 0 for the usual
/// ones.
pub(super) fn silence(probe_after_ms: u32) -> [Duration; 2] {
    let Settings {
        probe_after,
        dead_after,
        ..
    } = Settings::default();
    match u64::from(probe_after_ms) {
        0 => [probe_after, dead_after],
        ms => [ms, 3 * ms].map(Duration::from_millis),
    }
}

/// Refuses what a block cannot say, where it is not what the firmware does anyway; `given_ms` is the silence of the command line. Returns the
/// milliseconds of silence after which relays ask, 0 for the usual ones.
///
/// # Errors
/// One line that names the key, its value and the one that is allowed.
pub(super) fn of_the_firmware(
    section: &Network,
    given_ms: Option<u32>,
    name: &str,
) -> Result<u32, String> {
    let refuse = |key: &str, value: u32, own: u32, why: &str| {
        format!(
            "{name}: network.{key} = {value}: must be {own}, or left out: {why}, and no block changes it"
        )
    };
    let ms = |time: Duration| u32::try_from(time.as_micros() / 1_000).unwrap_or(u32::MAX);
    if let Some(baud) = section.baud.filter(|baud| *baud != BAUD) {
        let line = refuse("baud", baud, BAUD, "the firmware's ports run at that");
        return Err(format!("{line}; a radio's own data rate is --baud"));
    }
    if let (Some(given), Some(own)) = (given_ms, section.probe_after_ms)
        && given != own
    {
        command::complain(&format!(
            "--probe-after-ms {given} counts, and not network.probe_after_ms = {own} of {name}"
        ));
    }
    let probe_after_ms = given_ms.or(section.probe_after_ms).unwrap_or(0);
    if probe_after_ms > MOST_PROBE_AFTER_MS {
        return Err(format!(
            "{name}: network.probe_after_ms = {probe_after_ms}: must be within 1 to {MOST_PROBE_AFTER_MS}"
        ));
    }
    let [_, dead_after] = silence(probe_after_ms);
    let dead = ms(dead_after);
    let own = section.dead_after_ms.filter(|_| given_ms.is_none());
    if let Some(after) = own.filter(|after| *after != dead) {
        let why = "three times probe_after_ms, as the firmware has it";
        return Err(refuse("dead_after_ms", after, dead, why));
    }
    // What the firmware does anyway is the same block.
    let [usual, _] = silence(0);
    let is_usual = Duration::from_millis(probe_after_ms.into()) == usual;
    Ok(if is_usual { 0 } else { probe_after_ms })
}

/// Says what options say otherwise than the section: nobody is to write blocks by a file that does not count unawares.
pub(super) fn overridden(
    options: &Options,
    section: &Network,
    key_file: Option<&Path>,
    name: &str,
) {
    let say = |option: &str, key: &str| {
        command::complain(&format!("{option} counts, and not network.{key} of {name}"));
    };
    if let (Some(own), Some(id)) = (options.network, section.id)
        && own != id
    {
        say(&format!("--network {own}"), &format!("id = {id}"));
    }
    if let (Some(own), Some(relays)) = (options.uavs, section.relays)
        && own != relays
    {
        say(&format!("--uavs {own}"), &format!("relays = {relays}"));
    }
    if let (Some(own), Some(file)) = (&options.key_file, key_file)
        && own != file
    {
        let key = format!("key_file = \"{}\"", file.display());
        say(&format!("--key-file {}", own.display()), &key);
    }
}

/// The method: that of the command line or of a plan, else that of section `network`, else `align`. A plan that was made by another one than
/// the section's is refused; what the command line says otherwise is said.
pub(super) fn method(
    method: Option<Method>,
    of_file: Option<&str>,
    name: &str,
    is_planned: bool,
) -> Result<Method, String> {
    let Some(text) = of_file else {
        return Ok(method.unwrap_or(Method::Align));
    };
    // The scenario has checked it.
    let own = Method::from_str(text, false).unwrap_or(Method::Align);
    match method {
        Some(method) if method != own => {
            let said = format!("{method:?}").to_lowercase();
            if is_planned {
                return Err(format!(
                    "{name}: network.method = \"{text}\": must be \"{said}\", as its [plan] has it, or plan anew"
                ));
            }
            command::complain(&format!(
                "--method {said} counts, and not network.method = \"{text}\" of {name}"
            ));
            Ok(method)
        }
        _ => Ok(own),
    }
}
