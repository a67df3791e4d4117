//! `cargo replay`: writes a page that shows a recorded flight, with a time bar and a report.

use std::fs::File;
use std::io::Read as _;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use uav_relay_command::{Failure, ended, print, print_line, usage};

/// Writes a page that shows a recorded flight as the screen showed it, with a time bar and a report. It needs no
/// server. The captures of companions and ground stations are merged by the frames that occur in two of them
#[derive(Parser, Debug)]
#[command(
    name = "replay",
    bin_name = "cargo replay",
    disable_version_flag = true
)]
struct Options {
    /// Captures (pcapng) of one flight, by --capture of linux_ground, linux_companion or cargo chain. The clock of
    /// the first file is the reference
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// TOML file with the mission loaded before flight, for Rx, SIRs, interferer and geofence
    #[arg(long, value_name = "FILE")]
    scenario: Option<PathBuf>,
    /// File of the page, replaced if it exists. An input file or another capture is not replaced
    #[arg(long, value_name = "FILE", default_value = "flight.html", value_parser = uav_relay_command::file)]
    out: PathBuf,
}

fn main() -> ExitCode {
    match Options::try_parse() {
        Ok(options) => ended(run(&options)),
        Err(error) => usage(&error),
    }
}

/// Checks that the page replaces neither an input file nor any other capture.
fn check_out(options: &Options) -> Result<(), String> {
    // A file that does not exist has no canonical path.
    let Ok(path) = options.out.canonicalize() else {
        return Ok(());
    };
    let mut inputs = options.files.iter().chain(&options.scenario);
    let mut start = [0; 4];
    let what = if inputs.any(|it| it.canonicalize().is_ok_and(|it| it == path)) {
        "an input file"
    } else if path.is_file()
        && File::open(&path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok())
        && start == [0x0A, 0x0D, 0x0D, 0x0A]
    {
        "a capture"
    } else {
        return Ok(());
    };
    let name = options.out.display();
    Err(format!(
        "{name}: --out is {what}: give another name, as flight.html"
    ))
}

fn run(options: &Options) -> Result<(), Failure> {
    check_out(options).map_err(Failure::input)?;
    let replay = uav_relay_replay::replay(&options.files, options.scenario.as_deref())
        .map_err(Failure::input)?;
    for warning in &replay.warnings {
        print_line(&format!("warning: {warning}"));
    }
    let name = options.out.display();
    std::fs::write(&options.out, &replay.html)
        .map_err(|error| Failure::input(format!("{name}: --out cannot be written: {error}")))?;
    let flight = &replay.flight;
    print(&format!(
        "{name}: {} relays, {:.0} s, {} alarms; open it in a browser\n",
        flight.relays,
        flight.duration,
        flight.alarms.len()
    ));
    Ok(())
}
