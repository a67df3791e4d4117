//! Lemma 1: the positions at which both hops of a single relay have the same SIR.

use crate::single::theorems::equal_altitudes;
use serde::Serialize;
use uav_relay::Mission;

use super::chart::{Axis, Chart, Line, Look};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use uav_relay_scenario::Scenario;

/// Power of Tx, W, and position (x, y) of the interferer, m, for each curve of the figure.
pub const CHOICES: [(f64, (f64, f64)); 4] = [
    (20.0, (30.0, 30.0)),
    (20.0, (30.0, 60.0)),
    (40.0, (30.0, 30.0)),
    (40.0, (30.0, 60.0)),
];

/// Distance from Tx to Rx, m.
pub const DISTANCE_M: f64 = 35.0;

const FINENESS: u8 = 20;

/// Table row: altitudes at which both hops of a single relay have the same SIR, at one x.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    tx_w: f64,
    interferer_x_m: f64,
    interferer_y_m: f64,
    x_m: f32,
    /// Lower altitude with the same SIR on both hops, m; `None` if there is no such altitude.
    lower_altitude_m: Option<f32>,
    /// Upper altitude with the same SIR on both hops, m; `None` if there is no such altitude.
    upper_altitude_m: Option<f32>,
}

/// Returns the mission of one relay of 1 W, for a power of Tx, W, and an interferer's position, m.
pub fn mission((tx_w, (x_m, y_m)): (f64, (f64, f64))) -> Result<Mission, FigureError> {
    let scenario = Scenario {
        distance_m: DISTANCE_M,
        tx_w,
        ..paper::with_interferer(paper::multi_hop(), x_m, y_m)
    };
    paper::mission(&scenario, 1)
}

/// Returns the altitudes of equal SIR at `per_m` positions per metre between Tx and Rx.
fn data(per_m: u8) -> Result<Vec<Row>, FigureError> {
    let mut rows = Vec::new();
    for choice in CHOICES {
        let mission = mission(choice)?;
        let config = mission.config();
        for place in 0..=u16::MAX {
            let x_m = f32::from(place) / f32::from(per_m);
            if x_m > config.distance_m {
                break;
            }
            let [lower, upper] = equal_altitudes(&mission, x_m, config.common.power_w);
            rows.push(Row {
                tx_w: choice.0,
                interferer_x_m: choice.1.0,
                interferer_y_m: choice.1.1,
                x_m,
                lower_altitude_m: lower,
                upper_altitude_m: upper,
            });
        }
    }
    Ok(rows)
}

/// Computes the figure of the positions at which both hops of a single relay have the same SIR.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(FINENESS)?;
    let mut lines = Vec::new();
    for (index, (tx_w, (x_m, y_m))) in CHOICES.into_iter().enumerate() {
        let of = rows
            .iter()
            .filter(|row| (row.tx_w, row.interferer_x_m, row.interferer_y_m) == (tx_w, x_m, y_m));
        let branch = |altitude: fn(&Row) -> Option<f32>| -> Vec<(f64, f64)> {
            of.clone()
                .filter_map(|row| Some((f64::from(row.x_m), f64::from(altitude(row)?))))
                .collect()
        };
        let (lower, upper) = (
            branch(|row| row.lower_altitude_m),
            branch(|row| row.upper_altitude_m),
        );
        let name = format!("Tx {tx_w} W, ({x_m}, {y_m}) m");
        let line = |points| Line::new(&name, Look::number(index).spaced(), points);
        // If there is no altitude above Tx, both curves start at a common point farther on.
        if upper.first().is_some_and(|first| first.0 > 0.0) {
            lines.push(line([lower.into_iter().rev().collect(), upper].concat()));
        } else {
            lines.extend([lower, upper].map(line));
        }
    }
    Ok(Sheet {
        name: "locus",
        title: "Positions at which both hops of a single relay have the same SIR",
        says: vec![
            "More power at Tx shifts the locus toward Rx; an interferer nearer to the line shifts \
             it down: both as the paper says."
                .to_owned(),
        ],
        taken: vec![
            "p_u (relay) = 1 W, D (Tx to Rx) = 35 m; the power of the interferer cancels".to_owned(),
            "the paper does not state p_t and the positions of the interferer: 20 W and 40 W, and (X, Y) as in the legend, are chosen"
                .to_owned(),
        ],
        chart: Chart::of(
            Axis::linear("x, m").between(0.0, DISTANCE_M),
            Axis::linear("altitude, m"),
            lines,
        ),
        tables: vec![Table::new("locus", &rows)?],
        shown: Vec::new(),
    })
}
