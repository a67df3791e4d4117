//! Relay beside the line Tx-Rx: its best position, and the SIR gained by lateral and vertical freedom.

use crate::single::{Found, aside, theorems};
use rayon::prelude::*;
use serde::Serialize;
use uav_relay::Mission;

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use uav_relay_scenario::Scenario;

/// Power of the single relay, W.
pub const RELAY_W: f64 = 0.5;

/// Lowest and highest altitude that the relay may have, m.
pub const ALTITUDES_M: (f64, f64) = (20.0, 300.0);

/// Distances of the interferer from the line Tx-Rx, m, one for each curve of the figure of positions.
pub const OFFSETS_M: [f64; 4] = [50.0, 100.0, 150.0, 250.0];

/// Largest distance from the line Tx-Rx that a relay may have in the figure of positions, m.
pub const MOST_ROOM_M: u16 = 400;

const ROOM_STEP_M: u16 = 4;

/// Largest distance from the line Tx-Rx that the relay may have in the figure of the SIR gain, m.
///
/// It equals the highest altitude: the figure compares lateral with vertical freedom.
pub const ROOM_M: f64 = 300.0;

/// Largest distance of the interferer from the line Tx-Rx in the figure of the SIR gain, m.
const MOST_OFFSET_M: u16 = 400;
const OFFSET_STEP_M: u16 = 5;

/// Table row: best position of the relay for one limit of its distance from the line Tx-Rx.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    interferer_y_m: f64,
    room_m: f64,
    x_m: f32,
    y_m: f32,
    /// SIR of the weaker of the relay's two hops at its best position, linear.
    sir_linear: f32,
}

/// Table row: best SIRs of one relay with four kinds of freedom.
///
/// The relay has y = 0 or any permitted y, at the lowest altitude or at any permitted altitude.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct PowerRatio {
    interferer_y_m: f64,
    /// Best SIR of a relay with y = 0 at the lowest altitude, linear.
    line_sir_linear: f32,
    /// Best SIR of a relay with y = 0 at any permitted altitude, linear.
    altitude_sir_linear: f32,
    /// Best SIR of a relay with any permitted y at the lowest altitude, linear.
    side_sir_linear: f32,
    both_sir_linear: f32,
    both_altitude_m: f32,
}

fn mission(offset_m: f64, room_m: f64) -> Result<Mission, FigureError> {
    let scenario = Scenario {
        altitude_m: ALTITUDES_M.0,
        altitude_min_m: ALTITUDES_M.0,
        altitude_max_m: ALTITUDES_M.1,
        lateral_min_m: -room_m,
        lateral_max_m: room_m,
        uav_w: RELAY_W,
        ..paper::with_interferer(paper::multi_hop(), 500.0, offset_m)
    };
    paper::mission(&scenario, 1)
}

fn some<C>(found: Option<(Found, C)>) -> Result<Found, FigureError> {
    let (found, _) = found.ok_or(FigureError::Unsettled("a single relay"))?;
    Ok(found)
}

/// Returns the relay's best positions at the lowest altitude.
///
/// There is one for each interferer's offset and each limit of the relay's |y|. The limits are in steps of `step_m`.
fn data(step_m: u16) -> Result<Vec<Row>, FigureError> {
    let mut rows = Vec::new();
    for offset_m in OFFSETS_M {
        for room_m in (0..=MOST_ROOM_M).step_by(usize::from(step_m)) {
            let room_m = f64::from(room_m);
            let mission = mission(offset_m, room_m)?;
            let found = some(aside::best_at(&mission, mission.config().common))?;
            rows.push(Row {
                interferer_y_m: offset_m,
                room_m,
                x_m: found.place.x_m,
                y_m: found.place.y_m,
                sir_linear: found.sir,
            });
        }
    }
    Ok(rows)
}

/// Returns the relay's best SIRs for interferers at several y, in steps of `step_m`.
fn gains(step_m: u16) -> Result<Vec<PowerRatio>, FigureError> {
    let offsets: Vec<u16> = (0..=MOST_OFFSET_M).step_by(usize::from(step_m)).collect();
    offsets.par_iter().map(|&offset| gain(offset)).collect()
}

fn gain(offset: u16) -> Result<PowerRatio, FigureError> {
    let offset_m = f64::from(offset);
    let mission = mission(offset_m, ROOM_M)?;
    let common = mission.config().common;
    let both = some(aside::best_place(&mission, common.power_w))?;
    Ok(PowerRatio {
        interferer_y_m: offset_m,
        line_sir_linear: some(theorems::best_at_altitude(&mission, common))?.sir,
        altitude_sir_linear: some(theorems::best_free(&mission, common.power_w))?.sir,
        side_sir_linear: some(aside::best_at(&mission, common))?.sir,
        both_sir_linear: both.sir,
        both_altitude_m: both.place.altitude_m,
    })
}

fn taken() -> Vec<String> {
    let (low, high) = ALTITUDES_M;
    vec![format!(
        "D (Tx to Rx) = 1000 m, p_t (Tx) = p_MSI (interferer) = 80 W, p_u (relay) = {RELAY_W} W, interferer at (500, Y) m, altitudes of {low} m to {high} m"
    )]
}

/// Computes the figure of a single relay's best positions beside the line Tx-Rx.
pub fn places_sheet() -> Result<Sheet, FigureError> {
    let rows = data(ROOM_STEP_M)?;
    let lines = |of: fn(&Row) -> (f64, f64)| -> Vec<Line> {
        let line = |(index, offset): (usize, f64)| {
            let own = rows
                .iter()
                .filter(|row| row.interferer_y_m.to_bits() == offset.to_bits());
            Line::new(
                &format!("Y = {offset} m"),
                Look::number(index).spaced(),
                own.map(of),
            )
        };
        OFFSETS_M.into_iter().enumerate().map(line).collect()
    };
    Ok(Sheet {
        name: "aside",
        title: "Best position of a single relay for different lateral ranges",
        says: vec![
            "Not in the paper. Seen from above: the relay leaves the line on the side away from the interferer, and stays at the limit of the permitted lateral range while that range is small. With a larger range the best position is where the circles of equal SIR of both hops touch, and a still larger range changes nothing."
                .to_owned(),
        ],
        taken: [
            taken(),
            vec!["all at the lowest altitude; lateral range: as far to the left of the line as to the right".to_owned()],
        ]
        .concat(),
        chart: Chart {
            panels: vec![
                Panel {
                    heading: "seen from above".to_owned(),
                    x: Axis::linear("x, m"),
                    y: Axis::linear("y, m"),
                    lines: lines(|row| (f64::from(row.x_m), f64::from(row.y_m))),
                },
                Panel {
                    heading: "gain".to_owned(),
                    x: Axis::linear("lateral range to each side, m").between(0.0, f64::from(MOST_ROOM_M)),
                    y: Axis::linear("SIR, linear"),
                    lines: lines(|row| (row.room_m, f64::from(row.sir_linear))),
                },
            ],
        },
        tables: vec![Table::new("aside", &rows)?],
        shown: Vec::new(),
    })
}

/// Computes the figure of the SIR gain of a relay with free y or free altitude.
pub fn gains_sheet() -> Result<Sheet, FigureError> {
    let rows = gains(OFFSET_STEP_M)?;
    let line = |name: &str, index: usize, sir: fn(&PowerRatio) -> f32| {
        let points = rows
            .iter()
            .map(|row| (row.interferer_y_m, f64::from(sir(row))));
        Line::new(name, Look::number(index).spaced(), points)
    };
    Ok(Sheet {
        name: "aside-gain",
        title: "Gain of a single relay by lateral offset, altitude and both",
        says: vec![
            "Not in the paper. With an interferer on the line, lateral offset and altitude gain nearly the same. Otherwise the lateral offset gains more. If the relay is at the limit of its lateral range, a higher altitude can help as well; with a large range the lowest altitude is best."
                .to_owned(),
        ],
        taken: [
            taken(),
            vec![format!("lateral range of {ROOM_M} m to both sides")],
        ]
        .concat(),
        chart: Chart::of(
            Axis::linear("offset Y of the interferer, m").between(0.0, f64::from(MOST_OFFSET_M)),
            Axis::linear("SIR of the worse hop, linear"),
            vec![
                line("above the line, lowest altitude", 0, |row| row.line_sir_linear),
                line("altitude free", 1, |row| row.altitude_sir_linear),
                line("lateral offset free", 2, |row| row.side_sir_linear),
                line("lateral offset and altitude free", 3, |row| row.both_sir_linear),
            ],
        ),
        tables: vec![Table::new("aside-gain", &rows)?],
        shown: Vec::new(),
    })
}
