//! Results of a run, as printed by `--json` and read by `--from`.

use serde::{Deserialize, Serialize};

use crate::machine::Machine;
use crate::problem::Problem;

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Results {
    pub(crate) machine: Machine,
    pub(crate) versions: Versions,
    /// Processor time limit of the other solvers per problem, s.
    pub(crate) limit_s: f64,
    pub(crate) problems: Vec<Solved>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Versions {
    pub(crate) python: String,
    pub(crate) scipy: String,
    pub(crate) nlopt: String,
}

/// Placement problem with the results of all solvers, this crate's first.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Solved {
    pub(crate) problem: Problem,
    pub(crate) runs: Vec<Run>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    pub(crate) solver: String,
    pub(crate) answer: Answer,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Answer {
    Found(Solution),
    Error(String),
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Solution {
    /// Processor time of the solver, s.
    pub(crate) time_s: f64,
    /// Number of evaluated chains; `None` for solvers that do not evaluate chains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) evaluations: Option<u64>,
    /// SIR (linear) of the worst hop, as reported by the solver.
    pub(crate) sir: f64,
    /// Position of every relay (x, y, altitude; m), from the transmitter on.
    pub(crate) chain: Chain,
    /// First chain found in the run whose SIR is within [`crate::score::GOOD`] of the optimum, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) good: Option<Mark>,
    /// First chain found in the run with at least the SIR of this crate's chain, if any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) level: Option<Mark>,
    /// True if the time limit ended the run.
    pub(crate) cut: bool,
}

#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Mark {
    pub(crate) after_s: f64,
    pub(crate) chain: Chain,
}

/// Position of every relay (x, y, altitude; m), from the transmitter on.
pub(crate) type Chain = Vec<[f64; 3]>;
