//! Comparison of the best common altitude, of Algorithm 2, and of the joint method.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::{Local, Method, Schedule};

use super::adjust::adjusted;
use super::altitude::best_common;
use super::chart::{Axis, Chart, Line, Look, Panel};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use super::walk::fly;

/// Numbers of relays in the comparison.
pub const RELAYS: [u16; 10] = [2, 5, 8, 12, 16, 20, 30, 50, 70, 100];

/// Largest number of rounds of Algorithm 2.
pub const ROUNDS: u16 = 500;

const OFFSET_M: f64 = 150.0;

/// Table row: SIRs and messages of three methods for one number of relays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    relays: u16,
    common_altitude_m: f64,
    /// SIR of Algorithm 1 at the best common altitude, linear.
    common_sir_linear: f64,
    /// SIR of Algorithm 2, which starts with all relays at the best common altitude, linear.
    adjust_sir_linear: f64,
    /// Number of messages of Algorithm 1 and then Algorithm 2.
    adjust_messages: u64,
    /// SIR of the joint method, linear. This method chooses positions and altitudes together.
    joint_sir_linear: f64,
    joint_passes: u32,
    joint_messages: u64,
    /// SIR gain of Algorithm 2 over the best common altitude, percent.
    adjust_gain_percent: f64,
    /// SIR gain of the joint method over the best common altitude, percent.
    joint_gain_percent: f64,
}

/// Returns a table row for each number of relays, with at most `rounds` rounds of Algorithm 2.
fn data(relays: &[u16], rounds: u16) -> Result<Vec<Row>, FigureError> {
    relays
        .par_iter()
        .map(|&relays| row(relays, rounds))
        .collect()
}

fn row(relays: u16, rounds: u16) -> Result<Row, FigureError> {
    let (altitude_m, common) = best_common(relays, OFFSET_M)?;
    let adjusted = adjusted(relays, altitude_m, rounds, Local::Fine)?;
    let mission = paper::flown(&paper::altitudes(OFFSET_M, altitude_m), relays)?;
    let joint = fly(&mission, Method::Joint, Schedule::Bracketed, true)?;
    Ok(Row {
        relays,
        common_altitude_m: altitude_m,
        common_sir_linear: common,
        adjust_sir_linear: adjusted.sir,
        adjust_messages: adjusted.messages,
        joint_sir_linear: joint.sir,
        joint_passes: joint.sweeps,
        joint_messages: joint.messages,
        adjust_gain_percent: 100.0 * (adjusted.sir / common - 1.0),
        joint_gain_percent: 100.0 * (joint.sir / common - 1.0),
    })
}

/// Computes the figure that compares a common altitude, Algorithm 2 and the joint method.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(&RELAYS, ROUNDS)?;
    let line = |name: &str, index: usize, value: fn(&Row) -> f64| {
        let points = rows.iter().map(|row| (f64::from(row.relays), value(row)));
        Line::new(name, Look::number(index), points)
    };
    let names = [
        "best common altitude",
        "Algorithm 2 from there",
        "positions and altitudes jointly",
    ];
    let [common, adjust, joint] = names;
    let panel = |y: Axis, lines: Vec<Line>| Panel {
        heading: String::new(),
        x: Axis::linear("number of relays N").between(0.0, 100.0),
        y,
        lines,
    };
    let head = [
        "N",
        "best common altitude",
        "SIR there",
        "Algorithm 2",
        "jointly",
        "messages: Algorithm 2",
        "jointly",
    ];
    let mut shown = vec![head.map(str::to_owned).to_vec()];
    shown.extend(rows.iter().map(|row| {
        vec![
            row.relays.to_string(),
            format!("{:.0} m", row.common_altitude_m),
            format!("{:.4}", row.common_sir_linear),
            format!("{:.4}", row.adjust_sir_linear),
            format!("{:.4}", row.joint_sir_linear),
            row.adjust_messages.to_string(),
            row.joint_messages.to_string(),
        ]
    }));
    Ok(Sheet {
        name: "joint",
        title: "Common altitude, Algorithm 2, and joint optimisation of positions and altitudes",
        says: vec![
            "Not in the paper. Gain of free altitudes over the best common altitude, and its cost."
                .to_owned(),
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 150) m, altitudes of \
             20 m to 300 m, relays at least 4 m apart"
                .to_owned(),
            format!(
                "Algorithm 2: {ROUNDS} rounds, at most 10 m up or down in each; every relay searches from coarse to fine"
            ),
        ],
        chart: Chart {
            panels: vec![
                panel(
                    Axis::log("SIR of the chain, linear"),
                    vec![
                        line(common, 0, |row| row.common_sir_linear),
                        line(adjust, 1, |row| row.adjust_sir_linear),
                        line(joint, 2, |row| row.joint_sir_linear),
                    ],
                ),
                panel(
                    Axis::linear("gain over common, %"),
                    vec![
                        line(adjust, 1, |row| row.adjust_gain_percent),
                        line(joint, 2, |row| row.joint_gain_percent),
                    ],
                ),
            ],
        },
        tables: vec![Table::new("joint", &rows)?],
        shown,
    })
}
