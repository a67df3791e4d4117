//! The paper's figure of Beta distributions of the interference power.

use libm::lgamma;
use serde::Serialize;
use uav_relay::FieldPoint;

use super::chart::{Axis, Chart, Line, Look};
use super::sheet::{FigureError, Sheet, Table};

/// Shape parameters (alpha, beta) of the drawn Beta distributions.
pub const SHAPES: [(f64, f64); 5] = [(1.5, 4.0), (2.0, 2.0), (3.0, 1.2), (4.0, 8.0), (8.0, 4.0)];

/// Number of equal steps of the horizontal axis, which is from 0 to 1.
pub const STEPS: u32 = 100;

/// Table row: one point of the density of a Beta distribution.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    alpha: f64,
    beta: f64,
    /// Product of Upsilon = E[1/I] and the largest interference power `I_max`.
    ///
    /// Relays use 1 / Upsilon as the interference power I.
    upsilon_times_i_max: f64,
    /// Interference power I as a fraction of its maximum `I_max`, 0 to 1.
    interference_over_i_max: f64,
    density: f64,
}

/// Returns points of all Beta densities, at `steps` + 1 equally spaced values from 0 to 1.
fn data(steps: u32) -> Vec<Row> {
    let mut rows = Vec::new();
    for (alpha, beta) in SHAPES {
        let Some(upsilon_times_i_max) = FieldPoint::beta_upsilon(alpha, beta, 1.0) else {
            continue;
        };
        for step in 0..=steps {
            let y = f64::from(step) / f64::from(steps);
            rows.push(Row {
                alpha,
                beta,
                upsilon_times_i_max,
                interference_over_i_max: y,
                density: density(alpha, beta, y),
            });
        }
    }
    rows
}

/// Returns the Beta density y^(alpha - 1) (1 - y)^(beta - 1) / B(alpha, beta) at `y`.
///
/// Both shape parameters must be above 1.
fn density(alpha: f64, beta: f64, y: f64) -> f64 {
    let scale = lgamma(alpha + beta) - lgamma(alpha) - lgamma(beta);
    scale.exp() * y.powf(alpha - 1.0) * (1.0 - y).powf(beta - 1.0)
}

/// Computes the figure of the Beta distributions of the interference power.
pub fn sheet() -> Result<Sheet, FigureError> {
    let rows = data(STEPS);
    let lines = SHAPES
        .iter()
        .enumerate()
        .map(|(index, &(alpha, beta))| {
            let of = rows
                .iter()
                .filter(|row| (row.alpha, row.beta) == (alpha, beta));
            let points: Vec<_> = of
                .map(|row| (row.interference_over_i_max, row.density))
                .collect();
            Line::new(
                &format!("α = {alpha}, β = {beta}"),
                Look::number(index).spaced(),
                points,
            )
        })
        .collect();
    Ok(Sheet {
        name: "beta",
        title: "Beta distributions of the interference power",
        says: vec![
            "A relay needs only one number of such a distribution, Upsilon = E[1/I]; the table has it as a multiple of 1 / I_max."
                .to_owned(),
        ],
        taken: vec![
            "the paper shows its shape parameters only in a picture; these are chosen, all with alpha above 1, because otherwise E[1/I] is infinite"
                .to_owned(),
        ],
        chart: Chart::of(
            Axis::linear("interference power, as a share of the largest").between(0.0, 1.0),
            Axis::linear("probability density"),
            lines,
        ),
        tables: vec![Table::new("beta", &rows)?],
        shown: Vec::new(),
    })
}
