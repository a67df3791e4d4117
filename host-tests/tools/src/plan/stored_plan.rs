//! Section `[plan]` of a scenario file, which carries a plan over to `cargo provision`.

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};
use uav_relay_scenario::{Planned, PlannedMethod, PlannedPlace};

use super::flown::Flown;

/// Tolerated difference between planned and recomputed positions and SIR, m and dB. Rounding of another machine.
const SAME_M: f64 = 0.1;
const SAME_DB: f64 = 0.01;

/// Returns the `[plan]` section for `flown`.
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

/// Returns the f64 with the shortest decimal form that rounds to `value`.
fn shortest(value: f32) -> f64 {
    format!("{value}").parse().unwrap_or_else(|_| value.into())
}

/// Returns the scenario file `text` with `planned` at its end, which replaces an existing plan.
///
/// # Errors
/// The reason if `text` is not valid TOML.
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
    // Puts the section last: tables are ordered by position.
    table.set_position(Some(isize::MAX));
    file.insert("plan", Item::Table(table));
    Ok(file.to_string())
}

fn value(of: impl Into<Value>) -> Item {
    Item::Value(of.into())
}

/// Checks that the scenario's plan still is what the relays fly. `flown`, recomputed with the same number and method.
///
/// # Errors
/// A line that states the differences.
pub fn is_current(planned: &Planned, flown: &Flown) -> Result<(), String> {
    let places = planned.places.iter().zip(&flown.plan.places);
    let off_m = places
        .map(|(then, (now, _))| {
            let now = [now.x_m, now.y_m, now.altitude_m].map(f64::from);
            let then = [then.x_m, then.y_m, then.altitude_m];
            let apart = |axis: usize| {
                now.get(axis)
                    .zip(then.get(axis))
                    .map_or(0.0, |(a, b)| a - b)
            };
            libm::hypot(libm::hypot(apart(0), apart(1)), apart(2))
        })
        .fold(0.0, f64::max);
    let sir_db = 10.0 * flown.plan.sir().log10();
    if off_m <= SAME_M && (sir_db - planned.sir_db).abs() <= SAME_DB {
        return Ok(());
    }
    Err(format!(
        "[plan] is of another scenario: relays in this one settle up to {off_m:.1} m from plan.places, at {sir_db:.3} dB in place of \
         plan.sir_db = {:.3}; allowed: [plan] as `cargo plan --out` writes it for what is above it",
        planned.sir_db
    ))
}
