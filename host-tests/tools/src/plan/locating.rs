//! Location of an interferer in an area by the measurements of relays (`[listen]`).
//!
//! The error of the location is the Cramer-Rao bound. Each relay measures ln I once at each of its positions: those
//! before an estimate, and the planned one. A measurement has the relative error of `[listen]`, increased by the
//! receiver's noise. The unknowns are the power, x, and y; without its sign if all relays have y = 0. The time until
//! the location is that of simulated chains with drones.

use std::fmt;

use rayon::prelude::*;
use serde::Serialize;
use uav_relay::sensing::estimate::InterferenceEstimate;
use uav_relay::{Instant, Interference, Placement};
use uav_relay_scenario::scene::{Place, Scene};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::simulator::chain::run;

use super::Plan;
use super::area::Cell;
use crate::figures::sheet::FigureError;
use crate::listening::{RandomScene, quantile};

/// Largest error of a located interferer, as a fraction of its distance from the line Tx-Rx.
///
/// The interference at the nearest point of this line is then known within 0.9 dB.
pub const LOCATED: f64 = 0.1;

/// Number of positions of the interferer that are simulated.
const SIMULATED: usize = 5;

/// Least SIR of a chain after the interferer is located, as a fraction of the best SIR (-1 dB).
const SHARE: f64 = 0.794;

/// Longest time of a simulated search, s, in addition to a flight from Tx to Rx at 10 m/s.
const SEARCH_S: f64 = 180.0;

/// Simulated search for the interferer at one position.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Search {
    /// Position [x, y] of the interferer, m.
    pub at: [f64; 2],
    /// Time from the start of the drones beside Tx to the first estimate, s; absent without an estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate_s: Option<f64>,
    /// Time until the chain's SIR is at most 1 dB below the SIR of relays that know the interferer, s.
    ///
    /// Absent if the relays do not reach such positions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub placed_s: Option<f64>,
    /// Distance of the last estimate from the interferer, or from its mirror image about the line Tx-Rx, m.
    ///
    /// Absent if there is no estimate.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub off_m: Option<f64>,
    /// Standard deviation of the location by the Cramer-Rao bound, m; absent if it is infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
}

/// Report of the part of an area in which relays can locate the interferer.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Locating {
    /// Fraction of the area, 0 to 1, in which the relays can locate the interferer.
    ///
    /// The error is then at most a tenth of the interferer's distance from the line Tx-Rx.
    pub located: f64,
    /// Median of the location's standard deviation over the area, m; absent if it is infinite.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error_m: Option<f64>,
    /// Largest standard deviation of the location, m; absent if it is infinite.
    ///
    /// It is infinite if the measurements do not determine the location.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst_error_m: Option<f64>,
    /// Position [x, y] of the interferer with the largest error, m.
    pub worst_at: [f64; 2],
    /// Simulated searches at some positions.
    pub searches: Vec<Search>,
}

impl Locating {
    /// Creates the report of `plan`, and sets the errors in `cells`.
    ///
    /// `None` if the scenario has no `[listen]`, or does not have exactly one interferer, with an area.
    ///
    /// # Errors
    /// A text that says why the flight cannot be simulated.
    pub fn new(
        scenario: &Scenario,
        plan: &Plan,
        cells: &mut [Cell],
    ) -> Result<Option<Self>, String> {
        let relays = u16::try_from(plan.places.len()).unwrap_or(u16::MAX);
        let (Some(listen), Some(own)) = (scenario.listen, scenario.areas.get(&0)) else {
            return Ok(None);
        };
        let scene = Scene::new(scenario, relays).filter(|scene| scene.sources.len() == 1);
        let Some(mut scene) = scene else {
            return Ok(None);
        };
        scene.areas.clear();
        let places = measured_places(scenario, plan);
        let relative_error = f64::from(listen.of(relays).relative_error);
        for cell in cells.iter_mut() {
            if let Some(source) = scene.sources.first_mut() {
                (source.power_w, source.x_m, source.y_m) = (own.least_w, cell.at[0], cell.at[1]);
            }
            cell.error_m = Some(error_m(&scene, &places, relative_error));
        }
        let error = |cell: &Cell| cell.error_m.unwrap_or(f64::INFINITY);
        let Some(worst) = cells.iter().max_by(|a, b| error(a).total_cmp(&error(b))) else {
            return Ok(None);
        };
        let located = cells
            .iter()
            .filter(|cell| is_located(scenario, cell))
            .count();
        let mut errors: Vec<f64> = cells.iter().map(error).collect();
        let stride = cells.len().div_ceil(SIMULATED);
        let some = cells.iter().skip(stride / 2).step_by(stride);
        let some: Vec<&Cell> = some.collect();
        let searches = some.into_par_iter().map(|cell| {
            search(scenario, relays, cell).map_err(|error| failed(relays, cell.at, &error))
        });
        Ok(Some(Self {
            located: located as f64 / cells.len() as f64,
            error_m: finite(quantile(&mut errors, 0.5)),
            worst_error_m: finite(error(worst)),
            worst_at: worst.at,
            searches: searches.collect::<Result<_, String>>()?,
        }))
    }
}

/// Returns `error_m`, or `None` if it is infinite: JSON has no infinite number.
fn finite(error_m: f64) -> Option<f64> {
    error_m.is_finite().then_some(error_m)
}

fn failed(relays: u16, [x_m, y_m]: [f64; 2], error: &FigureError) -> String {
    format!(
        "interferer[0].area: the run in which {relays} relays locate the interferer at x = {x_m:.1} m, y = {y_m:.1} m cannot be simulated: {error}"
    )
}

/// Returns true if the relays locate an interferer in the middle of the cell.
fn is_located(scenario: &Scenario, cell: &Cell) -> bool {
    let [x, y] = cell.at;
    let apart_m = (x - x.clamp(0.0, scenario.distance_m)).hypot(y);
    cell.error_m.is_some_and(|error| error <= LOCATED * apart_m)
}

/// Returns the positions at which relays measure the interference.
///
/// They are the positions before the first estimate (hops of about equal length), and the positions of `plan`.
fn measured_places(scenario: &Scenario, plan: &Plan) -> Vec<Place> {
    let relays = plan.places.len() as f64;
    // Hops of equal length. For one or two relays also: the first hop half as long, and the last hop half as long.
    let spreads = if relays > 2.5 {
        &[[0.0, 0.0]][..]
    } else {
        &[[0.0, 0.0], [0.5, 0.0], [0.0, 0.5]]
    };
    let mut places: Vec<Place> = Vec::new();
    for [first, last] in spreads {
        let hop_m = scenario.distance_m / (relays + 1.0 - first - last);
        places.extend((1..).zip(&plan.places).map(|(index, (at, _))| {
            let own = scenario.relays.get(&index).and_then(|own| own.altitude_m);
            Place {
                x: (f64::from(index) - first) * hop_m,
                h: own.unwrap_or(scenario.altitude_m),
                ..Place::from(*at)
            }
        }));
        for place in &mut places {
            place.y = 0.0;
        }
    }
    places.extend(plan.places.iter().map(|(at, _)| Place::from(*at)));
    places
}

/// Returns the Cramer-Rao bound for the location of the only source of `scene`, m.
///
/// It is a standard deviation.
pub fn error_m(scene: &Scene, places: &[Place], relative_error: f64) -> f64 {
    let Some(source) = scene.sources.first() else {
        return f64::INFINITY;
    };
    let mut fisher = [[0.0; 3]; 3];
    // Scaled by the distance from Tx to Rx, so that all elements have similar sizes.
    let unit_m = scene.distance_m;
    for place in places {
        let (dx, dy) = (
            (place.x - source.x_m) / unit_m,
            (place.y - source.y_m) / unit_m,
        );
        let squared = dx * dx + dy * dy + (place.h / unit_m).powi(2);
        let slopes = [1.0, 2.0 * dx / squared, 2.0 * dy / squared];
        let heard_w = scene.interference_w(*place);
        let error = relative_error * (1.0 + scene.noise_w / heard_w);
        for (row, one) in fisher.iter_mut().zip(slopes) {
            for (sum, other) in row.iter_mut().zip(slopes) {
                *sum += one * other / (error * error);
            }
        }
    }
    let [[a, b, c], [_, d, e], [_, _, f]] = fisher;
    let determinant = a * (d * f - e * e) - b * (b * f - c * e) + c * (b * e - c * d);
    // Variances of x and y: the last two diagonal elements of the inverse.
    let variance = ((a * f - c * c) + (a * d - b * b)) / determinant;
    if determinant > 1e-12 * a * d * f && variance >= 0.0 {
        unit_m * variance.sqrt()
    } else {
        f64::INFINITY
    }
}

/// Simulates drones that start beside Tx and search an interferer in the middle of `cell`.
fn search(scenario: &Scenario, relays: u16, cell: &Cell) -> Result<Search, FigureError> {
    let mut scene = RandomScene {
        scenario: Scenario {
            areas: std::collections::BTreeMap::new(),
            plan: None,
            ..scenario.clone()
        },
        relays,
        seed: 1,
    };
    scene.place(cell.at[0], cell.at[1]);
    let mut setup = scene.flown(Interference::Unknown)?;
    let (told, profiles) = mission::mission(&scene.scenario, relays, 1e-4)?;
    setup.profiles = profiles;
    setup.held = mission::fixed_altitude_relays(&scene.scenario, relays);
    setup.settings.listen = scenario.listen.map(|listen| listen.of(relays));
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "up to some hours"
    )]
    let until = Instant::from_millis((1e3 * SEARCH_S + 100.0 * scenario.distance_m) as u64);
    setup.deadline = until;
    if let Some(measured) = &mut setup.true_interference {
        measured.until = until;
    }
    let mut known = uav_relay_sim::simulator::setup::Setup::new(told);
    (known.profiles, known.held) = (setup.profiles.clone(), setup.held.clone());
    let known = run(known)?;
    let best: Option<Vec<Placement>> = known.relays.iter().map(|relay| relay.setpoint).collect();
    let truth = scene.scene()?;
    let best = best.map_or(f64::INFINITY, |places| truth.chain_sir(&places));
    let outcome = run(setup)?;
    let mut found = Search {
        at: cell.at,
        estimate_s: None,
        placed_s: None,
        off_m: None,
        error_m: cell.error_m.and_then(finite),
    };
    for now in &outcome.snapshots {
        let seconds = now.at.as_micros() as f64 * 1e-6;
        if let InterferenceEstimate::Source { source, .. } = now.believed.estimate {
            found.estimate_s.get_or_insert(seconds);
            let [x, y] = [source.x_m, source.y_m].map(f64::from);
            found.off_m = Some((x - cell.at[0]).hypot(y.abs() - cell.at[1].abs()));
            // All drones have arrived.
            if now.places.len() == usize::from(relays)
                && truth.chain_sir(&now.places) >= SHARE * best
            {
                found.placed_s.get_or_insert(seconds);
            }
        }
    }
    Ok(found)
}

impl fmt::Display for Locating {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.worst_at;
        let metres = |error: Option<f64>| {
            error.map_or("not limited".to_owned(), |error_m| {
                format!("{error_m:.1} m")
            })
        };
        writeln!(
            f,
            "listening: in {:.1} % of the area the relays would locate the interferer with an error below a tenth of its distance from the line; standard deviation of the located position: median {}, largest {} at x = {x:.1} m, y = {y:.1} m",
            100.0 * self.located,
            metres(self.error_m),
            metres(self.worst_error_m)
        )?;
        let seconds = |time: Option<f64>| {
            time.map_or("never".to_owned(), |time| format!("after {time:.0} s"))
        };
        for one in &self.searches {
            let [x, y] = one.at;
            let off = one.off_m.map_or(String::new(), |off| {
                format!(", estimate {off:.1} m from the true position")
            });
            writeln!(
                f,
                "simulated with the interferer at x = {x:.1} m, y = {y:.1} m: first estimate {}; SIR of the worst hop within 1 dB of the best {}{off}",
                seconds(one.estimate_s),
                seconds(one.placed_s)
            )?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_that_cannot_be_simulated_is_named_with_its_place() {
        let line = failed(3, [10.0, -20.0], &FigureError::Unsettled("the chain"));
        let part = "in which 3 relays locate the interferer at x = 10.0 m, y = -20.0 m cannot be simulated: the chain has not settled";
        assert!(
            line.starts_with("interferer[0].area: ") && line.contains(part),
            "{line}"
        );
    }
}
