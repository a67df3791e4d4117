//! Reference values of an independent program, as test data.

use serde::Deserialize;
use serde_json::Value;

use crate::reference::{Link, Relay};

/// Number of relays, and best SIR (linear) of such a chain in the default scenario.
///
/// An independent program has computed the SIRs to nine significant digits.
pub const OPTIMA: [(u16, f64); 12] = [
    (1, 1.490_121_51),
    (2, 1.616_583_02),
    (3, 1.747_031_29),
    (4, 1.881_667_00),
    (5, 2.020_675_28),
    (8, 2.465_535_75),
    (10, 2.786_622_55),
    (16, 3.875_573_20),
    (20, 4.710_644_20),
    (32, 7.756_114_78),
    (50, 13.859_132_9),
    (100, 40.441_345_0),
];

/// Scenario of a reference case, in SI units. Fields are named like the keys in `data/reference.json`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Params {
    /// Transmit power of Tx, watts.
    pub p_t: f64,
    /// Transmit power of each relay, watts.
    pub p_u: f64,
    /// Transmit power of the interferer, watts.
    pub p_msi: f64,
    /// Position x of the interferer: distance from Tx toward Rx, metres.
    #[serde(rename = "X")]
    pub x: f64,
    /// Position y of the interferer: lateral offset from the line Tx-Rx, metres.
    #[serde(rename = "Y")]
    pub y: f64,
    /// Distance from Tx to Rx, metres.
    #[serde(rename = "D")]
    pub d: f64,
    /// Altitude of all relays, metres.
    pub h: f64,
    /// Lowest altitude that a relay may choose, metres.
    pub h_min: f64,
    /// Highest altitude that a relay may choose, metres.
    pub h_max: f64,
    /// Minimum distance between neighbouring relays, metres.
    pub d_min: f64,
    /// Path-loss factor between two relays, 1/m^2.
    pub mu_los: f64,
    /// Path-loss factor between two points on the ground, 1/m^2.
    pub mu_nlos: f64,
    /// Path-loss factor between a relay and the ground, 1/m^2.
    pub eta: f64,
}

/// Reference case of an independent program: a function, its arguments and its result.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Case {
    /// Name of the evaluated function.
    #[serde(rename = "fn")]
    pub function: String,
    /// Scenario in which the function was evaluated.
    pub params: Params,
    /// Arguments of the function, by name.
    pub args: Value,
    /// Result: one value, or an object of named values.
    pub out: Value,
    /// Relative tolerance for a comparison with the result.
    pub rtol: f64,
    /// Name of the case, unique in the file.
    pub id: String,
}

#[derive(Deserialize)]
struct File {
    cases: Vec<Case>,
}

/// Returns all reference cases, in the order of the file.
///
/// # Errors
/// If the file `data/reference.json`, which is part of the program, does not parse.
pub fn load() -> Result<Vec<Case>, serde_json::Error> {
    serde_json::from_str::<File>(include_str!("../data/reference.json")).map(|file| file.cases)
}

/// Returns the reference cases of `function`, in the order of the file.
///
/// # Errors
/// Those of [`load`].
pub fn of(function: &str) -> Result<Vec<Case>, serde_json::Error> {
    Ok(load()?
        .into_iter()
        .filter(|case| case.function == function)
        .collect())
}

impl Case {
    /// Returns the scenario of this case as a link with `n` equal relays.
    pub fn link(&self, n: usize) -> Link {
        let p = &self.params;
        Link {
            distance_m: p.d,
            min_separation_m: p.d_min,
            tx_w: p.p_t,
            interferer_w: p.p_msi,
            x_i: p.x,
            y_i: p.y,
            mu_los: p.mu_los,
            mu_nlos: p.mu_nlos,
            eta: p.eta,
            noise_w: 0.0,
            relays: vec![
                Relay {
                    altitude_m: p.h,
                    power_w: p.p_u
                };
                n
            ],
        }
    }

    /// Returns the argument `N` of this case, the number of relays; `None` if the case has no `N`.
    pub fn relays(&self) -> Option<usize> {
        self.args.get("N")?.as_u64()?.try_into().ok()
    }

    /// Returns the argument `name` of this case as a number; `None` if it is not a number.
    pub fn arg(&self, name: &str) -> Option<f64> {
        number(self.args.get(name)?)
    }

    /// Returns the argument `name` of this case as a list of numbers; `None` if it is not a list.
    pub fn arg_list(&self, name: &str) -> Option<Vec<f64>> {
        list(self.args.get(name)?)
    }

    /// Returns the result of this case if it is a single number; otherwise `None`.
    pub fn value(&self) -> Option<f64> {
        number(&self.out)
    }

    /// Returns the result of this case if it is a list of numbers; otherwise `None`.
    pub fn values(&self) -> Option<Vec<f64>> {
        list(&self.out)
    }

    /// Returns the part `name` of the case's result as a number; `None` if it is not a number.
    pub fn part(&self, name: &str) -> Option<f64> {
        number(self.out.get(name)?)
    }

    /// Returns the part `name` of the case's result as a list of numbers; `None` if it is not a list.
    pub fn part_list(&self, name: &str) -> Option<Vec<f64>> {
        list(self.out.get(name)?)
    }
}

/// Reads a JSON number, or a word for a value that JSON lacks, such as "inf".
fn number(value: &Value) -> Option<f64> {
    match value.as_str() {
        Some("nan") => Some(f64::NAN),
        Some("inf") => Some(f64::INFINITY),
        Some("-inf") => Some(f64::NEG_INFINITY),
        Some(_) => None,
        None => value.as_f64(),
    }
}

fn list(value: &Value) -> Option<Vec<f64>> {
    value.as_array()?.iter().map(number).collect()
}
