//! A plan that a scenario file carries on, to what is written into drones.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};
use uav_relay::Placement;
use uav_relay_scenario::{Planned, PlannedMethod, PlannedPlace, Scenario};

use super::flown::{Flown, judged};
use super::found::NoPlan;
use super::unit::Unit;

/// How far the SIR of a plan's places may be from what the plan says, dB: its digits.
const SAME_DB: f64 = 1e-3;

/// What a scenario is told of relays that fly `flown`.
pub fn planned(flown: &Flown, method: PlannedMethod, tolerance: f64) -> Planned {
    let places: Vec<PlannedPlace> = flown
        .plan
        .places
        .iter()
        .map(|(place, _)| PlannedPlace {
            x_m: shortest(place.x_m),
            y_m: shortest(place.y_m),
            altitude_m: shortest(place.altitude_m),
        })
        .collect();
    Planned {
        uavs: u16::try_from(places.len()).unwrap_or(u16::MAX),
        method,
        tolerance,
        sir_db: (10.0 * flown.plan.sir().log10() * 1e6).round() / 1e6,
        places,
    }
}

/// The number that has the fewest digits of those that are nearest to this one.
fn shortest(value: f32) -> f64 {
    format!("{value}").parse().unwrap_or_else(|_| value.into())
}

/// The scenario file `text` with `planned` at its end, in place of the plan that it may have.
///
/// # Errors
/// Why it is no TOML.
pub fn with_plan(text: &str, planned: &Planned) -> Result<String, String> {
    let mut file: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| error.message().to_owned())?;
    _ = file.remove("plan");
    let mut table = Table::new();
    table.decor_mut().set_prefix(
        "\n# By `cargo plan`. What is above may be changed, and is then to be planned anew.\n",
    );
    table.insert("uavs", value(i64::from(planned.uavs)));
    table.insert("method", value(planned.method.name()));
    table.insert("tolerance", value(planned.tolerance));
    table.insert("sir_db", value(planned.sir_db));
    let mut places = Array::new();
    for place in &planned.places {
        let mut entry = InlineTable::new();
        entry.insert("x_m", place.x_m.into());
        entry.insert("y_m", place.y_m.into());
        entry.insert("altitude_m", place.altitude_m.into());
        let mut entry = Value::from(entry);
        entry.decor_mut().set_prefix("\n  ");
        places.push_formatted(entry);
    }
    places.set_trailing("\n");
    places.set_trailing_comma(true);
    table.insert("places", value(places));
    // Behind all that is there: tables go where their number says.
    table.set_position(Some(isize::MAX));
    file.insert("plan", Item::Table(table));
    Ok(file.to_string())
}

fn value(of: impl Into<Value>) -> Item {
    Item::Value(of.into())
}

/// Whether the plan that a scenario carries is one of that scenario.
///
/// # Errors
/// In one line, what its places give now.
pub fn is_current(scenario: &Scenario, planned: &Planned) -> Result<(), String> {
    #[expect(clippy::cast_possible_truncation, reason = "as relays are told")]
    let places: Vec<Placement> = planned
        .places
        .iter()
        .map(|place| Placement {
            x_m: place.x_m as f32,
            y_m: place.y_m as f32,
            altitude_m: place.altitude_m as f32,
        })
        .collect();
    let sir = judged(scenario, &places, planned.tolerance).map_err(|wrong| match wrong {
        NoPlan::Wrong(why) => why,
        NoPlan::Unmet(why, _) => why.say(Unit::Decibels),
    })?;
    let sir_db = 10.0 * sir.log10();
    if (sir_db - planned.sir_db).abs() <= SAME_DB {
        return Ok(());
    }
    Err(format!(
        "plan.sir_db = {:.3} is of another scenario: in this one its places give {sir_db:.3} dB; allowed: [plan] as `cargo plan --out` \
         writes it for what is above it",
        planned.sir_db
    ))
}
