//! SIR of a chain that locates an unknown interferer: fixed, by agreement, and moving, by speed.

use serde::Serialize;

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::sheet::{FigureError, Sheet, Table};
use crate::listening::{
    LAST, RandomScene, Shares, hypothetical, mean, moving_shares, quantile, shadowed, shares,
    unknown,
};
use uav_relay_sim::simulator::setup::Setup;

/// Number of random arrangements of interferers for each curve with fixed interferers.
pub const SCENES: u64 = 60;
/// Number of random arrangements for each speed of a moving interferer.
pub const PASSES: u64 = 6;

/// Speeds of the moving interferer, m/s.
pub const SPEEDS_MPS: [f64; 5] = [1.2, 3.0, 5.0, 7.0, 9.0];

/// Table row: SIR as a fraction of the best possible SIR after a number of agreements on positions.
///
/// The row summarises many random arrangements of the interferers.
#[derive(Clone, PartialEq, Debug, Serialize)]
struct AgreementShare {
    scene: &'static str,
    relays: u16,
    /// Number of agreements on positions that used measurements of the interference.
    agreements: usize,
    /// Median of the chain's SIR divided by the best possible SIR, over all arrangements of interferers.
    median_linear: f64,
    /// Fraction of the best possible SIR that nine of ten arrangements of interferers reach.
    tenth_linear: f64,
}

/// Table row: mean of SIR / best possible SIR, for one speed of the interferer.
#[derive(Clone, PartialEq, Debug, Serialize)]
struct Tracked {
    relays: u16,
    speed_mps: f64,
    /// Mean over time of SIR / best possible SIR, if the chain follows the interferer.
    followed_linear: f64,
    /// Mean over time of SIR / best possible SIR, if the chain does not move.
    ///
    /// It keeps the positions that were best after the first minute.
    stayed_linear: f64,
}

type Run = fn(&RandomScene) -> Result<Setup, FigureError>;

/// Kinds of experiments: name, number of relays, number of interferers, and setup function.
const KINDS: [(&str, u16, usize, Run); 6] = [
    ("3 relays, one source", 3, 1, unknown),
    ("8 relays, one source", 8, 1, unknown),
    ("20 relays, one source", 20, 1, unknown),
    ("8 relays, 1 dB position errors", 8, 1, shadowed),
    ("8 relays, two sources", 8, 2, unknown),
    (
        "8 relays, two sources, given a hypothetical one",
        8,
        2,
        hypothetical,
    ),
];

/// Returns table rows of the SIR as a fraction of the best possible SIR, by number of agreements.
///
/// There is a row for each kind of experiment and number of agreements, over `scenes` random arrangements of the
/// interferers.
fn by_agreement(scenes: u64) -> Result<Vec<AgreementShare>, FigureError> {
    let mut rows = Vec::new();
    for (what, relays, sources, run) in KINDS {
        let each: Shares = shares(scenes, relays, sources, run)?;
        for (agreements, mut shares) in each.into_iter().enumerate() {
            rows.push(AgreementShare {
                scene: what,
                relays,
                agreements,
                median_linear: quantile(&mut shares, 0.5),
                tenth_linear: quantile(&mut shares, 0.1),
            });
        }
    }
    Ok(rows)
}

/// Returns table rows of the mean SIR as a fraction of the best possible SIR, by interferer speed.
///
/// There is a row for each number of relays and speed, over `scenes` random arrangements.
fn by_speed(scenes: u64) -> Result<Vec<Tracked>, FigureError> {
    let mut rows = Vec::new();
    for relays in [3, 8] {
        for speed_mps in SPEEDS_MPS {
            let shares = moving_shares(scenes, relays, speed_mps)?;
            rows.push(Tracked {
                relays,
                speed_mps,
                followed_linear: mean(&shares.followed),
                stayed_linear: mean(&shares.stayed),
            });
        }
    }
    Ok(rows)
}

/// Computes the figure of chains that must locate an unknown interferer.
///
/// The first panel shows the lost fraction of the best possible SIR by the number of agreements. The second panel shows
/// the reached fraction by the speed of the interferer.
pub fn sheet() -> Result<Sheet, FigureError> {
    let (found, followed) = (by_agreement(SCENES)?, by_speed(PASSES)?);
    let lines = KINDS.iter().enumerate().map(|(index, (what, ..))| {
        let of = found.iter().filter(|row| row.scene == *what);
        #[expect(clippy::cast_precision_loss, reason = "a few")]
        let points = of.map(|row| (row.agreements as f64, 1.0 - row.median_linear));
        Line::new(what, Look::number(index), points)
    });
    let speeds = |relays: u16, index: usize, name: &str, value: fn(&Tracked) -> f64| {
        let of = followed.iter().filter(|row| row.relays == relays);
        let points = of.map(|row| (row.speed_mps, value(row)));
        Line::new(name, Look::number(index), points)
    };
    let mut shown = vec![
        [
            "",
            "before",
            "after 1",
            "after 3",
            "after 5",
            "10 % after 5",
        ]
        .map(str::to_owned)
        .to_vec(),
    ];
    for (what, ..) in KINDS {
        let at = |agreements: usize| {
            let mut of = found.iter().filter(|row| row.scene == what);
            of.find(|row| row.agreements == agreements)
        };
        let median = |agreements| at(agreements).map_or(f64::NAN, |row| row.median_linear);
        let mut cells = vec![what.to_owned()];
        cells.extend([0, 1, 3, 5].map(|agreements| format!("{:.3}", median(agreements))));
        cells.push(at(5).map_or_else(String::new, |row| format!("{:.3}", row.tenth_linear)));
        shown.push(cells);
    }
    Ok(Sheet {
        name: "sensing",
        title: "Estimation and tracking of an unknown interferer",
        says: vec![
            "Not in the paper, which assumes that the interferer is known. Shown is the SIR as a share of that of a chain that knows the interferer. With two sources it is the share of the exact optimum for their sum, and for comparison that of a chain that is given the paper's single hypothetical interferer."
                .to_owned(),
        ],
        taken: vec![
            format!(
                "each line: median of {SCENES} random scenes, D = 1000 m, sources of 1 to 100 W at x from -200 to 1200 m and 50 to 800 m beside the line; measurements with an error of 3 % every 5 s"
            ),
            format!(
                "{PASSES} scenes for each speed: the interferer passes at 300 m, drones of 10 m/s measure every second; means from one minute after the start"
            ),
        ],
        chart: Chart {
            panels: vec![
                Panel {
                    heading: "static sources".to_owned(),
                    #[expect(clippy::cast_precision_loss, reason = "a few")]
                    x: Axis::linear("agreements after measurements").between(0.0, LAST as f64),
                    y: Axis::log("shortfall from the optimum"),
                    lines: lines.collect(),
                },
                Panel {
                    heading: "an interferer that moves".to_owned(),
                    x: Axis::linear("speed of the interferer, m/s").between(0.0, 10.0),
                    y: Axis::linear("share of the optimum").between(0.5, 1.0),
                    lines: vec![
                        speeds(3, 0, "3 relays, tracking the interferer", |row| row.followed_linear),
                        speeds(8, 1, "8 relays, tracking the interferer", |row| row.followed_linear),
                        speeds(3, 5, "3 relays, staying at the first optimum", |row| row.stayed_linear),
                        speeds(8, 6, "8 relays, staying at the first optimum", |row| row.stayed_linear),
                    ],
                },
            ],
        },
        tables: vec![Table::new("sensing", &found)?, Table::new("following", &followed)?],
        shown,
    })
}
