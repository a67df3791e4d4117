//! Figure of one relay, with the table of its average gains.

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::error::FigureError;
use super::sheet::{Sheet, Table};
use super::single::{ALTITUDES_M, REALISATIONS, Row, SEED, data};
use super::single_gains::{self, RELAY_W, TX_W};
use crate::baseline::random::DRAWS;
use uav_relay_sim::report::db;

fn panel(rows: &[Row], (tx_w, relay_w): (f64, f64)) -> Panel {
    let of = || {
        rows.iter()
            .filter(move |row| (row.tx_w, row.relay_w) == (tx_w, relay_w))
    };
    let line = |name: &str, index: usize, sir: fn(&Row) -> f64| {
        let points = of().map(|row| (f64::from(row.altitude_m), db(sir(row))));
        Line::new(name, Look::number(index).spaced(), points)
    };
    Panel {
        heading: format!("Tx {tx_w} W, relay {relay_w} W"),
        x: Axis::linear("altitude, m").between(10.0, 50.0),
        y: Axis::linear("SIR, dB"),
        lines: vec![
            line("Theorem 1", 0, |row| f64::from(row.sir_linear)),
            line("random position", 1, |row| row.random_sir_linear),
            line("blind to interference", 2, |row| row.blind_sir_linear),
        ],
    }
}

/// Returns the figure, with the table of average gains.
///
/// # Errors
/// Never in practice: see [`FigureError`].
pub fn sheet() -> Result<Sheet, FigureError> {
    let altitudes: Vec<u32> = (ALTITUDES_M.0..=ALTITUDES_M.1).collect();
    let rows = data(&REALISATIONS, &altitudes, DRAWS)?;
    let gains = single_gains::data(&TX_W, &RELAY_W, &altitudes, DRAWS)?;
    let mut says = vec!["The gain is largest at low altitudes, as the paper says.".to_owned()];
    says.extend(single_gains::findings(&gains));
    Ok(Sheet {
        name: "single",
        title: "Single relay at its best position, by altitude",
        says,
        taken: vec![
            "D = 35 m, p_MSI = 20 W, interferer at (30, 30) m".to_owned(),
            "the paper leaves out p_t and p_u: those over the panels are chosen, the first near \
             the printed averages, the second with the blind place straight above Rx at every \
             altitude"
                .to_owned(),
            format!(
                "random: the mean SIR over {DRAWS} places uniform in [0, D] (seed {SEED} + \
             altitude in m), shown as the dB of that mean"
            ),
            "blind: the place of the largest min{p_t / (x^2 + h^2), p_u / ((D - x)^2 + h^2)}; the \
             paper only names the method it compares with"
                .to_owned(),
        ],
        chart: Chart {
            panels: REALISATIONS.map(|powers| panel(&rows, powers)).to_vec(),
        },
        tables: vec![
            Table::new("single", &rows)?,
            Table::new("single-gains", &gains)?,
        ],
        shown: single_gains::shown(&gains),
    })
}
