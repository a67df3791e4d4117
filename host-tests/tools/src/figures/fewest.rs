//! Fewest relays for a target SIR, by position of the interferer and by power of the relays.

use rayon::prelude::*;
use serde::Serialize;

use crate::fewest::Fewest;

use super::chart::{Axis, Chart, Line, Look};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use uav_relay_scenario::Scenario;

/// Largest target SIR of the figure, linear. The targets are all whole numbers from 1 up to this one.
pub const MOST_TARGET: u16 = 40;

/// Positions (X, Y) of the interferer, m, one for each curve of the figure.
pub const PLACES_M: [(f64, f64); 6] = [
    (500.0, 400.0),
    (100.0, 400.0),
    (900.0, 400.0),
    (500.0, 100.0),
    (100.0, 100.0),
    (900.0, 100.0),
];

/// Powers of the relays, W, one for each curve of the figure.
pub const POWERS_W: [f64; 5] = [0.5, 1.0, 2.0, 5.0, 10.0];

/// Table row: fewest relays for one target SIR, with one interferer and one relay power.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    interferer_x_m: f64,
    interferer_y_m: f64,
    relay_w: f64,
    target_linear: u16,
    /// Smallest number of relays that meets the target SIR; `None` if no number does.
    relays: Option<u16>,
}

/// Returns the fewest relays of 1 W for each position of the interferer and each target SIR.
fn by_place(targets: &[u16]) -> Result<Vec<Row>, FigureError> {
    rows(targets, &PLACES_M.map(|place| (place, 1.0)))
}

/// Returns the fewest relays for each relay power and each target SIR.
///
/// The interferer is at (500, 400) m.
fn by_power(targets: &[u16]) -> Result<Vec<Row>, FigureError> {
    rows(targets, &POWERS_W.map(|power| ((500.0, 400.0), power)))
}

fn rows(targets: &[u16], scenarios: &[((f64, f64), f64)]) -> Result<Vec<Row>, FigureError> {
    let of = |&((x_m, y_m), relay_w): &((f64, f64), f64)| -> Result<Vec<Row>, FigureError> {
        let scenario = Scenario {
            uav_w: relay_w,
            ..paper::with_interferer(paper::multi_hop(), x_m, y_m)
        };
        let mission = paper::mission(&scenario, 1)?;
        let common = mission.config().common;
        let row = |&target: &u16| Row {
            interferer_x_m: x_m,
            interferer_y_m: y_m,
            relay_w,
            target_linear: target,
            relays: Fewest::of(&mission, f32::from(target), |_| common).map(|fewest| fewest.relays),
        };
        Ok(targets.iter().map(row).collect())
    };
    let rows: Result<Vec<Vec<Row>>, FigureError> = scenarios.par_iter().map(of).collect();
    Ok(rows?.concat())
}

fn all_targets() -> Vec<u16> {
    (1..=MOST_TARGET).collect()
}

fn chart(rows: &[Row], name: fn(&Row) -> String) -> Chart {
    let mut lines: Vec<Line> = Vec::new();
    for row in rows {
        let Some(relays) = row.relays else { continue };
        let point = (f64::from(row.target_linear), f64::from(relays));
        let name = name(row);
        match lines.iter_mut().find(|line| line.name == name) {
            Some(line) => line.points.push(point),
            None => lines.push(Line::new(
                &name,
                Look::number(lines.len()).spaced(),
                [point],
            )),
        }
    }
    Chart::of(
        Axis::log("target SIR, linear").between(1.0, f64::from(MOST_TARGET)),
        Axis::log("minimum number of relays"),
        lines,
    )
}

/// Computes the figure of the fewest relays for a target SIR, by the interferer's position.
pub fn by_place_sheet() -> Result<Sheet, FigureError> {
    let rows = by_place(&all_targets())?;
    let at = |target: u16| {
        PLACES_M.map(|place| {
            let row = rows.iter().find(|row| {
                row.target_linear == target && (row.interferer_x_m, row.interferer_y_m) == place
            });
            row.and_then(|row| row.relays).unwrap_or(0)
        })
    };
    let [middle, near_tx, near_rx, close, close_tx, close_rx] = at(5);
    let [_, _, _, low, low_tx, low_rx] = at(1);
    Ok(Sheet {
        name: "fewest-by-place",
        title: "Minimum number of relays for a target SIR, by the interferer's position",
        says: vec![format!(
            "The nearer the interferer to the line between Tx and Rx, the more relays are needed. The paper says that an interferer near Tx or Rx also needs more relays. This holds only near Rx, and only for low targets. Relays needed with the interferer at X = 500 m, 100 m and 900 m: for a target of 1 at Y = 100 m {low}, \
             {low_tx} and {low_rx}; for a target of 5 at Y = 100 m {close}, {close_tx} and \
             {close_rx}, and at Y = 400 m {middle}, {near_tx} and {near_rx}."
        )],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, no least separation".to_owned(),
            "the paper does not state the positions of the interferer: those in the legend are chosen"
                .to_owned(),
        ],
        chart: chart(&rows, |row| {
            format!("({}, {}) m", row.interferer_x_m, row.interferer_y_m)
        }),
        tables: vec![Table::new("fewest-by-place", &rows)?],
        shown: Vec::new(),
    })
}

/// Computes the figure of the fewest relays for a target SIR, by the relays' power.
pub fn by_power_sheet() -> Result<Sheet, FigureError> {
    let rows = by_power(&all_targets())?;
    Ok(Sheet {
        name: "fewest-by-power",
        title: "Minimum number of relays for a target SIR, by the relays' power",
        says: vec![
            "With more power at the relays fewer relays are needed, as the paper says. The formulas as \
             printed give too few: 16, 24, 36 and 54 relays of 1 W for targets of 5, 10, 20 and \
             40."
            .to_owned(),
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_MSI (interferer) = 80 W, interferer at (500, 400) m, no least \
             separation"
                .to_owned(),
            "the paper does not state the powers: those in the legend are chosen".to_owned(),
        ],
        chart: chart(&rows, |row| format!("relays of {} W", row.relay_w)),
        tables: vec![Table::new("fewest-by-power", &rows)?],
        shown: Vec::new(),
    })
}
