//! Solvers of SciPy and NLopt: a Python process that receives one problem per line.

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use serde_json::{Value, json};

use crate::problem::{Choice, Problem};
use crate::results::{Run, Versions};
use crate::score::GOOD;

const PROGRAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/rivals/serve.py");

/// Returns the maximum wall-clock time to wait for an answer of the Python process.
///
/// It is far above the processor time limit `limit_s`, s. A busy machine runs the process only part of the time, and
/// some steps of the solvers cannot be interrupted.
fn patience(limit_s: f64) -> Duration {
    Duration::from_secs_f64(20.0 * limit_s + 60.0)
}

#[derive(Clone, Copy)]
pub(crate) struct Solver {
    name: &'static str,
    pub(crate) title: &'static str,
}

pub(crate) const SOLVERS: [Solver; 5] = [
    Solver {
        name: "scipy-slsqp-one",
        title: "SciPy SLSQP, its best start alone",
    },
    Solver {
        name: "scipy-slsqp",
        title: "SciPy SLSQP, 20 starts",
    },
    Solver {
        name: "scipy-de",
        title: "SciPy differential evolution, then SLSQP",
    },
    Solver {
        name: "nlopt-slsqp",
        title: "NLopt LD_SLSQP, 20 starts",
    },
    Solver {
        name: "nlopt-mlsl",
        title: "NLopt G_MLSL_LDS, then LD_SLSQP",
    },
];

pub(crate) struct Rivals {
    child: Child,
    tasks: ChildStdin,
    answers: Receiver<String>,
    limit_s: f64,
    versions: Versions,
}

impl Rivals {
    /// Starts the Python process, which first solves a small problem with every solver, untimed.
    ///
    /// `limit_s` is the processor time limit per problem, s.
    pub(crate) fn start(python: &Path, limit_s: f64) -> Result<Self, String> {
        let mut child = Command::new(python)
            .args(["-B", "-W", "ignore", PROGRAM])
            // Threads cost more than they gain at this size: with two on a busy machine SciPy's SLSQP took fifteen
            // times as long.
            .env("OPENBLAS_NUM_THREADS", "1")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| format!("{}: {error}", python.display()))?;
        let pipes = child.stdin.take().zip(child.stdout.take());
        let (tasks, lines) = pipes.ok_or("the Python process has no pipes")?;
        let (sender, answers) = channel();
        std::thread::spawn(move || {
            for line in BufReader::new(lines).lines().map_while(Result::ok) {
                if sender.send(line).is_err() {
                    break;
                }
            }
        });
        let mut rivals = Self {
            child,
            tasks,
            answers,
            limit_s,
            versions: Versions {
                python: String::new(),
                scipy: String::new(),
                nlopt: String::new(),
            },
        };
        let small = Problem {
            choice: Choice::Sides,
            relays: 3,
        };
        let link = link(small)?;
        let versions = rivals.ask(&json!({ "good_sir": 1.0, "level_sir": 1.0, "link": link }))?;
        rivals.versions = serde_json::from_value(versions).map_err(|error| error.to_string())?;
        Ok(rivals)
    }

    pub(crate) const fn versions(&self) -> &Versions {
        &self.versions
    }

    /// Solves `problem` with `solver`. The result also has the time at which its SIR (linear) first reached `level`.
    pub(crate) fn run(
        &mut self,
        solver: Solver,
        problem: Problem,
        level: f64,
    ) -> Result<Run, String> {
        let optimum = problem.optimum().ok_or("a problem without an optimum")?;
        let task = json!({
            "solver": solver.name,
            "limit_s": self.limit_s,
            "good_sir": optimum * (1.0 - GOOD),
            "level_sir": level,
            "link": link(problem)?,
        });
        let answer = self.ask(&task)?;
        let answer =
            serde_json::from_value(answer).map_err(|error| format!("{}: {error}", solver.name))?;
        let solver = solver.title.to_owned();
        Ok(Run { solver, answer })
    }

    fn ask(&mut self, task: &Value) -> Result<Value, String> {
        // If the process has died, no answer comes.
        _ = writeln!(self.tasks, "{task}");
        match self.answers.recv_timeout(patience(self.limit_s)) {
            Ok(line) => serde_json::from_str(&line).map_err(|error| error.to_string()),
            Err(_) => Err(format!("Python sent no answer: {}", self.last_words())),
        }
    }

    /// Kills the Python process, and returns the last line of its standard error.
    fn last_words(&mut self) -> String {
        _ = self.child.kill();
        let mut text = String::new();
        if let Some(mut errors) = self.child.stderr.take() {
            _ = errors.read_to_string(&mut text);
        }
        let last = text.lines().rfind(|line| !line.trim().is_empty());
        last.unwrap_or("it says nothing").to_owned()
    }
}

impl Drop for Rivals {
    fn drop(&mut self) {
        _ = self.child.kill();
        _ = self.child.wait();
    }
}

fn link(problem: Problem) -> Result<Value, String> {
    let (link, room) = problem.link()?;
    let relay = link.relays.first().ok_or("a problem without relays")?;
    Ok(json!({
        "relays": link.len(),
        "distance_m": link.distance_m,
        "min_separation_m": link.min_separation_m,
        "left_m": room.left_m,
        "right_m": room.right_m,
        "low_m": room.least_m,
        "high_m": room.most_m,
        "tx_w": link.tx_w,
        "relay_w": relay.power_w,
        "interferer_w": link.interferer_w,
        "x_i": link.x_i,
        "y_i": link.y_i,
        "mu_los": link.mu_los,
        "mu_nlos": link.mu_nlos,
        "eta": link.eta,
    }))
}
