//! Recorded optima of the joint problem: positions and altitudes that maximise the worst hop's SIR.
//!
//! `data/optima.jsonl` has one problem per line, after a first line about the file. Each line has the parameters, the
//! best known SIR, and the positions that reach it. The problem has many local optima, and the best one is not proven.
//! The optima are the results of a search with many starts. That search is no longer part of the project; the first
//! line of the file names it.
//!
//! The tests of the crate's solvers look up their problems here ([`optimum`]). The test `recorded` checks the file
//! itself.

use std::io::{Error, Result};
use std::sync::LazyLock;

use serde::Deserialize;
use uav_relay_scenario::number::narrow;

use crate::random::joint::Scenario;
use crate::reference::joint::{Corridor, FixedCrossSection, Place};
use crate::reference::{Link, Relay};

const FILE: &str = include_str!("../data/optima.jsonl");

static ALL: LazyLock<std::result::Result<Vec<Record>, String>> = LazyLock::new(|| {
    let rows = FILE.lines().skip(1).map(|line| {
        let row: Row = serde_json::from_str(line).map_err(|error| format!("{error}: {line}"))?;
        Ok(row.record())
    });
    rows.collect()
});

/// Best known chain of a recorded placement problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Optimum {
    /// SIR (linear) of the chain's worst hop.
    pub sir: f64,
    /// Positions of the relays from Tx to Rx; empty if the file has only the SIR.
    pub places: Vec<Place>,
}

/// Recorded problem with its best known chain.
#[derive(Debug, Clone)]
pub struct Record {
    /// Names of the test that draws this problem and of its random stream, such as `joint_method own 7`.
    pub set: String,
    /// Link, and the corridor in which its relays choose positions.
    ///
    /// In the link all relays are at the lowest altitude.
    pub scene: Scenario,
    /// Best known chain; `None` if no chain has a positive SIR and keeps the minimum separation.
    pub best: Option<Optimum>,
    key: Vec<f32>,
}

/// Line of the file of recorded optima, in metres and watts.
#[derive(Deserialize)]
struct Row {
    set: String,
    relays: usize,
    distance_m: f64,
    #[serde(default)]
    apart_m: f64,
    tx_w: f64,
    /// Transmit power of each relay, W; one number if all relays have the same power.
    relay_w: Vec<f64>,
    /// Interferer's power, W, and its position x and y, m.
    interferer: [f64; 3],
    mu_los: f64,
    mu_nlos: f64,
    eta: f64,
    #[serde(default)]
    noise_w: f64,
    /// Limits of a relay's position, m: lowest and highest altitude, smallest and largest lateral y.
    corridor: [f64; 4],
    /// Relays with a fixed y and altitude: index (from 0), y and altitude of each, m.
    #[serde(default)]
    held: Vec<(usize, f64, f64)>,
    sir: f64,
    #[serde(default)]
    places: Vec<[f64; 3]>,
}

impl Row {
    fn record(self) -> Record {
        // The numbers are f32, printed in their shortest form.
        let single = |value: f64| f64::from(narrow(value));
        let [least_m, most_m, left_m, right_m] = self.corridor.map(single);
        let [interferer_w, x_i, y_i] = self.interferer.map(single);
        let powers = self.relay_w.iter().copied().cycle().take(self.relays);
        let link = Link {
            distance_m: single(self.distance_m),
            min_separation_m: single(self.apart_m),
            tx_w: single(self.tx_w),
            interferer_w,
            x_i,
            y_i,
            mu_los: self.mu_los,
            mu_nlos: self.mu_nlos,
            eta: self.eta,
            noise_w: single(self.noise_w),
            relays: powers
                .map(|power_w| Relay {
                    altitude_m: least_m,
                    power_w: single(power_w),
                })
                .collect(),
        };
        let corridor = Corridor {
            least_m,
            most_m,
            left_m,
            right_m,
        };
        let hold = |&(relay, y_m, altitude_m): &(usize, f64, f64)| FixedCrossSection {
            relay,
            y_m: single(y_m),
            altitude_m: single(altitude_m),
        };
        let held: Vec<FixedCrossSection> = self.held.iter().map(hold).collect();
        // A rounded decimal may be just outside of the corridor.
        let place = |(relay, &[x_m, y_m, altitude_m]): (usize, &[f64; 3])| {
            let room = FixedCrossSection::corridor_of(&held, relay, corridor);
            Place {
                x_m: x_m.clamp(0.0, link.distance_m),
                y_m: y_m.clamp(room.left_m, room.right_m),
                altitude_m: altitude_m.clamp(room.least_m, room.most_m),
            }
        };
        let places = self.places.iter().enumerate().map(place).collect();
        Record {
            set: self.set,
            key: key(&link, corridor, &held),
            best: (self.sir > 0.0).then_some(Optimum {
                sir: self.sir,
                places,
            }),
            scene: Scenario {
                link,
                corridor,
                held,
            },
        }
    }
}

/// Returns the parameters that identify a problem in the file, as f32 numbers.
///
/// The altitudes in `link` are not among them, because relays choose their altitudes in these problems.
fn key(link: &Link, corridor: Corridor, held: &[FixedCrossSection]) -> Vec<f32> {
    let common = [
        link.distance_m,
        link.min_separation_m,
        link.tx_w,
        link.interferer_w,
        link.x_i,
        link.y_i,
        link.mu_los,
        link.mu_nlos,
        link.eta,
        link.noise_w,
        corridor.least_m,
        corridor.most_m,
        corridor.left_m,
        corridor.right_m,
    ];
    let powers = link.relays.iter().map(|relay| relay.power_w);
    #[expect(clippy::cast_precision_loss, reason = "at most a thousand relays")]
    let held = held
        .iter()
        .flat_map(|hold| [hold.relay as f64, hold.y_m, hold.altitude_m]);
    common
        .into_iter()
        .chain(powers)
        .chain(held)
        .map(narrow)
        .collect()
}

/// Returns every recorded problem.
///
/// # Errors
/// If a line of the file is not a problem.
pub fn all() -> Result<&'static [Record]> {
    let all = ALL.as_ref().map(Vec::as_slice);
    all.map_err(|error| Error::other(error.clone()))
}

/// Returns the best known chain of a link in a corridor. The altitudes in `link` are ignored.
///
/// `None` if no chain has a positive SIR and keeps the minimum separation.
///
/// # Errors
/// If the problem is not recorded. `SEED` and `COUNT` must be such that a test draws only recorded problems.
pub fn optimum(
    link: &Link,
    corridor: Corridor,
    held: &[FixedCrossSection],
) -> Result<Option<Optimum>> {
    let wanted = key(link, corridor, held);
    let found = all()?.iter().find(|record| record.key == wanted);
    found.map(|record| record.best.clone()).ok_or_else(|| {
        let scene = format!("{link:?}, {corridor:?}, {held:?}");
        Error::other(format!(
            "no stored optimum of this scene; SEED and COUNT must select only scenes with a stored optimum: {scene}"
        ))
    })
}
