//! SIR and data rate of a chain by its number of relays, in one direction and in both.

use rayon::prelude::*;
use serde::Serialize;
use uav_relay_scenario::Scenario;
use uav_relay_scenario::link::{Access, Link, Radio};
use uav_relay_scenario::scene::{Place, Scene};

use super::chart::{Axis, Chart, Line, Look, Panel};
use super::paper;
use super::sheet::{FigureError, Sheet, Table};
use crate::plan::carried::Carried;
use crate::plan::rate::Rate;
use crate::plan::{Plan, PlanRequest, plan};

/// Largest number of relays in the figure, which has all numbers from 1 up to this one.
pub const MOST_RELAYS: u16 = 24;

/// Table row: SIRs and data rates of one number of relays, in one direction and in both.
///
/// For data in both directions, the same SIR or rate is required toward Rx and toward Tx.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
struct Row {
    relays: u16,
    /// SIR of the worst hop toward Rx, linear, at the best positions for data to Rx only.
    one_way_sir_linear: f64,
    /// SIR of the worst hop toward Rx or Tx, linear, at the best positions for data in both directions.
    both_ways_sir_linear: f64,
    /// SIR of the worst hop toward Rx or Tx, linear, at the best positions for data to Rx only.
    judged_sir_linear: f64,
    /// Data rate to Rx in equal time slots, at the positions with the largest rate.
    one_way_slots_bit_per_s_hz: f64,
    /// Data rate to Rx in time slots as long as each hop needs, at the positions with the largest rate.
    one_way_fitted_bit_per_s_hz: f64,
    /// Data rate of each direction if data goes both ways, in equal time slots.
    ///
    /// The relays are at the positions with the largest rate.
    both_ways_slots_bit_per_s_hz: f64,
    /// Data rate of each direction if data goes both ways, in time slots as long as each hop needs.
    ///
    /// The relays are at the positions with the largest rate.
    both_ways_fitted_bit_per_s_hz: f64,
}

const fn ask(relays: u16) -> PlanRequest {
    PlanRequest::of(relays, false, 1e-4)
}

fn planned(plan: Result<Plan, crate::plan::NoPlan>) -> Result<Plan, FigureError> {
    plan.map_err(|_| FigureError::Unsettled("a chain of both directions"))
}

fn row(relays: u16) -> Result<Row, FigureError> {
    let one_way = paper::multi_hop();
    let both_ways = Scenario {
        reverse: 1.0,
        ..one_way.clone()
    };
    let radio = |access| Radio {
        link: Link {
            access,
            ..Link::default()
        },
        bandwidth_hz: 1.0,
    };
    let by_sir = |scenario: &Scenario| planned(plan(scenario, &ask(relays)));
    let rate = |scenario: &Scenario, access| -> Result<f64, FigureError> {
        let radio = radio(access);
        let plan = match Carried::new(scenario, &ask(relays), &radio, relays) {
            Some(carried) => planned(carried.plan(relays))?,
            None => by_sir(scenario)?,
        };
        Ok(Rate::of(&plan, scenario, &radio).worse(scenario.reverse))
    };
    let (one, both) = (by_sir(&one_way)?, by_sir(&both_ways)?);
    let scene = Scene::new(&both_ways, relays).ok_or(FigureError::Unsettled("a scene"))?;
    let places: Vec<Place> = one.places.iter().map(|(at, _)| (*at).into()).collect();
    let worst = |sirs: Vec<f64>| sirs.into_iter().fold(f64::INFINITY, f64::min);
    Ok(Row {
        relays,
        one_way_sir_linear: one.sir(),
        both_ways_sir_linear: both.sir(),
        judged_sir_linear: worst(scene.hop_sirs(&places)).min(worst(scene.hop_sirs_back(&places))),
        one_way_slots_bit_per_s_hz: rate(&one_way, Access::Slots)?,
        one_way_fitted_bit_per_s_hz: rate(&one_way, Access::Fitted)?,
        both_ways_slots_bit_per_s_hz: rate(&both_ways, Access::Slots)?,
        both_ways_fitted_bit_per_s_hz: rate(&both_ways, Access::Fitted)?,
    })
}

/// Computes the figure of SIR and data rate by the number of relays, in one direction and in both.
pub fn sheet() -> Result<Sheet, FigureError> {
    let relays: Vec<u16> = (1..=MOST_RELAYS).collect();
    let rows: Result<Vec<Row>, FigureError> = relays.par_iter().map(|n| row(*n)).collect();
    let rows = rows?;
    let line = |name: &str, index: usize, value: fn(&Row) -> f64| {
        let points = rows.iter().map(|row| (f64::from(row.relays), value(row)));
        Line::new(name, Look::number(index).spaced(), points)
    };
    let relays = || Axis::linear("number of relays N").between(1.0, f64::from(MOST_RELAYS));
    let of = |relays: u16| {
        let row = rows.iter().find(|row| row.relays == relays);
        row.map_or_else(String::new, |row| {
            format!(
                "N = {relays}: SIR {:.3} one way, {:.3} both ways, and {:.3} both ways at the positions that are best one way",
                row.one_way_sir_linear, row.both_ways_sir_linear, row.judged_sir_linear
            )
        })
    };
    Ok(Sheet {
        name: "link",
        title: "SIR and data rate over the number of relays, one way and both ways",
        says: vec![
            "Not in the paper. On one frequency the hops share the time: more relays raise the SIR, and a single relay carries the highest data rate. With \
             data both ways, each direction has half of the time. Slots as long as each hop needs (fitted slots) carry more than equal slots."
                .to_owned(),
            [1, 8, 24].map(of).join("; ") + ".",
        ],
        taken: vec![
            "D (Tx to Rx) = 1000 m, h (altitude) = 20 m, p_t (Tx) = p_rx (Rx) = p_MSI (interferer) = 80 W, p_u (relay) = 1 W, interferer at (500, 400) m".to_owned(),
            "both ways: both directions need the same SIR (r = 1), so the worse direction counts; each direction has the data rate log2(1 + SIR)".to_owned(),
            "equal slots: the relays are at the positions with the highest SIR; fitted slots: at those with the highest data rate".to_owned(),
        ],
        chart: Chart {
            panels: vec![
                Panel {
                    heading: "SIR".to_owned(),
                    x: relays(),
                    y: Axis::log("SIR of the worst hop, linear"),
                    lines: vec![
                        line("one way", 0, |row| row.one_way_sir_linear),
                        line("both ways", 1, |row| row.both_ways_sir_linear),
                        line("both, at one-way places", 2, |row| row.judged_sir_linear),
                    ],
                },
                Panel {
                    heading: "data rate on one frequency".to_owned(),
                    x: relays(),
                    y: Axis::log("bit/s/Hz"),
                    lines: vec![
                        line("one way, equal slots", 0, |row| row.one_way_slots_bit_per_s_hz),
                        line("one way, fitted", 3, |row| row.one_way_fitted_bit_per_s_hz),
                        line("both ways, equal slots", 1, |row| row.both_ways_slots_bit_per_s_hz),
                        line("both ways, fitted", 4, |row| row.both_ways_fitted_bit_per_s_hz),
                    ],
                },
            ],
        },
        tables: vec![Table::new("link", &rows)?],
        shown: Vec::new(),
    })
}
