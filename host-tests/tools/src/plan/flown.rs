//! Positions that the relays agree on in flight, and their loss compared with the best known ones.
//!
//! In flight there is a single interferer or a field. A hypothetical interferer in place of several is an
//! approximation, and Algorithm 4 is not optimal in an uneven field. The positions are therefore compared under the
//! full interference.

use std::path::{Path, PathBuf};

use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};
use uav_relay_scenario::number::shortest;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Planned, PlannedMethod, PlannedPlace, Scenario, mission};

use super::multi_interferer::with_one;
use super::{LOSS, NoPlan, Plan, PlanRequest, altitude, fitted_radio, merit, source};

/// Positions that the relays would agree on in flight, compared with the best positions found.
#[derive(Clone, PartialEq, Debug)]
pub struct Flown {
    /// Positions that the relays choose, with their SIRs against all interferers of the scenario.
    pub plan: Plan,
    /// Best SIR of the worst hop, linear, that the planner finds for this number of relays.
    pub best_sir: f64,
    /// Data rates divided by the bandwidth, at the relays' positions and at the best ones found, bit/s/Hz.
    ///
    /// `None` unless the slots are fitted (as long as each hop needs). If the slots are fitted, the plan is judged by
    /// these rates, not by the SIRs.
    pub rates: Option<[f64; 2]>,
    /// True if the relays use one hypothetical interferer instead of the scenario's interferers.
    pub stand_in: bool,
    /// True if the best positions are those of the solver for both directions, in a plan for one direction.
    pub by_both: bool,
}

impl Flown {
    /// Returns the loss at the relays' positions, as a fraction of the best SIR.
    ///
    /// With fitted slots (as long as each hop needs) it is a fraction of the best data rate.
    pub fn loss(&self) -> f64 {
        let [own, best] = self.rates.unwrap_or([self.plan.sir(), self.best_sir]);
        (1.0 - own / best).max(0.0)
    }

    /// Returns true if the relays' positions lose more than 1 % of the best SIR or data rate ([`LOSS`]).
    pub fn is_poor(&self) -> bool {
        self.loss() > LOSS
    }

    /// Returns a text for the user: the loss at the relays' positions, its cause, and the remedy.
    pub fn describe(&self) -> String {
        let [reach, best] = [self.plan.sir(), self.best_sir].map(|sir| 10.0 * sir.log10());
        let (why, remedy) = if self.stand_in {
            (
                "because the relays compute with one hypothetical interferer in place of all",
                if self.rates.is_some() {
                    "plan another number of relays or other altitudes (`cargo plan`), or use another link.access"
                } else {
                    "let the relays estimate the interferer ([listen]; `cargo chain --listen` simulates it), or plan other altitudes or more \
                     relays for the sum of all interferers (`cargo plan`)"
                },
            )
        } else if self.by_both {
            (
                "because their solver for one direction ends at another local optimum",
                "set link.reverse to 1e-6: relays then compute with the solver for both directions",
            )
        } else {
            (
                "because the interference field is too uneven for Algorithm 4",
                "plan another geometry.altitude_m or another number of relays (`cargo plan`)",
            )
        };
        let reached = match self.rates {
            Some([own, best]) => format!("carry {own:.4} bit/s/Hz instead of the {best:.4}"),
            None => format!("reach an SIR of {reach:.2} dB instead of the {best:.2} dB"),
        };
        format!(
            "the relays would {reached} of the best positions, {:.1} % less, {why}; {remedy}",
            100.0 * self.loss()
        )
    }
}

/// Returns the positions that `relays` relays in `scenario` would agree on by `method`.
///
/// The cost is that of two calls to [`super::plan`].
pub fn flown(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Flown, NoPlan> {
    let plan = alone(scenario, relays, method, tolerance)?;
    let ask = PlanRequest::of(relays, method == PlannedMethod::Joint, tolerance);
    let best = super::plan(&super::area::anywhere(scenario), &ask)?;
    let best_sir = best.sir().max(plan.sir());
    let radio = fitted_radio(scenario, ask.free_altitude);
    let scene = Scene::new(scenario, relays);
    let rates = radio.zip(scene).map(|(radio, scene)| {
        let [own, best] = [&plan, &best].map(|of| merit(Some(&radio), &scene, &of.chain()));
        [own, best.max(own)]
    });
    Ok(Flown {
        plan,
        best_sir,
        rates,
        stand_in: mission::hypothetical(scenario).is_some(),
        by_both: best.how == altitude::BY_BOTH,
    })
}

/// Returns the plan with the positions that the relays would find in flight by `method`.
///
/// Relays use one hypothetical interferer in place of several. The SIRs in the plan are those against all interferers.
pub(super) fn alone(
    scenario: &Scenario,
    relays: u16,
    method: PlannedMethod,
    tolerance: f64,
) -> Result<Plan, NoPlan> {
    let by_method = |scenario: &Scenario| match method {
        PlannedMethod::Joint => altitude::in_flight(scenario, relays, tolerance),
        PlannedMethod::Align => source::best(scenario, relays, tolerance),
    };
    let Some(one) = mission::hypothetical(scenario) else {
        let plan = by_method(scenario)?;
        let is_field = matches!(scenario.interference, Interference::Field(_));
        return Ok(Plan {
            how: if is_field { "Algorithm 4" } else { plan.how },
            ..plan
        });
    };
    let plan = by_method(&with_one(scenario, &one))?;
    let scene = Scene::new(scenario, relays).ok_or_else(source::nothing)?;
    Ok(plan.against(&scene))
}

/// Largest difference of a coordinate between the file's plan and the recomputed plan, m.
///
/// The two differ slightly if the file's plan was made on a machine that rounds differently.
const SAME_M: f64 = 0.1;
/// Largest difference of the SIR between the file's plan and the recomputed plan, dB.
const SAME_DB: f64 = 0.01;

/// Returns the section `[plan]` of a scenario file for the positions `flown`.
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

/// Returns the scenario file `text` with the section `[plan]` at its end, which replaces an old one.
///
/// # Errors
/// The reason if `text` is not valid TOML.
pub fn with_plan(text: &str, planned: &Planned) -> Result<String, String> {
    let mut file = document(text)?;
    _ = file.remove("plan");
    let mut table = Table::new();
    table.decor_mut().set_prefix(
        "\n# Written by `cargo plan`. If you change anything above, run `cargo plan` again.\n",
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

fn document(text: &str) -> Result<DocumentMut, String> {
    text.parse()
        .map_err(|error: toml_edit::TomlError| error.message().to_owned())
}

/// Returns the scenario file `text` with a `[[relay]]` for each relay of `plan`, with its altitude.
///
/// # Errors
/// The reason if `text` is not valid TOML.
pub fn with_altitudes(text: &str, plan: &Plan) -> Result<String, String> {
    let mut file = document(text)?;
    let of_file = file.remove("relay").map(Item::into_array_of_tables);
    let mut relays = match of_file {
        Some(Ok(relays)) => relays,
        _ => ArrayOfTables::new(),
    };
    for (index, (place, _)) in (1_i64..).zip(&plan.places) {
        let is_own =
            |table: &&mut Table| table.get("index").and_then(Item::as_integer) == Some(index);
        let altitude = value(shortest(place.altitude_m));
        if let Some(table) = relays.iter_mut().find(is_own) {
            table.insert("altitude_m", altitude);
            continue;
        }
        let mut table = Table::new();
        table.insert("index", value(index));
        table.insert("altitude_m", altitude);
        relays.push(table);
    }
    file.insert("relay", Item::ArrayOfTables(relays));
    Ok(file.to_string())
}

/// Returns the scenario file `text` with the elevation files `files`, as absolute paths.
///
/// # Errors
/// The reason if `text` is not valid TOML, or a file is missing.
pub fn with_files(text: &str, files: &[PathBuf]) -> Result<String, String> {
    let mut file = document(text)?;
    let mut paths = Array::new();
    for path in files {
        let path =
            std::path::absolute(path).map_err(|error| format!("{}: {error}", path.display()))?;
        paths.push(path.display().to_string());
    }
    let terrain = file.entry("terrain").or_insert(Item::Table(Table::new()));
    let terrain = terrain
        .as_table_like_mut()
        .ok_or("terrain: must be a section")?;
    terrain.insert("files", value(paths));
    Ok(file.to_string())
}

/// Sections and keys of a scenario file whose paths are relative to the folder of the file.
const PATHS: [(&str, &[&str]); 3] = [
    ("network", &["key_file"]),
    (
        "companion",
        &[
            "upstream",
            "downstream",
            "shared",
            "epoch_file",
            "upload_file",
            "view_file",
            "autopilot",
            "autopilot_key_file",
            "positions",
            "log_file",
            "status_socket",
            "capture",
        ],
    ),
    (
        "ground",
        &[
            "tty",
            "epoch_file",
            "measurements",
            "web_password",
            "tiles",
            "log_file",
            "status_socket",
            "capture",
        ],
    ),
];

/// Returns the scenario file `text` from `folder` in a form that is valid in any folder.
///
/// Its relative paths become absolute. [`with_files`] does this for elevation files.
///
/// # Errors
/// The reason if `text` is not valid TOML, or if the current folder is unknown.
pub fn moved(text: &str, folder: &Path) -> Result<String, String> {
    let mut file = document(text)?;
    let replace = |item: &mut Item| {
        let given = item.as_str().filter(|given| !given.starts_with("udp:"));
        if let Some(given) = given.filter(|given| Path::new(given).is_relative()) {
            let path = std::path::absolute(folder.join(given))
                .map_err(|error| format!("{given}: {error}"))?;
            *item = value(path.display().to_string());
        }
        Ok::<_, String>(())
    };
    for (section, keys) in PATHS {
        for key in keys {
            let table = file.get_mut(section).and_then(Item::as_table_like_mut);
            table
                .and_then(|table| table.get_mut(key))
                .map_or(Ok(()), replace)?;
        }
    }
    if let Some(Ok(mut areas)) = file.remove("no_fly").map(Item::into_array_of_tables) {
        for area in areas.iter_mut() {
            area.get_mut("file").map_or(Ok(()), replace)?;
        }
        file.insert("no_fly", Item::ArrayOfTables(areas));
    }
    Ok(file.to_string())
}

fn value(of: impl Into<Value>) -> Item {
    Item::Value(of.into())
}

/// Checks that the plan in the scenario file equals `flown`, the positions of the relays in flight.
///
/// `flown` must be computed for the same number of relays and method.
///
/// # Errors
/// A text that states the differences.
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
        "[plan] does not fit this scenario: its relays settle up to {off_m:.1} m from plan.places, and the worst hop has {sir_db:.3} dB instead of \
         plan.sir_db = {:.3}; run `cargo plan --out` again",
        planned.sir_db
    ))
}
