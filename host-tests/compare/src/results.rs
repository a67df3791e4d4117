//! Everything that came out of a run, as `--json` prints it and `--from` reads it.

use serde::{Deserialize, Serialize};

use crate::machine::Machine;
use crate::problem::Problem;

/// A whole run of the command.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Results {
    /// Where and when.
    pub(crate) machine: Machine,
    /// What the other solvers are.
    pub(crate) versions: Versions,
    /// Most time on the processor that one of them had for one problem, s.
    pub(crate) limit_s: f64,
    /// The problems.
    pub(crate) problems: Vec<Solved>,
}

/// Versions of Python and what was installed for it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Versions {
    /// Of Python itself.
    pub(crate) python: String,
    /// Of SciPy.
    pub(crate) scipy: String,
    /// Of NLopt.
    pub(crate) nlopt: String,
}

/// One problem, and what each solver made of it; this crate comes first.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Solved {
    /// The problem.
    pub(crate) problem: Problem,
    /// One entry a solver.
    pub(crate) runs: Vec<Run>,
}

/// What one solver made of one problem.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Run {
    /// Its name, as the table has it.
    pub(crate) solver: String,
    /// What it answered.
    pub(crate) answer: Answer,
}

/// What a solver answers.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Answer {
    /// A chain.
    Found(Found),
    /// Why there is none.
    Error(String),
}

/// A chain that a solver has found, and what that took.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Found {
    /// Time on the processor from beginning to end, s.
    pub(crate) time_s: f64,
    /// Chains whose hops it evaluated; absent where that is not what is done.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) evaluations: Option<u64>,
    /// SIR (linear) of the worst hop, as the solver has it.
    pub(crate) sir: f64,
    /// x, y and h of every relay, m.
    pub(crate) chain: Chain,
    /// The first chain on the way within [`crate::score::GOOD`] of the optimum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) good: Option<Mark>,
    /// The first chain on the way that was as good as what this crate found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) level: Option<Mark>,
    /// Whether the time limit ended it.
    pub(crate) cut: bool,
}

/// A chain on the way.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct Mark {
    /// Time on the processor from the beginning, s.
    pub(crate) after_s: f64,
    /// x, y and h of every relay, m.
    pub(crate) chain: Chain,
}

/// x, y and h of every relay, m, from the transmitter on.
pub(crate) type Chain = Vec<[f64; 3]>;
