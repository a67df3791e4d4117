//! `summary.txt`: the content of a folder of blocks, and the commands that flash them.

use std::fmt::Write as _;

use uav_relay::{Placement, Profile};
use uav_relay_scenario::Line;

use super::config::ADDRESS;
use super::folder::name;

/// Flight data for the summary, apart from its relays.
#[derive(Clone, Debug)]
pub struct Heading {
    /// Name of the scenario.
    pub scenario: String,
    /// Number of relays.
    pub uavs: u16,
    /// Network number.
    pub network: u16,
    /// Method, as named on the command line.
    pub method: String,
    /// True if frames are signed.
    pub signed: bool,
}

/// Returns the text of `summary.txt`. `places` are the expected positions of the relays, empty if unknown.
pub fn summary(heading: &Heading, places: &[(Placement, Profile)], line: Option<&Line>) -> String {
    let Heading {
        scenario,
        uavs,
        network,
        method,
        signed,
    } = heading;
    let signed = if *signed { "signed" } else { "not signed" };
    let mut text = format!(
        "{uavs} relays of {scenario}, network {network}, method {method}, frames {signed}\n\n"
    );
    if places.is_empty() {
        text.push_str("their positions are not known before the flight\n");
    } else {
        text.push_str("positions on which they settle:\n");
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
    for (index, (place, _)) in (1..).zip(places) {
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
        "\ncommands to type in this folder, two for each drone, with that drone at the probe:\n",
    );
    for index in 1..=*uavs {
        _ = writeln!(
            text,
            "probe-rs download --chip STM32F405RGTx --binary-format bin --base-address 0x{ADDRESS:08X} {}\n\
             probe-rs reset --chip STM32F405RGTx",
            name(index)
        );
    }
    text
}
