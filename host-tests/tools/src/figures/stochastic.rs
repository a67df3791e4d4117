//! Algorithm 4 with the paper's step. The interference varies along the line Tx-Rx, or is the same.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use serde::Serialize;
use uav_relay::Mission;

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::sheet::{FigureError, Sheet, Table};
use super::{convergence, paper, walk};
use uav_relay_scenario::{BetaPoint, Field, Interference, Scenario};

/// Numbers of relays, one for each curve of the figure.
pub const RELAYS: [u16; 5] = [10, 20, 30, 40, 50];

/// Seed of the interference that varies along the line Tx-Rx.
pub const SEED: u64 = 4;

const SPACING_M: u32 = 20;

const ALPHA: f64 = 3.0;

/// Largest interference power, as a multiple of the power received from a 1 W sender below the relay.
const MOST: f64 = 2.0;

/// Kind of interference: varying along the line Tx-Rx, or the same everywhere.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Interference that varies along the line Tx-Rx: E[1 / I] is between 0.6 / P and 1 / P.
    ///
    /// I is the interference power. P is the power that a relay receives from a 1 W sender vertically below the relay.
    Uneven,
    /// Interference that is the same everywhere: E[1 / I] is 0.8 / P.
    ///
    /// I is the interference power. P is the power that a relay receives from a 1 W sender vertically below the relay.
    Even,
}

/// Table row: expected SIR of a chain in random interference, after one pass of messages.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    field: Kind,
    relays: u16,
    sweep: u32,
    /// Target of every hop's expected SIR in this pass of messages, linear.
    target_linear: f32,
    /// Expected SIR of the worst hop after this pass of messages, linear.
    sir_linear: f64,
}

/// Table row: distribution of the interference power I at one x between Tx and Rx.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct PointRow {
    field: Kind,
    x_m: f64,
    /// First shape parameter of the Beta distribution of I / `I_max`.
    alpha: f64,
    beta: f64,
    /// Largest interference power `I_max`, W.
    i_max_w: f64,
}

/// Returns the power, W, that a relay receives from a 1 W sender vertically below the relay.
fn lambda_w(mission: &Mission) -> f64 {
    let height = f64::from(mission.config().common.altitude_m);
    1.0 / (mission.config().channel.eta() * height * height)
}

/// Returns the distributions of the interference of this `kind` at points between Tx and Rx.
///
/// Relays interpolate between the points. Interference that is the same everywhere has one point.
fn field(kind: Kind) -> Result<Vec<PointRow>, FigureError> {
    let lambda = lambda_w(&paper::mission(&paper::multi_hop(), 1)?);
    let i_max_w = MOST * lambda;
    // Upsilon = (1 + beta / (alpha - 1)) / I_max is `part` / Lambda.
    let point = |x_m: f64, part: f64| PointRow {
        field: kind,
        x_m,
        alpha: ALPHA,
        beta: (MOST * part - 1.0) * (ALPHA - 1.0),
        i_max_w,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    Ok(match kind {
        Kind::Even => vec![point(0.0, 0.8)],
        Kind::Uneven => (0..=1000 / SPACING_M)
            .map(|k| point(f64::from(k * SPACING_M), rng.random_range(0.6..=1.0)))
            .collect(),
    })
}

/// Returns the mission of `relays` relays in interference of this kind.
pub fn mission(kind: Kind, relays: u16) -> Result<Mission, FigureError> {
    let points = field(kind)?;
    let spec = Field {
        i_max_w: points.first().map_or(0.0, |point| point.i_max_w),
        beta: points
            .iter()
            .map(|point| BetaPoint {
                x_m: point.x_m,
                alpha: point.alpha,
                beta: point.beta,
            })
            .collect(),
    };
    let scenario = Scenario {
        interference: Interference::Field(spec),
        ..paper::multi_hop()
    };
    paper::mission(&scenario, relays)
}

/// Returns a table row for each pass of messages of each chain.
///
/// There is a chain for each of these numbers of relays and each kind of interference.
fn data(relays: &[u16]) -> Result<Vec<Row>, FigureError> {
    let mut rows = Vec::new();
    for field in [Kind::Uneven, Kind::Even] {
        for &relays in relays {
            for sweep in walk::descent(&mission(field, relays)?, convergence::STEP)? {
                let chain = sweep.chain.ok_or(FigureError::Unsettled("a sweep"))?;
                rows.push(Row {
                    field,
                    relays,
                    sweep: sweep.number,
                    target_linear: sweep.target,
                    sir_linear: chain.sir,
                });
            }
        }
    }
    Ok(rows)
}

/// Returns the cells of the caption's table: final SIRs by three searches for the target SIR.
///
/// The first search lowers the target SIR by the paper's step of 0.1 in each pass of messages, the second by 0.01. The
/// third narrows an interval around the best target SIR.
fn shown() -> Result<Vec<Vec<String>>, FigureError> {
    let mut rows = vec![
        ["field", "N", "step 0.1", "step 0.01", "bracketed targets"]
            .map(str::to_owned)
            .to_vec(),
    ];
    for field in [Kind::Uneven, Kind::Even] {
        for relays in RELAYS {
            let mission = mission(field, relays)?;
            let stepped = |step: f64| -> Result<String, FigureError> {
                let sweeps = walk::descent(&mission, step)?;
                let chain = sweeps.last().and_then(|sweep| sweep.chain.as_ref());
                let sir = chain.map_or(0.0, |chain| chain.sir);
                Ok(format!("{sir:.4} in {} sweeps", sweeps.len()))
            };
            let name = match field {
                Kind::Uneven => "not i.i.d.",
                Kind::Even => "i.i.d.",
            };
            rows.push(vec![
                name.to_owned(),
                relays.to_string(),
                stepped(convergence::STEP)?,
                stepped(convergence::STEP / 10.0)?,
                format!("{:.4}", walk::settled(&mission)?.sir),
            ]);
        }
    }
    Ok(rows)
}

/// Returns the curve of one chain: its SIR after each pass of messages.
///
/// A chain with final positions keeps its SIR up to the right end of the picture.
fn line(rows: &[Row], field: Kind, index: usize, relays: u16) -> Line {
    let of = rows
        .iter()
        .filter(|row| row.field == field && row.relays == relays);
    let mut points: Vec<_> = of
        .map(|row| (f64::from(row.sweep), row.sir_linear))
        .collect();
    if let Some(&(last, sir)) = points.last() {
        points.extend(
            (1..=10)
                .map(f64::from)
                .filter(|&n| n > last)
                .map(|n| (n, sir)),
        );
    }
    Line::new(&format!("N = {relays}"), Look::number(index), points)
}

/// Computes the figure of the expected SIR after each pass of messages of Algorithm 4.
///
/// It has a panel for each kind of interference.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(&RELAYS)?;
    let panel = |heading: &str, field: Kind| Panel {
        heading: heading.to_owned(),
        x: Axis::linear("sweep").between(1.0, 10.0),
        y: Axis::log("expected SIR, linear").between(0.02, 1.0),
        lines: RELAYS
            .iter()
            .enumerate()
            .map(|(index, &relays)| line(&rows, field, index, relays))
            .collect(),
    };
    let points = [field(Kind::Uneven)?, field(Kind::Even)?].concat();
    Ok(Sheet {
        name: "stochastic",
        title: "Algorithm 4 with the paper's step of 0.1, sweep by sweep",
        says: vec![
            "The last SIR of each line is the result. Where the interference is not the same \
             everywhere, a lower target may give a lower SIR, as the paper says."
                .to_owned(),
            "The step of 0.1 is an eighth of the largest expected SIR; the table has the loss that it causes. With 8 relays or fewer and i.i.d. interference it skips all targets that can be met: 8 relays end at 0.0003 instead of 0.0912."
                .to_owned(),
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = 80 W, p_u (relay) = 1 W, step 0.1 linear SIR; Lambda = 1 / (eta \
             h^2)"
                .to_owned(),
            "Upsilon = (alpha + beta - 1) / ((alpha - 1) I_max); the paper prints (alpha + beta) \
             / alpha, which is not E[1/I] of a Beta distribution, omits I_max, and 0.8 Lambda where only 0.8 / Lambda is possible"
                .to_owned(),
            "i.i.d.: Upsilon = 0.8 / Lambda; not i.i.d.: random between 0.6 / Lambda and 1 / Lambda every 20 m (seed 4), with straight lines in between"
                .to_owned(),
            "alpha = 3 and I_max = 2 Lambda everywhere, and beta follows from Upsilon; the paper states neither these nor the numbers of relays"
                .to_owned(),
            "Algorithm 4 as corrected: the last hop follows the target, and no relay is placed before Tx"
            .to_owned(),
        ],
        chart: Chart {
            panels: vec![
                panel("not i.i.d. along x", Kind::Uneven),
                panel("i.i.d. along x", Kind::Even),
            ],
        },
        tables: vec![
            Table::new("stochastic", &rows)?,
            Table::new("stochastic-field", &points)?,
        ],
        shown: shown()?,
    })
}
