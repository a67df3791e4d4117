//! SIR of a chain whose relays share one altitude, as a function of this altitude.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::Schedule;
use uav_relay::optimiser::plan;

use super::chart::{Axis, Chart, Line, Look, Panel, Stroke};
use super::sheet::{FigureError, Sheet, Table};
use super::{convergence, paper, walk};

/// Number of relays in the figure of the SIR by altitude.
pub const RELAYS: u16 = 50;

/// Distances of the interferer from the line Tx-Rx, m, one for each curve of the figure.
pub const OFFSETS_M: [f64; 5] = [100.0, 150.0, 200.0, 300.0, 400.0];

/// Distance of the interferer from the line Tx-Rx, m, for the paper's best altitude of 220 m.
pub const PAPERS_OFFSET_M: f64 = 150.0;

/// Table row: SIR of the chain at one common altitude, with the interferer at one offset.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    interferer_y_m: f64,
    altitude_m: f64,
    /// SIR of the worst hop by Algorithm 1, linear.
    sir_linear: f64,
    /// SIR of the worst hop with the paper's step, linear; `None` far from the paper's best altitude.
    ///
    /// With this step the target SIR falls by 0.1 from one pass of messages along the chain to the next.
    sir_by_step_linear: Option<f64>,
}

/// Lowest and highest altitude, m, of the part of the figure with a point every 0.5 m.
const CLOSE_UP_M: (u32, u32) = (195, 230);

/// Returns a table row for each pair of an interferer's offset and a common altitude, m.
fn data(pairs: &[(f64, f64)]) -> Result<Vec<Row>, FigureError> {
    pairs.par_iter().map(|&(y, h)| row(y, h)).collect()
}

/// Returns the points of the figure: pairs of an interferer's offset and a common altitude, m.
///
/// Altitudes are in steps of 5 m. For the interferer's offset [`PAPERS_OFFSET_M`], they are in steps of 0.5 m near the
/// paper's best altitude.
fn all_pairs() -> Vec<(f64, f64)> {
    let mut pairs = Vec::new();
    for y in OFFSETS_M {
        let mut altitudes: Vec<f64> = (2..=80_u32).map(|step| 5.0 * f64::from(step)).collect();
        if y.total_cmp(&PAPERS_OFFSET_M).is_eq() {
            let (low, high) = CLOSE_UP_M;
            altitudes.extend((2 * low..=2 * high).map(|half| f64::from(half) / 2.0));
            altitudes.sort_by(f64::total_cmp);
            altitudes.dedup();
        }
        pairs.extend(altitudes.into_iter().map(|altitude| (y, altitude)));
    }
    pairs
}

fn row(y_m: f64, altitude_m: f64) -> Result<Row, FigureError> {
    let mission = paper::mission(&paper::altitudes(y_m, altitude_m), RELAYS)?;
    let (low, high) = CLOSE_UP_M;
    let close_up = (f64::from(low)..=f64::from(high)).contains(&altitude_m);
    let by_step = (close_up && y_m.total_cmp(&PAPERS_OFFSET_M).is_eq())
        .then(|| {
            let schedule = Schedule::FixedStep {
                step: convergence::STEP,
            };
            let agreed = plan::solve(&mission, schedule, |_| mission.config().common)?;
            walk::stretched(&mission, agreed.target).ok_or(FigureError::Unsettled("a chain"))
        })
        .transpose()?;
    Ok(Row {
        interferer_y_m: y_m,
        altitude_m,
        sir_linear: walk::settled(&mission)?.sir,
        sir_by_step_linear: by_step.map(|chain| chain.sir),
    })
}

/// Returns the best common altitude within 20 m to 300 m, m, and its SIR, linear.
///
/// The interferer is at (500, `y_m`) m. The search tries altitudes in steps of 5 m, and then refines the best of them
/// to 0.1 m. The refined altitude is used only if its SIR is higher by more than twice the tolerance of a chain's SIR.
pub fn best_common(relays: u16, y_m: f64) -> Result<(f64, f64), FigureError> {
    let sir = |altitude_m: f64| -> Result<f64, FigureError> {
        let mission = paper::mission(&paper::altitudes(y_m, altitude_m), relays)?;
        Ok(walk::settled(&mission)?.sir)
    };
    let coarse: Result<Vec<(f64, f64)>, FigureError> = (4..=60_u32)
        .into_par_iter()
        .map(|step| {
            let altitude_m = 5.0 * f64::from(step);
            Ok((altitude_m, sir(altitude_m)?))
        })
        .collect();
    let mut best = (0.0, 0.0);
    for here in coarse? {
        if here.1 > best.1 {
            best = here;
        }
    }
    let (mut low, mut high) = ((best.0 - 5.0).max(20.0), (best.0 + 5.0).min(300.0));
    while high - low > 0.1 {
        let third = (high - low) / 3.0;
        let (a, b) = (low + third, high - third);
        if sir(a)? < sir(b)? {
            low = a;
        } else {
            high = b;
        }
    }
    let middle = f64::midpoint(low, high);
    let between = sir(middle)?;
    // A gain within the tolerance of a chain is ignored.
    Ok(if between > best.1 * (1.0 + 2.0 * paper::FINE) {
        (middle, between)
    } else {
        best
    })
}

fn close_up(rows: &[Row]) -> Panel {
    let (low, high) = (f64::from(CLOSE_UP_M.0), f64::from(CLOSE_UP_M.1));
    let near = || {
        rows.iter().filter(|row| {
            row.interferer_y_m.total_cmp(&PAPERS_OFFSET_M).is_eq()
                && (low..=high).contains(&row.altitude_m)
        })
    };
    let exact: Vec<_> = near().map(|row| (row.altitude_m, row.sir_linear)).collect();
    let stepped: Vec<_> = near()
        .filter_map(|row| Some((row.altitude_m, row.sir_by_step_linear?)))
        .collect();
    let by_step = Look::number(5).joined(Stroke::Full).spaced();
    Panel {
        heading: "Y = 150 m, close up".to_owned(),
        x: Axis::linear("common altitude, m").between(low, high),
        y: Axis::linear("SIR of the chain, linear").between(5.3, 5.5),
        lines: vec![
            Line::new("Y = 150 m", Look::number(1).spaced(), exact),
            Line::new("Y = 150 m, step 0.1", by_step, stepped),
        ],
    }
}

/// Computes the figure of the chain's SIR by the relays' common altitude.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(&all_pairs())?;
    let of = |y_m: f64| {
        rows.iter()
            .filter(move |row| row.interferer_y_m.total_cmp(&y_m).is_eq())
    };
    let lines: Vec<Line> = OFFSETS_M
        .iter()
        .enumerate()
        .map(|(index, &y)| {
            let points: Vec<_> = of(y).map(|row| (row.altitude_m, row.sir_linear)).collect();
            Line::new(&format!("Y = {y} m"), Look::number(index).spaced(), points)
        })
        .collect();
    let bests: Result<Vec<String>, FigureError> = OFFSETS_M
        .par_iter()
        .map(|&y| {
            let (altitude, sir) = best_common(RELAYS, y)?;
            Ok(format!("Y = {y} m: {altitude:.0} m, SIR {sir:.4}"))
        })
        .collect();
    Ok(Sheet {
        name: "altitude",
        title: "SIR by the common altitude of fifty relays",
        says: vec![
            format!(
                "Best altitudes between 20 m and 300 m: {}.",
                bests?.join("; ")
            ),
            "The paper reads a best altitude of 220 m off its curve for Y = 150 m. That is an effect of the step of 0.1: the chain ends up to 0.1 below its optimum, by an amount that jumps with the altitude."
                .to_owned(),
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, X = 500 m, N = 50 relays, relays at least 4 m \
             apart"
                .to_owned(),
            "the offsets Y are not in the paper's text, except 150 m".to_owned(),
        ],
        chart: Chart {
            panels: vec![
                Panel {
                    heading: String::new(),
                    x: Axis::linear("common altitude, m").between(0.0, 400.0),
                    y: Axis::linear("SIR of the chain, linear").between(2.0, 14.0),
                    lines,
                },
                close_up(&rows),
            ],
        },
        tables: vec![Table::new("altitude", &rows)?],
        shown: Vec::new(),
    })
}
