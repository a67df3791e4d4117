//! Writes the file of `--out`: the scenario with its plan, for `cargo provision`.

use std::path::Path;

use uav_relay_scenario::deployment::{Companion, Deployment, agree};
use uav_relay_scenario::{DEFAULT, Interference, PlannedMethod, Scenario};
use uav_relay_sim::command::Failure;
use uav_relay_tools::plan::flown::flown;
use uav_relay_tools::plan::stored_plan::{planned, with_plan};
use uav_relay_tools::plan::{NoPlan, Number, Plan};
use uav_relay_tools::provision::firmware::probe_after_ms;

use crate::options::{Altitude, Options};

/// Checks, before planning, that relays can fly the request by themselves.
pub(crate) fn check(options: &Options, scenario: &Scenario) -> Result<(), Failure> {
    let Some(file) = &options.out else {
        return Ok(());
    };
    let refuse = |line: String| Err(Failure::input(line));
    if let Some(x_m) = options.x_m {
        return refuse(format!(
            "--x-m {x_m:?} is not for --out: a relay chooses its place along the line by itself"
        ));
    }
    let is_field = matches!(scenario.interference, Interference::Field(_));
    if is_field && options.altitude == Altitude::Free {
        return refuse(
            "--altitude free is not for --out with a [field]: relays hold geometry.altitude_m there, and best at geometry.altitude_min_m"
                .to_owned(),
        );
    }
    if options.target_rate().is_none()
        && let Number::Of(relays) = options.number()
    {
        sections(options, relays)?;
    }
    if file.exists() && !options.force {
        return refuse(format!(
            "--out {}: exists already; --force overwrites it",
            file.display()
        ));
    }
    Ok(())
}

/// Writes the scenario with the plan that its relays will fly, and returns the next command.
pub(crate) fn write(
    options: &Options,
    scenario: &Scenario,
    plan: &Plan,
    number: Number,
) -> Result<String, Failure> {
    let Some(file) = &options.out else {
        return Ok(String::new());
    };
    let method = match options.altitude {
        Altitude::Given => PlannedMethod::Align,
        Altitude::Free => PlannedMethod::Joint,
    };
    let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
    let flown = flown(scenario, relays, method, options.tolerance).map_err(|none| match none {
        NoPlan::Wrong(why) => Failure::input(why),
        NoPlan::Unmet(why, _) => Failure::unmet(why.say(options.unit())),
    })?;
    let sections = sections(options, relays)?;
    let sir = db(flown.plan.sir());
    if flown.is_poor() {
        return Err(Failure::unmet(format!(
            "--out {}: not written: {}",
            file.display(),
            flown.describe()
        )));
    }
    if let Number::Meeting(target) = number
        && flown.plan.sir() < target * (1.0 - options.tolerance)
    {
        return Err(Failure::unmet(format!(
            "--out {}: not written: {relays} relays by themselves reach {sir:.2} dB, and the target is {:.2} dB; ask for more by --uavs",
            file.display(),
            db(target)
        )));
    }
    let text = match &options.scenario {
        Some(scenario) => std::fs::read_to_string(scenario)
            .map_err(|error| Failure::input(format!("{}: {error}", scenario.display())))?,
        None => DEFAULT.to_owned(),
    };
    let text = with_plan(&text, &planned(&flown, method, options.tolerance))
        .map_err(|why| Failure::input(format!("--out {}: {why}", file.display())))?;
    save(file, "--out", &text)?;
    let file = file.display().to_string();
    Ok(format!(
        "{file}: the scenario with its plan, {relays} relays that reach {sir:.3} dB by themselves; {}",
        next(&file, &sections)
    ))
}

/// Loads the other sections of the scenario file; its number of relays must be that of the plan.
fn sections(options: &Options, relays: u16) -> Result<Deployment, Failure> {
    let Some(path) = &options.scenario else {
        return Ok(Deployment::default());
    };
    let name = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|error| Failure::input(format!("{name}: {error}")))?;
    let sections =
        Deployment::parse(&name, &text).map_err(|error| Failure::input(error.to_string()))?;
    agree(&name, sections.network.relays, Some(relays))
        .map_err(|error| Failure::input(error.to_string()))?;
    Ok(sections)
}

fn next(file: &str, sections: &Deployment) -> String {
    let firmware = format!("  cargo provision --scenario {file} --all --out-dir DIR\n");
    let companions = format!("  cargo companion --config {file} --index INDEX\n");
    let is_for_companions = sections.companion != Companion::default();
    match (
        probe_after_ms(&sections.network, None, file),
        is_for_companions,
    ) {
        (Ok(_), false) => format!("next:\n{firmware}"),
        (Ok(_), true) => {
            format!(
                "next, on the Linux computer of every drone:\n{companions}or, for drones with the firmware:\n{firmware}"
            )
        }
        (Err(why), _) => format!(
            "next, on the Linux computer of every drone (cargo provision refuses the file for the firmware: {why}):\n{companions}"
        ),
    }
}

fn db(sir: f64) -> f64 {
    10.0 * sir.log10()
}

pub(crate) fn save(file: &Path, option: &str, text: &str) -> Result<(), Failure> {
    std::fs::write(file, text)
        .map_err(|error| Failure::input(format!("{option} {}: {error}", file.display())))
}
