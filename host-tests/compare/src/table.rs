//! The results as tables in markdown, with notes.

use std::fmt::Write as _;

use crate::problem::{Choice, Problem};
use crate::results::{Answer, Results, Run, Solution, Solved};
use crate::score::{Score, judge, score};
use uav_relay_xtask::toolchain::spaced;

const TITLES: [(Choice, &str); 3] = [
    (
        Choice::Places,
        "Places, all at 20 m (the default scenario):",
    ),
    (
        Choice::Altitudes,
        "Places and altitudes (`examples/altitudes.toml`):",
    ),
    (
        Choice::Sides,
        "Places, altitudes and up to 280 m to either side (`examples/side.toml`):",
    ),
];

const HEAD: &str = "\
| N | solver | SIR of the worst hop | short of the optimum by | the same in f32 | chains evaluated | within 1e-4 of it after | as good as the first line after | time in all |
| --- | --- | --- | --- | --- | --- | --- | --- | --- |
";

const NOTES: &str = "\
In parentheses: times as long as the first line of that N in the same run.

- `uav-relay, as the leader predicts`: what the head computes from the mission before the first sweep, and every relay's place. \
`one relay for all`: the joint method on the whole chain from the mission, from all of its starts, which each relay works out \
alone, and every relay's place. \
`all relays by messages`: the computing of all relays of a simulated chain one after the other, and every frame they exchange.
- The others have the whole problem in one place, in f64. SLSQP: the largest t with ln SIR >= t at every hop, order and least \
separation as constraints, with their slopes; choices from 0 to 10; from equal spacings (at five altitudes where those are chosen, \
with room to the side at five sides as well) and random chains. \
`its best start alone`: the one of the equal spacings from which it is as good as the first line soonest; the time to find out \
which one that is does not count. \
Differential evolution (rand1bin, 15 members a choice, until they agree to 1e-6 or four fifths of the time limit are over) on the \
worst hop of the sorted chain. G_MLSL_LDS with LD_LBFGS on a smooth stand-in for the worst hop, 1000 evaluations.
- `the same in f32`: what is missing when the places are set-points, numbers of f32 in m: those of a relay are, the others' are \
rounded.
- Time is time on the processor, of the solver alone, in one thread. Every SIR is computed from the places, \
in f64, by formulas that no solver shares; a chain that breaks order, room or least separation does not count.
";

const EXCERPT: [(Choice, u16, &str); 6] = [
    (Choice::Places, 8, "8 relays at 20 m"),
    (Choice::Places, 50, "50 relays at 20 m"),
    (Choice::Altitudes, 8, "8 relays, altitudes too"),
    (Choice::Altitudes, 50, "50 relays, altitudes too"),
    (Choice::Sides, 8, "8 relays, altitudes and sides"),
    (Choice::Sides, 50, "50 relays, altitudes and sides"),
];

const EXCERPT_HEAD: &str = "\
| problem | solver | short of the optimum by | the same in f32 | as good as the first line after | time in all |
| --- | --- | --- | --- | --- | --- |
";

pub(crate) fn table(results: &Results) -> Result<String, String> {
    let mut text = String::new();
    for (choice, title) in TITLES {
        let of_choice = |solved: &&Solved| solved.problem.choice == choice;
        let solved: Vec<&Solved> = results.problems.iter().filter(of_choice).collect();
        if solved.is_empty() {
            continue;
        }
        _ = write!(text, "{title}\n\n{HEAD}");
        for solved in solved {
            text.push_str(&rows(solved)?);
        }
        text.push('\n');
    }
    text.push_str(NOTES);
    _ = writeln!(text, "\n{}", circumstances(results));
    Ok(text)
}

pub(crate) fn excerpt(results: &Results) -> Result<String, String> {
    let mut text = EXCERPT_HEAD.to_owned();
    for (choice, relays, title) in EXCERPT {
        let problem = Problem { choice, relays };
        let solved = results.problems.iter().find(|s| s.problem == problem);
        let solved = solved.ok_or_else(|| format!("{problem}: not solved"))?;
        let mut title = title;
        for (solver, line) in lines(solved)? {
            let cells = match line {
                Err(why) => format!("{why} | | |"),
                Ok(line) => [line.short, line.flown, line.level, line.all].join(" | "),
            };
            _ = writeln!(text, "| {title} | {solver} | {cells} |");
            title = "";
        }
    }
    _ = writeln!(text, "\n{}", circumstances(results));
    Ok(text)
}

fn circumstances(results: &Results) -> String {
    let (machine, versions) = (&results.machine, &results.versions);
    format!(
        "{} on {}; Python {}, SciPy {}, NLopt {}, at most {} s a solver and problem.",
        machine.date,
        machine.processor,
        versions.python,
        versions.scipy,
        versions.nlopt,
        results.limit_s
    )
}

/// Returns the SIR (linear) of this crate's chain, which is the first one in `runs`.
pub(crate) fn level(problem: Problem, runs: &[Run]) -> Result<f64, String> {
    let (link, room) = problem.link()?;
    match runs.first().map(|own| &own.answer) {
        Some(Answer::Found(found)) => {
            judge(&link, room, &found.chain).map_err(|refusal| format!("{problem}: {refusal}"))
        }
        _ => Err(format!("{problem}: nothing to compare with")),
    }
}

struct Line {
    sir: String,
    short: String,
    flown: String,
    evaluations: String,
    good: String,
    level: String,
    all: String,
}

/// Name of a solver with its cells in a table row, or with the reason why its chain does not count.
type Entry<'a> = (&'a str, Result<Line, String>);

fn rows(solved: &Solved) -> Result<String, String> {
    let mut text = String::new();
    for (solver, line) in lines(solved)? {
        let cells = match line {
            Err(why) => format!("{why} | | | | | |"),
            Ok(line) => [
                line.sir,
                line.short,
                line.flown,
                line.evaluations,
                line.good,
                line.level,
                line.all,
            ]
            .join(" | "),
        };
        _ = writeln!(text, "| {} | {solver} | {cells} |", solved.problem.relays);
    }
    Ok(text)
}

/// Returns the table rows of one problem, one row for each solver.
///
/// A row has the solver's cells, or the reason why its chain does not count.
fn lines(solved: &Solved) -> Result<Vec<Entry<'_>>, String> {
    let problem = solved.problem;
    let optimum = problem
        .optimum()
        .ok_or_else(|| format!("{problem}: not one of the problems"))?;
    let (link, room) = problem.link()?;
    let own_s = solved.runs.first().and_then(|own| match &own.answer {
        Answer::Found(found) => Some(found.time_s),
        Answer::Error(_) => None,
    });
    let own_s = own_s.ok_or_else(|| format!("{problem}: nothing to compare with"))?;
    // Without a valid first chain there is nothing to compare with.
    let level = level(problem, &solved.runs).unwrap_or(f64::INFINITY);
    let of = |Run { answer, .. }: &Run| match answer {
        Answer::Error(why) => Err(plain(why)),
        Answer::Found(found) => match score(&link, room, optimum, level, found) {
            Err(refusal) => Err(plain(&format!("does not count: {refusal}"))),
            Ok(score) => Ok(line(found, &score, optimum, own_s)),
        },
    };
    let lines = solved.runs.iter().map(|run| (run.solver.as_str(), of(run)));
    Ok(lines.collect())
}

fn line(found: &Solution, score: &Score, optimum: f64, own_s: f64) -> Line {
    let after = |after_s: Option<f64>| {
        after_s.map_or_else(|| "never".to_owned(), |after_s| time(after_s, own_s))
    };
    let cut = if found.cut { ", cut off" } else { "" };
    Line {
        sir: format!("{:.6}", score.sir),
        short: short((optimum - score.sir) / optimum),
        flown: short((optimum - score.flown) / optimum),
        evaluations: found.evaluations.map_or_else(String::new, spaced),
        good: after(score.good_after_s),
        level: after(score.level_after_s),
        all: time(found.time_s, own_s) + cut,
    }
}

/// Replaces characters that a table cell cannot contain with spaces.
fn plain(why: &str) -> String {
    why.replace(['|', '\n'], " ")
}

/// Formats the relative difference of an SIR from the optimum for a table cell.
///
/// The optimum is known to nine digits, so a smaller difference is written as "less than 1e-8".
fn short(by: f64) -> String {
    if by.abs() < 1e-8 {
        "less than 1e-8".to_owned()
    } else {
        format!("{by:.1e}")
    }
}

/// Formats a time, s, with two digits, and its ratio to this crate's time `own_s`.
fn time(time_s: f64, own_s: f64) -> String {
    let (value, unit) = match time_s {
        ..1e-3 => (time_s * 1e6, "µs"),
        1e-3..1.0 => (time_s * 1e3, "ms"),
        _ => (time_s, "s"),
    };
    format!(
        "{} {unit} ({})",
        two_digits(value),
        two_digits(time_s / own_s)
    )
}

fn two_digits(value: f64) -> String {
    let size = 10_f64.powf(value.log10().floor() - 1.0);
    let rounded = (value / size).round() * size;
    if rounded < 10.0 {
        return format!("{rounded:.1}");
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a whole number, at most the largest u64"
    )]
    spaced(rounded.round() as u64)
}
