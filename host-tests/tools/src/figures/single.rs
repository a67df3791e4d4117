//! Relay at its best position (Theorem 1), compared with random, blind and middle positions.
//!
//! A blind position ignores the interference.

use crate::single::theorems;
use rayon::prelude::*;
use serde::Serialize;
use uav_relay_scenario::scene::Scene;
use uav_relay_scenario::{Interference, Scenario, Source, mission};
use uav_relay_sim::report::db;

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::sheet::{FigureError, Sheet, Table};
use crate::baseline::{DRAWS, blind_places, equal_places, mean};

/// Powers of Tx and of the relay, W, one pair for each panel of the figure.
pub const REALISATIONS: [(f64, f64); 2] = [(100.0, 0.5), (80.0, 2.0)];

/// First and last altitude of the figure, m, in steps of 1 m.
pub const ALTITUDES_M: (u32, u32) = (10, 50);

/// Seed of the relay's random positions. Each altitude uses this seed plus the altitude in metres.
pub const SEED: u64 = 2000;

/// Table row: SIRs of a single relay at several positions, for one altitude and pair of powers.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    tx_w: f64,
    relay_w: f64,
    altitude_m: u32,
    x_m: f32,
    /// SIR of the worse hop with the relay at its best position (Theorem 1), linear.
    sir_linear: f32,
    /// Mean SIR of the worse hop over random positions of the relay, linear.
    random_sir_linear: f64,
    /// Standard error of `random_sir_linear`, linear.
    random_error_linear: f64,
    /// Mean over random positions of the worse hop's SIR in dB.
    random_sir_db: f64,
    /// Mean over random positions of log2(1 + SIR) of the worse hop, bit/s/Hz.
    random_rate_bit_per_s_hz: f64,
    /// SIR of the worse hop, linear, with the relay at the blind position. There the weaker received signal is
    /// strongest.
    ///
    /// This position does not depend on the interference.
    blind_sir_linear: f64,
    middle_sir_linear: f64,
}

/// Returns the paper's dual-hop scenario, with one relay at `altitude_m`.
///
/// It is the third part of the paper's table of parameters.
pub fn scenario(tx_w: f64, relay_w: f64, altitude_m: u32) -> Scenario {
    let altitude_m = f64::from(altitude_m);
    Scenario {
        distance_m: 35.0,
        min_separation_m: 0.0,
        tx_w,
        uav_w: relay_w,
        altitude_m,
        altitude_min_m: altitude_m,
        altitude_max_m: altitude_m,
        interference: Interference::Sources(vec![Source {
            power_w: 20.0,
            x_m: 30.0,
            y_m: 30.0,
        }]),
        ..Scenario::default()
    }
}

/// Returns a table row for each pair of powers (Tx, relay) and altitude.
///
/// The mean over random positions is that of `draws` positions.
fn data(powers_w: &[(f64, f64)], altitudes_m: &[u32], draws: u32) -> Result<Vec<Row>, FigureError> {
    let choices: Vec<(f64, f64, u32)> = powers_w
        .iter()
        .flat_map(|&(tx, relay)| altitudes_m.iter().map(move |&h| (tx, relay, h)))
        .collect();
    choices
        .par_iter()
        .map(|&(tx_w, relay_w, altitude_m)| {
            row(tx_w, relay_w, altitude_m, draws).ok_or(FigureError::Unsettled("a single relay"))
        })
        .collect()
}

fn row(tx_w: f64, relay_w: f64, altitude_m: u32, draws: u32) -> Option<Row> {
    let scenario = scenario(tx_w, relay_w, altitude_m);
    let (mission, _) = mission::mission(&scenario, 1, 1e-4).ok()?;
    let scene = Scene::new(&scenario, 1)?;
    let (best, _) = theorems::best_at_altitude(&mission, mission.config().common)?;
    let random = mean(&scene, draws, SEED + u64::from(altitude_m));
    Some(Row {
        tx_w,
        relay_w,
        altitude_m,
        x_m: best.place.x_m,
        sir_linear: best.sir,
        random_sir_linear: random.sir,
        random_error_linear: random.error,
        random_sir_db: random.db,
        random_rate_bit_per_s_hz: random.rate,
        blind_sir_linear: scene.sir_along(&blind_places(&scene)),
        middle_sir_linear: scene.sir_along(&equal_places(&scene)),
    })
}

// Average gain of one relay at its best position, by several readings of the paper.
//
// The paper prints an average gain in SIR of 30.14 % over a random position and of 25.73 % over the interference-blind
// method, and up to 65 %. It does not print the powers, so this file computes many powers and several ways of
// averaging.

/// Powers of Tx, W, in the table of average gains.
pub const TX_W: [f64; 17] = [
    5.0, 6.3, 8.0, 10.0, 12.5, 16.0, 20.0, 25.0, 31.5, 40.0, 50.0, 63.0, 80.0, 100.0, 125.0, 160.0,
    200.0,
];

/// Powers of the relay, W, in the table of average gains.
pub const RELAY_W: [f64; 17] = [
    0.5, 0.63, 0.8, 1.0, 1.25, 1.6, 2.0, 2.5, 3.15, 4.0, 5.0, 6.3, 8.0, 10.0, 12.5, 16.0, 20.0,
];

/// Average gains stated in the paper, percent: over random positions, and over the blind method.
///
/// The blind method ignores the interference.
pub const PRINTED_PERCENT: (f64, f64) = (30.14, 25.73);

const PRINTED_LARGEST_PERCENT: f64 = 65.0;

/// Largest difference at which a computed and a printed gain count as equal, percentage points.
const NEAR: f64 = 0.5;

/// Reading of the paper's "average gain": the quantity that is averaged over the altitudes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
pub enum Reading {
    /// Mean over the altitudes of the gain in linear SIR.
    #[serde(rename = "mean of linear gains")]
    LinearGains,
    /// Gain of the mean linear SIR, where the linear SIRs are averaged over the altitudes.
    #[serde(rename = "gain of mean linear SIR")]
    LinearMeans,
    /// Gain of the mean SIR, where the SIRs are averaged in dB over the altitudes.
    #[serde(rename = "gain of mean dB")]
    Decibels,
    /// Gain of the mean of log2(1 + SIR) over the altitudes.
    #[serde(rename = "gain of mean log2(1 + SIR)")]
    Rates,
}

/// List of all readings of the paper's "average gain".
pub const READINGS: [Reading; 4] = [
    Reading::LinearGains,
    Reading::LinearMeans,
    Reading::Decibels,
    Reading::Rates,
];

impl Reading {
    const fn words(self) -> &'static str {
        match self {
            Self::LinearGains => "mean of linear gains",
            Self::LinearMeans => "gain of mean linear SIR",
            Self::Decibels => "gain of mean dB",
            Self::Rates => "gain of mean log2(1 + SIR)",
        }
    }
}

/// Table row: gains of the best position over other positions, for one pair of powers.
///
/// `reading` states how the gains are averaged over the altitudes.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct GainRow {
    tx_w: f64,
    relay_w: f64,
    reading: Reading,
    /// Average gain over a random position, percent.
    ///
    /// `None` if the average for the random position is 0 or less, which is possible for an average in dB.
    over_random_percent: Option<f64>,
    /// Average gain over the position that ignores the interference, percent.
    ///
    /// `None` if the average for that position is 0 or less, which is possible for an average in dB.
    over_blind_percent: Option<f64>,
    over_middle_percent: Option<f64>,
    /// Largest gain in linear SIR over a random position, percent: the maximum over the altitudes.
    largest_over_random_percent: f64,
    /// Largest gain in linear SIR over the position that ignores the interference, percent.
    ///
    /// It is the maximum over the altitudes.
    largest_over_blind_percent: f64,
}

/// Returns the average gains for every pair of powers (Tx, relay), W, and every reading.
///
/// The averages are over the altitudes, m. Random positions are averaged over `draws`.
fn gains(
    tx_w: &[f64],
    relay_w: &[f64],
    altitudes_m: &[u32],
    draws: u32,
) -> Result<Vec<GainRow>, FigureError> {
    let powers: Vec<(f64, f64)> = tx_w
        .iter()
        .flat_map(|&tx| relay_w.iter().map(move |&relay| (tx, relay)))
        .collect();
    let rows = data(&powers, altitudes_m, draws)?;
    let choices = rows.chunks(altitudes_m.len().max(1));
    Ok(choices
        .flat_map(|rows| READINGS.map(|reading| read(rows, reading)))
        .flatten()
        .collect())
}

/// Returns the quantity that `reading` averages, for four positions of the relay at one altitude.
///
/// The positions are the best one, a random one, the one that ignores the interference, and the middle.
fn four(row: &Row, reading: Reading) -> [f64; 4] {
    let linear = [
        f64::from(row.sir_linear),
        row.random_sir_linear,
        row.blind_sir_linear,
        row.middle_sir_linear,
    ];
    let [best, _, blind, middle] = linear;
    let rate = |sir: f64| sir.ln_1p() / std::f64::consts::LN_2;
    match reading {
        Reading::LinearGains | Reading::LinearMeans => linear,
        Reading::Decibels => [db(best), row.random_sir_db, db(blind), db(middle)],
        Reading::Rates => [
            rate(best),
            row.random_rate_bit_per_s_hz,
            rate(blind),
            rate(middle),
        ],
    }
}

/// Averages the gains in `rows`, the altitudes of one pair of powers, as `reading` states.
///
/// `None` if there are no rows.
fn read(rows: &[Row], reading: Reading) -> Option<GainRow> {
    let first = rows.first()?;
    let percent = |best: f64, under: f64| 100.0 * (best / under - 1.0);
    let mut sums = [0.0; 4];
    let mut gains = [0.0; 4];
    let mut largest = [0.0_f64; 4];
    for row in rows {
        let values = four(row, reading);
        let linear = four(row, Reading::LinearGains);
        let [best, ..] = linear;
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += value;
        }
        for ((gain, most), value) in gains.iter_mut().zip(&mut largest).zip(linear) {
            *gain += percent(best, value) / rows.len() as f64;
            *most = most.max(percent(best, value));
        }
    }
    let [best, ..] = sums;
    let [_, random, blind, middle] = match reading {
        Reading::LinearGains => gains.map(Some),
        _ => sums.map(|sum| (sum > 0.0).then(|| percent(best, sum))),
    };
    let [_, over_random, over_blind, _] = largest;
    Some(GainRow {
        tx_w: first.tx_w,
        relay_w: first.relay_w,
        reading,
        over_random_percent: random,
        over_blind_percent: blind,
        over_middle_percent: middle,
        largest_over_random_percent: over_random,
        largest_over_blind_percent: over_blind,
    })
}

/// Returns the larger difference between a row's two average gains and the printed gains.
///
/// The difference is in percentage points. The first gain is over random positions. The second gain is over the middle
/// between Tx and Rx if `middle` is true, otherwise over the blind method, which ignores the interference.
fn off(row: &GainRow, middle: bool) -> f64 {
    let other = if middle {
        row.over_middle_percent
    } else {
        row.over_blind_percent
    };
    let from = |value: Option<f64>, printed: f64| {
        value.map_or(f64::INFINITY, |value| (value - printed).abs())
    };
    from(row.over_random_percent, PRINTED_PERCENT.0).max(from(other, PRINTED_PERCENT.1))
}

/// Returns two paragraphs that state how many computed averages agree with the paper's averages.
fn findings(gains: &[GainRow]) -> Vec<String> {
    let least = |reading: Reading| {
        let of = gains.iter().filter(|row| row.reading == reading);
        of.filter_map(|row| row.over_random_percent)
            .fold(f64::INFINITY, f64::min)
    };
    let near = |middle: bool| gains.iter().filter(|row| off(row, middle) <= NEAR).count();
    let (random, blind) = PRINTED_PERCENT;
    vec![
        format!(
            "The paper prints average gains of {random} % over random and {blind} % over the \
             blind method, and up to {PRINTED_LARGEST_PERCENT} %, for powers that it does not \
             print. Of {} choices of p_t and p_u, each evaluated with {} definitions of the \
             average gain, {} come within {NEAR} percentage points of both averages; with the \
             middle between Tx and Rx in place of the blind method it is {}.",
            gains.len() / READINGS.len(),
            READINGS.len(),
            near(false),
            near(true),
        ),
        format!(
            "In linear SIR, which is what the text says, the average gain over random is at least \
             {:.1} % (mean of the gains) or {:.1} % (gain of the means) for every one of them: \
             the printed averages are not reproduced. With two free powers against two figures, \
             an agreement in another reading would prove nothing. The table has the nearest \
             choice of each reading.",
            least(Reading::LinearGains),
            least(Reading::LinearMeans),
        ),
    ]
}

/// Returns the cells of the caption's table, which compares printed with computed averages.
///
/// The first row has the printed averages. Then each reading has a row: its averages nearest to the printed ones, and
/// the pair of powers that gives them. The last rows are for the pairs of powers in the figure.
fn shown(gains: &[GainRow]) -> Vec<Vec<String>> {
    let head = [
        "reading",
        "p_t, p_u",
        "over random, %",
        "over blind, %",
        "over the middle, %",
        "largest gain over random, over blind, %",
    ];
    let percent =
        |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
    let cells = |words: String, row: &GainRow| {
        vec![
            words,
            format!("{} W, {} W", row.tx_w, row.relay_w),
            percent(row.over_random_percent),
            percent(row.over_blind_percent),
            percent(row.over_middle_percent),
            format!(
                "{:.1}, {:.1}",
                row.largest_over_random_percent, row.largest_over_blind_percent
            ),
        ]
    };
    let mut rows = vec![head.map(str::to_owned).to_vec()];
    let (random, blind) = PRINTED_PERCENT;
    let printed = [
        "printed".to_owned(),
        "not printed".to_owned(),
        random.to_string(),
        blind.to_string(),
        "-".to_owned(),
        format!("{PRINTED_LARGEST_PERCENT} of either"),
    ];
    rows.push(printed.to_vec());
    for (middle, of) in [(false, "blind"), (true, "the middle")] {
        for reading in READINGS {
            let nearest = gains
                .iter()
                .filter(|row| row.reading == reading)
                .min_by(|a, b| off(a, middle).total_cmp(&off(b, middle)));
            rows.extend(
                nearest.map(|row| cells(format!("{}, nearest by {of}", reading.words()), row)),
            );
        }
    }
    let drawn = |row: &&GainRow| {
        REALISATIONS.contains(&(row.tx_w, row.relay_w)) && row.reading == Reading::LinearGains
    };
    rows.extend(
        gains
            .iter()
            .filter(drawn)
            .map(|row| cells(format!("{}, as drawn", row.reading.words()), row)),
    );
    rows
}

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

/// Computes the figure of a single relay at its best position, with the table of average gains.
pub fn sheet() -> Result<Sheet, FigureError> {
    let altitudes: Vec<u32> = (ALTITUDES_M.0..=ALTITUDES_M.1).collect();
    let rows = data(&REALISATIONS, &altitudes, DRAWS)?;
    let gains = gains(&TX_W, &RELAY_W, &altitudes, DRAWS)?;
    let mut says = vec!["The gain is largest at low altitudes, as the paper says.".to_owned()];
    says.extend(findings(&gains));
    Ok(Sheet {
        name: "single",
        title: "Single relay at its best position, by altitude",
        says,
        taken: vec![
            "D (Tx to Rx) = 35 m, p_MSI = 20 W (interferer), interferer at (30, 30) m".to_owned(),
            "the paper does not state p_t and p_u: the powers above the panels are our choice; those of the first panel give gains near the printed averages, with those of the second the blind position is right above Rx at every altitude"
                .to_owned(),
            format!(
                "random: mean SIR over {DRAWS} positions uniform in [0, D] (seed {SEED} + altitude in m), shown as the dB of that mean"
            ),
            "blind: the position with the largest min{p_t / (x^2 + h^2), p_u / ((D - x)^2 + h^2)}; the paper only names this method"
                .to_owned(),
        ],
        chart: Chart {
            panels: REALISATIONS.map(|powers| panel(&rows, powers)).to_vec(),
        },
        tables: vec![
            Table::new("single", &rows)?,
            Table::new("single-gains", &gains)?,
        ],
        shown: shown(&gains),
    })
}
