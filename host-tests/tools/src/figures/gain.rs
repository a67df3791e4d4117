//! Gain of Algorithm 1 over random, interference-blind and equally spaced relays.

use rayon::prelude::*;
use serde::Serialize;

use super::chart::{Axis, Chart, Line, Look};
use super::sheet::{FigureError, Sheet, Table};
use super::{paper, walk};
use crate::baseline::{DRAWS, blind_places, equal_places, mean};
use uav_relay_scenario::scene::Scene;

/// Largest number of relays in the figure, which has all numbers from 1 up to this one.
pub const MOST_RELAYS: u16 = 100;

/// Seed of the random chains. A chain of N relays uses this seed plus N.
pub const SEED: u64 = 1000;

/// Table row: SIRs of four placements, and the gains of Algorithm 1, for one number of relays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    relays: u16,
    /// SIR of the worst hop by Algorithm 1, linear.
    sir_linear: f64,
    /// Mean SIR of the worst hop over random chains, linear.
    random_sir_linear: f64,
    /// Standard error of `random_sir_linear`, linear.
    random_error_linear: f64,
    /// SIR of the worst hop if relays maximise the weakest signal without regard to interference, linear.
    blind_sir_linear: f64,
    /// SIR of the worst hop with equal spacing, linear.
    equal_sir_linear: f64,
    gain_over_random_percent: f64,
    gain_over_blind_percent: f64,
    gain_over_equal_percent: f64,
}

/// Returns a table row for each number of relays.
///
/// The mean over random positions is that of `draws` chains.
fn data(relays: &[u16], draws: u32) -> Result<Vec<Row>, FigureError> {
    relays
        .par_iter()
        .map(|&relays| row(relays, draws))
        .collect()
}

fn row(relays: u16, draws: u32) -> Result<Row, FigureError> {
    let mission = paper::mission(&paper::multi_hop(), relays)?;
    let sir = walk::settled(&mission)?.sir;
    let scene = Scene::new(&paper::multi_hop(), relays).ok_or(FigureError::Unsettled("a scene"))?;
    let random = mean(&scene, draws, SEED + u64::from(relays));
    let blind = scene.sir_along(&blind_places(&scene));
    let equal = scene.sir_along(&equal_places(&scene));
    let percent = |over: f64| 100.0 * (sir / over - 1.0);
    Ok(Row {
        relays,
        sir_linear: sir,
        random_sir_linear: random.sir,
        random_error_linear: random.error,
        blind_sir_linear: blind,
        equal_sir_linear: equal,
        gain_over_random_percent: percent(random.sir),
        gain_over_blind_percent: percent(blind),
        gain_over_equal_percent: percent(equal),
    })
}

/// Computes the figure of the gain of Algorithm 1 over placements that ignore the interferer.
pub fn sheet() -> Result<Sheet, FigureError> {
    let relays: Vec<u16> = (1..=MOST_RELAYS).collect();
    let rows = data(&relays, DRAWS)?;
    let line = |name: &str, index: usize, value: fn(&Row) -> f64| {
        let points = rows.iter().map(|row| (f64::from(row.relays), value(row)));
        Line::new(name, Look::number(index).spaced(), points)
    };
    let of = |relays: u16| {
        rows.iter()
            .find(|row| row.relays == relays)
            .map(|row| {
                format!(
                    "N = {relays}: {:.0} % over random, {:.0} % over blind, {:.0} % over equal \
                     distances",
                    row.gain_over_random_percent,
                    row.gain_over_blind_percent,
                    row.gain_over_equal_percent
                )
            })
            .unwrap_or_default()
    };
    Ok(Sheet {
        name: "gain",
        title: "Gain of Algorithm 1 over placements that ignore the interferer",
        says: vec![[8, 50, 100].map(of).join("; ") + "."],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 400) \
             m"
            .to_owned(),
            format!(
                "random: mean SIR of the worst hop over {DRAWS} chains with positions uniform in [0, D], in order (seed {SEED} + N)"
            ),
            "blind (ignores the interferer): the chain whose weakest received signal is strongest; the paper only names this method. From N = 43 on the last relay of every such chain is \
             straight above Rx, so all x are multiplied by the same factor below 1"
                .to_owned(),
            "equal: relay k at k D / (N + 1); not in the paper".to_owned(),
            "Algorithm 1 with the arithmetic of the relays, within 1e-6 of its optimum instead of a step of 0.1"
                .to_owned(),
        ],
        chart: Chart::of(
            Axis::log("number of relays N").between(1.0, 100.0),
            Axis::log("gain in SIR, %"),
            vec![
                line("over random", 0, |row| row.gain_over_random_percent),
                line("over equal distances", 1, |row| row.gain_over_equal_percent),
                line("over blind", 2, |row| row.gain_over_blind_percent),
            ],
        ),
        tables: vec![Table::new("gain", &rows)?],
        shown: Vec::new(),
    })
}
