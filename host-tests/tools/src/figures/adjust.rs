//! Algorithm 2: positions of the relays, and SIR of the chain, by round.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::{Adjust, Local, Method, Mission, Schedule};

use super::chart::{Axis, Chart, Line, Look, Stroke};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use super::walk::{Flown, fly};

/// Number of relays in the figures of Algorithm 2.
pub const RELAYS: u16 = 50;

/// Common altitude of the relays before Algorithm 2, m: the best altitude in the paper.
pub const START_M: f64 = 220.0;

/// Largest change of a relay's altitude in one round of Algorithm 2, m.
pub const EXPLORE_M: f32 = 10.0;

/// Numbers of rounds of Algorithm 2 after which the figure shows the relays' positions.
pub const ROUNDS: [u16; 4] = [0, 10, 50, 500];

/// Search for a relay's best position on a grid, for comparison with the coarse-to-fine search.
pub const GRID: Local = Local::Grid {
    columns: 41,
    rows: 21,
};

/// Table row: position of one relay after a number of rounds of Algorithm 2.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct ShapeRow {
    round: u16,
    relay: u16,
    x_m: f32,
    altitude_m: f32,
}

/// Table row: SIR of the chain after one round of Algorithm 2, with each of two search methods.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct RoundRow {
    /// Round number of Algorithm 2; 0 stands for the chain before the first round.
    round: u16,
    /// SIR of the worst hop with the coarse-to-fine search, linear.
    sir_fine_linear: f32,
    /// SIR of the worst hop with the 41 by 21 grid, linear.
    sir_grid_linear: f32,
}

/// Simulates at most `rounds` rounds of Algorithm 2, for `relays` relays that start at `altitude_m`.
///
/// `local` is the search method for a relay's best position. The interferer is at (500, 150) m.
pub fn adjusted(
    relays: u16,
    altitude_m: f64,
    rounds: u16,
    local: Local,
) -> Result<Flown, FigureError> {
    let method = match rounds {
        0 => Method::Align,
        _ => Method::Adjust(Adjust {
            rounds,
            explore_m: EXPLORE_M,
            local,
        }),
    };
    fly(
        &mission(relays, altitude_m)?,
        method,
        Schedule::Bracketed,
        true,
    )
}

fn mission(relays: u16, altitude_m: f64) -> Result<Mission, FigureError> {
    paper::flown(&paper::altitudes(150.0, altitude_m), relays)
}

/// Returns the relays' positions after each of these numbers of rounds of Algorithm 2.
fn shapes(rounds: &[u16]) -> Result<Vec<ShapeRow>, FigureError> {
    let chains: Result<Vec<Vec<ShapeRow>>, FigureError> = rounds
        .par_iter()
        .map(|&round| {
            let flown = adjusted(RELAYS, START_M, round, Local::Fine)?;
            Ok((1..)
                .zip(flown.places)
                .map(|(relay, place)| ShapeRow {
                    round,
                    relay,
                    x_m: place.x_m,
                    altitude_m: place.altitude_m,
                })
                .collect())
        })
        .collect();
    Ok(chains?.concat())
}

/// Returns the chain's SIR after each round of Algorithm 2, from 0 to `rounds`.
///
/// Each row has the SIR with the coarse-to-fine search and with the grid search. A search that ends earlier keeps its
/// last SIR.
fn rounds(rounds: u16) -> Result<Vec<RoundRow>, FigureError> {
    let (fine, grid) = rayon::join(
        || adjusted(RELAYS, START_M, rounds, Local::Fine),
        || adjusted(RELAYS, START_M, rounds, GRID),
    );
    let (fine, grid) = (fine?.rounds, grid?.rounds);
    let at = |sirs: &[f32], round: u16| {
        sirs.get(usize::from(round))
            .or(sirs.last())
            .copied()
            .ok_or(FigureError::Unsettled("Algorithm 2"))
    };
    (0..=rounds)
        .map(|round| {
            Ok(RoundRow {
                round,
                sir_fine_linear: at(&fine, round)?,
                sir_grid_linear: at(&grid, round)?,
            })
        })
        .collect()
}

fn taken() -> Vec<String> {
    vec![
        "D (Tx to Rx) = 1000 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 150) m, N = 50 relays, relays at \
         least 4 m apart"
            .to_owned(),
        "starts from the positions of Algorithm 1 (bracketed targets, not steps of 0.1) at the paper's h = 220 m"
        .to_owned(),
        "the paper does not state epsilon_h, the grid and the altitude band; chosen: at most 10 m up or down in a round, 20 m to 300 m, and a search from coarse to fine"
            .to_owned(),
    ]
}

/// Formats the horizontal distances of neighbours near Tx, in the middle, and near Rx.
///
/// The relays are at their positions after `round` rounds of Algorithm 2.
fn steps(rows: &[ShapeRow], round: u16) -> String {
    let x = |relay: u16| {
        let mut of = rows.iter().filter(|row| row.round == round);
        of.find(|row| row.relay == relay).map_or(0.0, |row| row.x_m)
    };
    let [head, middle, tail] = [1, RELAYS / 2, RELAYS - 1].map(|relay| x(relay + 1) - x(relay));
    format!("{head:.1} m, {middle:.1} m and {tail:.1} m for k = {round}")
}

/// Computes the figure of the relays' positions after some rounds of Algorithm 2.
pub fn shapes_sheet() -> Result<Sheet, FigureError> {
    let rows = shapes(&ROUNDS)?;
    let mut lines: Vec<Line> = ROUNDS
        .iter()
        .enumerate()
        .map(|(index, &round)| {
            let of = rows.iter().filter(|row| row.round == round);
            let points = of.map(|row| (f64::from(row.x_m), f64::from(row.altitude_m)));
            let look = Look::number(index).joined(Stroke::None);
            Line::new(&format!("k = {round}"), look, points.collect::<Vec<_>>())
        })
        .collect();
    let mark = |name: &str, hue: usize, x_m: f64| {
        let look = Look::number(hue).joined(Stroke::None);
        Line::new(name, look, [(x_m, 0.0)])
    };
    lines.extend([
        mark("interferer", 4, 500.0),
        mark("Tx, Rx", 5, 0.0),
        mark("Tx, Rx", 5, 1000.0),
    ]);
    Ok(Sheet {
        name: "shapes",
        title: "Fifty relays after k rounds of Algorithm 2",
        says: vec![
            "The first and last relays come down toward the ground stations, the middle ones \
             climb away from the interferer, as the paper describes."
                .to_owned(),
            format!(
                "The paper also reports larger horizontal distances between relays at both ends than in the middle. Here that holds until the middle relays have reached the ceiling: the distances from relay 1 to 2, 25 to 26 and 49 to 50 are {}.",
                ROUNDS.map(|round| steps(&rows, round)).join("; "),
            ),
        ],
        taken: taken(),
        chart: Chart::of(
            Axis::linear("x, m").between(-20.0, 1020.0),
            Axis::linear("altitude, m").between(-10.0, 310.0),
            lines,
        ),
        tables: vec![Table::new("shapes", &rows)?],
        shown: Vec::new(),
    })
}

/// Computes the figure of the chain's SIR by round of Algorithm 2.
pub fn rounds_sheet() -> Result<Sheet, FigureError> {
    let most = ROUNDS.iter().copied().fold(0, u16::max);
    let rows = rounds(most)?;
    let joint = fly(
        &mission(RELAYS, START_M)?,
        Method::Joint,
        Schedule::Bracketed,
        true,
    )?;
    let line = |name: &str, index: usize, value: fn(&RoundRow) -> f32| {
        let points = rows
            .iter()
            .map(|row| (f64::from(row.round), f64::from(value(row))));
        Line::new(name, Look::number(index).spaced(), points)
    };
    let gain = |of: fn(&RoundRow) -> f32| match (rows.first(), rows.last()) {
        (Some(first), Some(last)) => 100.0 * (f64::from(of(last)) / f64::from(of(first)) - 1.0),
        _ => 0.0,
    };
    let start = rows
        .first()
        .map_or(0.0, |row| f64::from(row.sir_fine_linear));
    Ok(Sheet {
        name: "rounds",
        title: "SIR by round of Algorithm 2, fifty relays",
        says: vec![
            format!(
                "{most} rounds raise the SIR by {:.1} % with the search from coarse to fine, and by {:.1} % with the grid of 41 by 21. Algorithm 1 has made all hops equal, so a single relay can improve only by steps smaller than those of the coarse grid.",
                gain(|row| row.sir_fine_linear),
                gain(|row| row.sir_grid_linear),
            ),
            format!(
                "The paper prints a gain of 25 %, which from the SIR before the first round would reach SIR {:.2}. Altitudes and positions chosen jointly (`--method joint`, {} passes) reach {:.4}, {:.1} % more than before the first round, within 0.01 % of the true joint optimum 6.49838: with a ceiling of 300 m a gain of 25 % is impossible.",
                1.25 * start,
                joint.sweeps,
                joint.sir,
                100.0 * (joint.sir / start - 1.0),
            ),
        ],
        taken: taken(),
        chart: Chart::of(
            Axis::linear("round k of Algorithm 2").between(0.0, f64::from(most)),
            Axis::linear("SIR of the chain, linear").between(5.25, 6.75),
            vec![
                line("coarse to fine", 0, |row| row.sir_fine_linear),
                line("grid of 41 by 21", 1, |row| row.sir_grid_linear),
                Line::new(
                    "positions and altitudes jointly",
                    Look::number(2).unsigned(),
                    [(0.0, joint.sir), (f64::from(most), joint.sir)],
                ),
            ],
        ),
        tables: vec![Table::new("rounds", &rows)?],
        shown: Vec::new(),
    })
}
