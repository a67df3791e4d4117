//! Algorithm 1 with the paper's step: SIR of the chain after each pass of messages.

use rayon::prelude::*;
use serde::Serialize;

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::sheet::{FigureError, Sheet, Table};
use super::{paper, walk};

/// Numbers of relays in the chains of the figure, one chain for each curve.
pub const RELAYS: [u16; 5] = [2, 8, 20, 50, 100];

/// Decrease of the target SIR from one pass of messages to the next, linear, as in the paper.
pub const STEP: f64 = 0.1;

/// Table row: SIR of a chain after one pass of messages along the chain.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    relays: u16,
    sweep: u32,
    /// Target SIR of every hop in this pass of messages, linear.
    target_linear: f32,
    /// SIR of the worst hop, linear, with every relay as far toward Rx as the target allows.
    sir_linear: f64,
}

/// Returns table rows for the passes of messages of each chain, until its positions are final.
///
/// Some passes are left out, because they are too many to draw.
fn data(relays: &[u16]) -> Result<Vec<Row>, FigureError> {
    let chains: Result<Vec<Vec<Row>>, FigureError> =
        relays.par_iter().map(|&relays| sweeps(relays)).collect();
    Ok(chains?
        .into_iter()
        .flat_map(|rows| thinned(&rows))
        .collect())
}

fn sweeps(relays: u16) -> Result<Vec<Row>, FigureError> {
    let mission = paper::mission(&paper::multi_hop(), relays)?;
    let sweeps = walk::descent(&mission, STEP)?;
    let row = |sweep: walk::Sweep| {
        Some(Row {
            relays,
            sweep: sweep.number,
            target_linear: sweep.target,
            sir_linear: sweep.chain?.sir,
        })
    };
    Ok(sweeps.into_iter().filter_map(row).collect())
}

/// Selects the sweeps that the figure shows, more densely toward the end.
///
/// A sweep is a pass of messages along the chain. The selected sweeps are the first sweep, every 100th, every 10th of the last 1000, and the last 20.
fn thinned(rows: &[Row]) -> Vec<Row> {
    let end = rows.last().map_or(0, |row| row.sweep);
    rows.iter()
        .filter(|row| {
            let left = end - row.sweep;
            row.sweep == 1
                || row.sweep % 100 == 0
                || (left < 1000 && row.sweep % 10 == 0)
                || left < 20
        })
        .copied()
        .collect()
}

/// Computes the figure of a chain's SIR by the number of passes of messages in Algorithm 1.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(&RELAYS)?;
    let lines = |from: u32| -> Vec<Line> {
        RELAYS
            .iter()
            .enumerate()
            .map(|(index, &relays)| {
                let of = rows
                    .iter()
                    .filter(|row| row.relays == relays && row.sweep >= from);
                let points: Vec<_> = of
                    .map(|row| (f64::from(row.sweep), row.sir_linear))
                    .collect();
                Line::new(
                    &format!("N = {relays}"),
                    Look::number(index).spaced(),
                    points,
                )
            })
            .collect()
    };
    let y = || Axis::log("SIR of the chain, linear").between(0.5, 50.0);
    let panel = |heading: &str, x: Axis, lines| Panel {
        heading: heading.to_owned(),
        x,
        y: y(),
        lines,
    };
    let ends: Vec<String> = RELAYS
        .iter()
        .filter_map(|&relays| rows.iter().rfind(|row| row.relays == relays))
        .map(|row| {
            format!(
                "N = {}: sweep {}, SIR {:.4}",
                row.relays, row.sweep, row.sir_linear
            )
        })
        .collect();
    Ok(Sheet {
        name: "convergence",
        title: "Algorithm 1 with the paper's step of 0.1, sweep by sweep",
        says: vec![
            "The target SIR starts above 1000 and falls by 0.1 with each sweep; nearly all of the ten thousand sweeps try targets that are far too high. The last point of each line is the result."
                .to_owned(),
            format!("Settled: {}.", ends.join("; ")),
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 400) m, \
             step 0.1 linear SIR"
                .to_owned(),
            "the numbers of relays are not in the paper's text".to_owned(),
            "plotted: SIR of the worst hop, including the hop to Rx, with every relay as far toward Rx as the target of the sweep permits"
                .to_owned(),
            "the minimum separation of 4 m is ignored, as in the printed algorithm (at the highest targets relays would be 2 m apart)"
                .to_owned(),
            "rows: every 100th sweep, every 10th of the last 1000, the last 20".to_owned(),
        ],
        chart: Chart {
            panels: vec![
                panel(
                    "all sweeps",
                    Axis::linear("sweep").between(0.0, 11000.0),
                    lines(0),
                ),
                panel(
                    "the last sweeps",
                    Axis::linear("sweep").between(9700.0, 10300.0),
                    lines(9700),
                ),
            ],
        },
        tables: vec![Table::new("convergence", &rows)?],
        shown: Vec::new(),
    })
}
