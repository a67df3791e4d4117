//! Checks section `[network]` of a file against the options.

use std::path::Path;

use clap::ValueEnum as _;
use uav_relay_scenario::deployment::Network;
use uav_relay_sim::command;

use super::options::{Method, Options};

/// Reports options that override the section. Nobody then relies on a value in the file that is not used.
pub(super) fn overridden(
    options: &Options,
    section: &Network,
    key_file: Option<&Path>,
    name: &str,
) {
    let say = |option: &str, key: &str| {
        command::complain(&format!("{option} replaces network.{key} of {name}"));
    };
    if let (Some(given), Some(own)) = (options.probe_after_ms, section.probe_after_ms)
        && given != own
    {
        say(
            &format!("--probe-after-ms {given}"),
            &format!("probe_after_ms = {own}"),
        );
    }
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

/// Returns the method of the command line or plan, else of section `network`, else `align`.
///
/// Rejects a plan made with a method other than the section's; reports an option that overrides the section.
pub(super) fn method(
    method: Option<Method>,
    of_file: Option<&str>,
    name: &str,
    is_planned: bool,
) -> Result<Method, String> {
    let Some(text) = of_file else {
        return Ok(method.unwrap_or(Method::Align));
    };
    // The scenario has already been checked.
    let own = Method::from_str(text, false).unwrap_or(Method::Align);
    match method {
        Some(method) if method != own => {
            let said = format!("{method:?}").to_lowercase();
            if is_planned {
                return Err(format!(
                    "{name}: network.method = \"{text}\": must be \"{said}\", as its [plan] has it, or plan again"
                ));
            }
            command::complain(&format!(
                "--method {said} replaces network.method = \"{text}\" of {name}"
            ));
            Ok(method)
        }
        _ => Ok(own),
    }
}
