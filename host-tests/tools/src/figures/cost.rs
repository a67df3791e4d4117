//! Cost until a chain's positions are final: passes of messages, messages and bytes.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::{Method, Schedule};

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::sheet::{FigureError, Sheet, Table};
use super::walk::{Flown, fly};
use super::{convergence, paper};
use uav_relay_scenario::Scenario;

/// Numbers of relays in the figure of the cost.
pub const RELAYS: [u16; 10] = [1, 2, 3, 5, 8, 14, 24, 40, 65, 100];

/// Table row: messages and bytes of a chain, for three ways to choose the target SIRs.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    relays: u16,
    /// Number of passes of messages along the chain, if the target SIR falls by the paper's step of 0.1.
    step_sweeps: u32,
    step_messages: u64,
    step_bytes: u64,
    step_sir_linear: f64,
    /// Number of passes of messages along the chain, with the bracketed schedule.
    ///
    /// The leader then narrows an interval around the best target SIR, without a prediction.
    bracketed_sweeps: u32,
    bracketed_messages: u64,
    bracketed_bytes: u64,
    bracketed_sir_linear: f64,
    /// Number of passes of messages along the chain, if the leader first predicts the target SIR.
    predicted_sweeps: u32,
    predicted_messages: u64,
    predicted_bytes: u64,
    predicted_sir_linear: f64,
}

/// Simulates a chain of each number of relays, with each way to choose the target SIRs.
fn data(relays: &[u16]) -> Result<Vec<Row>, FigureError> {
    relays.par_iter().map(|&relays| row(relays)).collect()
}

fn row(relays: u16) -> Result<Row, FigureError> {
    let mission = paper::flown(&Scenario::default(), relays)?;
    let flown = |schedule: Schedule, predict: bool| -> Result<Flown, FigureError> {
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

fn panel(rows: &[Row], title: &str, of: fn(&Row) -> [f64; 3]) -> Panel {
    let names = [
        "paper's step of 0.1",
        "bracketed targets",
        "bracketed, leader predicts",
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

/// Computes the figure of the passes, messages and bytes until a chain's positions are final.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(&RELAYS)?;
    let ratio = rows.last().map_or(0.0, |row| {
        row.step_messages as f64 / row.predicted_messages.max(1) as f64
    });
    Ok(Sheet {
        name: "cost",
        title: "Passes, messages and bytes until the relays agree",
        says: vec![format!(
            "With 100 relays the paper's schedule takes {ratio:.0} times as many messages as a leader that first solves the chain from the mission. A single relay sends no messages."
        )],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 400) m, \
             relays at least 4 m apart"
                .to_owned(),
            "simulated serial links without faults; counted are all frames on all links, replies and retransmissions included"
                .to_owned(),
            "bracketed targets end within 1e-4 of the optimum, the step of 0.1 within 0.1".to_owned(),
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
