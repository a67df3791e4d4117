//! What it costs a chain to settle: passes, messages and bytes, by the number of relays.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::{Method, Schedule};

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::flight::{Flown, fly};
use super::sheet::{Sheet, Table};
use super::trouble::Trouble;
use super::{convergence, paper};
use uav_relay_scenario::Scenario;

/// The chains that are flown.
pub const RELAYS: [u16; 10] = [1, 2, 3, 5, 8, 14, 24, 40, 65, 100];

/// One chain.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Row {
    /// Number of relays.
    pub relays: u16,
    /// Passes of the paper's schedule with its step of 0.1.
    pub step_sweeps: u32,
    /// Frames it puts on the links.
    pub step_messages: u64,
    /// Bytes of them.
    pub step_bytes: u64,
    /// SIR it ends with, linear.
    pub step_sir_linear: f64,
    /// Passes of bracketed targets, nothing known beforehand.
    pub bracketed_sweeps: u32,
    /// Frames they put on the links.
    pub bracketed_messages: u64,
    /// Bytes of them.
    pub bracketed_bytes: u64,
    /// SIR they end with, linear.
    pub bracketed_sir_linear: f64,
    /// Passes where the head first solves the chain from the mission.
    pub predicted_sweeps: u32,
    /// Frames they put on the links.
    pub predicted_messages: u64,
    /// Bytes of them.
    pub predicted_bytes: u64,
    /// SIR they end with, linear.
    pub predicted_sir_linear: f64,
}

/// These chains, flown three times each.
///
/// # Errors
/// [`Trouble`].
pub fn data(relays: &[u16]) -> Result<Vec<Row>, Trouble> {
    relays.par_iter().map(|&relays| row(relays)).collect()
}

fn row(relays: u16) -> Result<Row, Trouble> {
    let mission = paper::flown(&Scenario::default(), relays)?;
    let flown = |schedule: Schedule, predict: bool| -> Result<Flown, Trouble> {
        fly(&mission, Method::Align, schedule, predict)
    };
    let step = flown(
        Schedule::FixedStep {
            step: convergence::STEP,
        },
        false,
    )?;
    let bracketed = flown(Schedule::Bracketed, false)?;
    let predicted = flown(Schedule::Bracketed, true)?;
    Ok(Row {
        relays,
        step_sweeps: step.sweeps,
        step_messages: step.messages,
        step_bytes: step.bytes,
        step_sir_linear: step.sir,
        bracketed_sweeps: bracketed.sweeps,
        bracketed_messages: bracketed.messages,
        bracketed_bytes: bracketed.bytes,
        bracketed_sir_linear: bracketed.sir,
        predicted_sweeps: predicted.sweeps,
        predicted_messages: predicted.messages,
        predicted_bytes: predicted.bytes,
        predicted_sir_linear: predicted.sir,
    })
}

/// A panel with the three ways; what costs nothing has no place on its axis.
fn panel(rows: &[Row], title: &str, of: fn(&Row) -> [f64; 3]) -> Panel {
    let names = [
        "paper's step of 0.1",
        "bracketed targets",
        "bracketed, head predicts",
    ];
    let lines = names.into_iter().enumerate().map(|(index, name)| {
        let points = rows.iter().filter_map(move |row| {
            let value = of(row).get(index).copied().filter(|value| *value > 0.0)?;
            Some((f64::from(row.relays), value))
        });
        Line::new(name, Look::number(index), points)
    });
    Panel {
        heading: String::new(),
        x: Axis::log("number of relays N").between(1.0, 100.0),
        y: Axis::log(title),
        lines: lines.collect(),
    }
}

/// The figure.
///
/// # Errors
/// Never in practice: see [`Trouble`].
pub fn sheet() -> Result<Sheet, Trouble> {
    let rows = data(&RELAYS)?;
    let ratio = rows.last().map_or(0.0, |row| {
        row.step_messages as f64 / row.predicted_messages.max(1) as f64
    });
    Ok(Sheet {
        name: "cost",
        title: "Passes, messages and bytes until the chain has settled",
        says: vec![format!(
            "With 100 relays the paper's schedule takes {ratio:.0} times as many messages as the \
             head that first solves the chain from the mission. One relay alone sends none."
        )],
        taken: vec![
            "D = 1000 m, h = 20 m, p_t = p_MSI = 80 W, p_u = 1 W, interferer at (500, 400) m, \
             relays at least 4 m apart"
                .to_owned(),
            "simulated serial links without faults; all frames on any link counted, verdicts and \
             repetitions too"
                .to_owned(),
            "bracketed targets end within 1e-4 of the optimum, the step within 0.1".to_owned(),
        ],
        chart: Chart {
            panels: vec![
                panel(&rows, "passes", |row| {
                    [row.step_sweeps, row.bracketed_sweeps, row.predicted_sweeps].map(f64::from)
                }),
                panel(&rows, "messages", |row| {
                    let (step, bracketed) = (row.step_messages, row.bracketed_messages);
                    [step, bracketed, row.predicted_messages].map(|count| count as f64)
                }),
                panel(&rows, "bytes", |row| {
                    let (step, bracketed) = (row.step_bytes, row.bracketed_bytes);
                    [step, bracketed, row.predicted_bytes].map(|count| count as f64)
                }),
            ],
        },
        tables: vec![Table::new("cost", &rows)?],
        shown: Vec::new(),
    })
}
