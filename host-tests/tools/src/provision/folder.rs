//! Writes the blocks of a whole flight into one folder: all of them, or none.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;
use uav_relay::{Placement, Profile};
use uav_relay_scenario::Line;
use uav_relay_scenario::fleet::FleetSize;

use super::config::ADDRESS;

/// Returns the file name of relay `index`'s configuration block.
pub fn name(index: u16) -> String {
    format!("relay{index}.bin")
}

/// Writes `files`, each a name and content, to the folder `dir`. Creates `dir` if necessary.
///
/// With `force`, existing files are overwritten. Configuration blocks in the folder that are not in `files` are
/// removed, because a drone would accept a block of an earlier flight. Temporary files are written first, and renamed
/// at the end. If an error occurs before, the folder is unchanged.
///
/// # Errors
/// A text that names the file or folder and the reason.
pub fn write(dir: &Path, files: &[(String, Vec<u8>)], force: bool) -> Result<(), String> {
    let old = there(dir, files)?;
    if let Some(first) = old.first()
        && !force
    {
        return Err(format!(
            "--out-dir {}: {} exists already; --force overwrites it, and removes the blocks of other relays in the folder",
            dir.display(),
            first.file_name().unwrap_or_default().to_string_lossy()
        ));
    }
    let is_new = !dir.exists();
    let failed = |what: &Path, error: std::io::Error| {
        if is_new {
            // Removes the folder, if it was created here.
            _ = std::fs::remove_dir(dir);
        }
        format!("--out-dir {}: {error}", what.display())
    };
    std::fs::create_dir_all(dir).map_err(|error| failed(dir, error))?;
    let staged: Result<Vec<NamedTempFile>, std::io::Error> = files
        .iter()
        .map(|(_, content)| stage(dir, content))
        .collect();
    let staged = staged.map_err(|error| failed(dir, error))?;
    let mut named: Vec<PathBuf> = Vec::new();
    for (file, (name, _)) in staged.into_iter().zip(files) {
        let to = dir.join(name);
        if let Err(error) = file.persist(&to) {
            for file in &named {
                _ = std::fs::remove_file(file);
            }
            return Err(failed(&to, error.error));
        }
        named.push(to);
    }
    for file in old.iter().filter(|file| !named.contains(file)) {
        std::fs::remove_file(file)
            .map_err(|error| format!("--out-dir {}: {error}", file.display()))?;
    }
    Ok(())
}

/// Writes `content` to a temporary file in `dir`. The file is deleted if the caller does not rename it.
fn stage(dir: &Path, content: &[u8]) -> Result<NamedTempFile, std::io::Error> {
    let mut file = NamedTempFile::new_in(dir)?;
    file.write_all(content)?;
    file.as_file().sync_all()?;
    Ok(file)
}

/// Returns the paths of the files in `dir` that are configuration blocks, or have a name in `files`.
fn there(dir: &Path, files: &[(String, Vec<u8>)]) -> Result<Vec<PathBuf>, String> {
    if !dir.exists() {
        return Ok(Vec::new());
    }
    let entries =
        std::fs::read_dir(dir).map_err(|error| format!("--out-dir {}: {error}", dir.display()))?;
    let mut there: Vec<PathBuf> = entries
        .filter_map(Result::ok)
        .filter(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            let index = name
                .strip_prefix("relay")
                .and_then(|rest| rest.strip_suffix(".bin"));
            index.is_some_and(|index| index.parse::<u16>().is_ok())
                || files.iter().any(|(file, _)| *file == name)
        })
        .map(|entry| entry.path())
        .collect();
    there.sort();
    Ok(there)
}

/// Data at the beginning of a flight's `summary.txt`.
#[derive(Clone, Debug)]
pub struct Heading {
    /// Name of the scenario.
    pub scenario: String,
    /// Numbers of relays in the fleet and in the chain.
    pub fleet: FleetSize,
    /// Network number of the relays.
    pub network: u16,
    /// Placement method of the relays, as named on the command line.
    pub method: String,
    /// True if the relays sign their frames.
    pub signed: bool,
}

/// Returns the text of `summary.txt`: the flight, the expected positions, the commands for flashing.
///
/// `places` are the positions that the relays of the chain agree on; empty if unknown. `line` converts them to latitude and
/// longitude.
pub fn summary(heading: &Heading, places: &[(Placement, Profile)], line: Option<&Line>) -> String {
    let Heading {
        scenario,
        fleet,
        network,
        method,
        signed,
    } = heading;
    let FleetSize { relays, flying } = *fleet;
    let signed = if *signed { "signed" } else { "not signed" };
    let mut text = format!(
        "{relays} relays of {scenario}, network {network}, method {method}, frames {signed}\n\n"
    );
    if flying < relays {
        let spares: Vec<String> = fleet.spares().into_iter().map(name).collect();
        _ = writeln!(
            text,
            "{flying} relays fly; spares at the start, which wait outside of the chain: {}\n",
            spares.join(", ")
        );
    }
    if places.is_empty() {
        text.push_str("their positions are not known before the flight\n");
    } else {
        text.push_str("positions on which the relays will settle:\n");
        let earth = if line.is_some() {
            "      lat [deg]     lon [deg]  amsl [m]"
        } else {
            ""
        };
        _ = writeln!(
            text,
            "          file       x [m]       y [m]      h [m]{earth}"
        );
    }
    for (index, (place, _)) in fleet.first().zip(places) {
        _ = write!(
            text,
            "{:>14} {:>11.3} {:>11.3} {:>10.2}",
            name(index),
            place.x_m,
            place.y_m,
            place.altitude_m
        );
        if let Some(at) = line.and_then(|line| line.axis.point(*place)) {
            _ = write!(
                text,
                " {:>14.7} {:>13.7} {:>9.2}",
                f64::from(at.lat_e7) / 1e7,
                f64::from(at.lon_e7) / 1e7,
                f64::from(at.amsl_mm) / 1e3
            );
        }
        text.push('\n');
    }
    text.push_str(
        "\ncommands to type in this folder, two for each drone, while that drone is connected to the debug probe:\n",
    );
    for index in 1..=relays {
        _ = writeln!(
            text,
            "probe-rs download --chip STM32F405RGTx --binary-format bin --base-address 0x{ADDRESS:08X} {}\n\
             probe-rs reset --chip STM32F405RGTx",
            name(index)
        );
    }
    text
}
