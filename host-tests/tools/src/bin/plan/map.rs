//! Writes the files of `--geojson` and `--kml`.

use uav_relay_scenario::Scenario;
use uav_relay_sim::command::{self, Failure};
use uav_relay_tools::plan::Plan;
use uav_relay_tools::plan::map::{Map, geojson, kml};

use crate::options::Options;
use crate::out::save;

pub(crate) fn check(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let option = match (&options.geojson, &options.kml) {
        (Some(_), _) => "--geojson",
        (None, Some(_)) => "--kml",
        (None, None) => return Ok(()),
    };
    if scenario.line.is_some() {
        return Ok(());
    }
    Err(Failure::input(format!(
        "{}: site: is missing, which {option} needs; allowed: [site] with tx and rx, each {{ lat_deg, lon_deg, amsl_m }}",
        options.file()
    )))
}

pub(crate) fn write(options: &Options, scenario: &Scenario, plan: &Plan) -> Result<(), Failure> {
    if options.geojson.is_none() && options.kml.is_none() {
        return Ok(());
    }
    let map = Map::new(scenario, plan)
        .map_err(|line| Failure::input(format!("{}: {line}", options.file())))?;
    for number in &map.left_out {
        command::complain(&format!(
            "note: interferer {number} is more than 5 km from the line, and not on the map"
        ));
    }
    if let Some(file) = &options.geojson {
        save(file, "--geojson", &geojson::text(&map))?;
    }
    if let Some(file) = &options.kml {
        let text = kml::text(&map, &options.file())
            .map_err(|error| Failure::input(format!("--kml {}: {error}", file.display())))?;
        save(file, "--kml", &text)?;
    }
    Ok(())
}
