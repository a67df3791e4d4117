//! The results as tables in markdown, and what has to be known to read them.

use std::fmt::Write as _;

use crate::problem::Choice;
use crate::results::{Answer, Found, Results, Run, Solved};
use crate::score::{Score, score};

const TITLES: [(Choice, &str); 2] = [
    (
        Choice::Places,
        "Places, all at 20 m (the default scenario):",
    ),
    (
        Choice::Altitudes,
        "Places and altitudes (`examples/altitudes.toml`):",
    ),
];

const HEAD: &str = "\
| N | solver | SIR of the worst hop | short of the optimum by | chains evaluated | within 1e-4 of it after | time in all |
| --- | --- | --- | --- | --- | --- | --- |
";

const NOTES: &str = "\
In parentheses: times as long as the first line of that N in the same run.

- `uav-relay, as the head predicts`: what the head computes from the mission before the first sweep, and every relay's place. \
`every relay by itself`: the joint method on the whole chain from the scenario, from all of its starts, which each relay works out \
alone. \
`all relays by messages`: the computing of all relays of a simulated chain one after the other, and every frame they exchange.
- The others have the whole problem in one place, in f64. SLSQP: the largest t with ln SIR >= t at every hop, order and least \
separation as constraints, with their slopes; choices from 0 to 10; from equal spacings (at five altitudes where those are chosen) and random chains. \
Differential evolution (rand1bin, 15 members a choice, until they agree to 1e-6 or four fifths of the time limit are over) on the \
worst hop of the sorted chain. G_MLSL_LDS with LD_LBFGS on a smooth stand-in for the worst hop, 1000 evaluations.
- Time is time on the processor, of the solver alone, in one thread. Every SIR is computed from the places, \
in f64, by formulas that no solver shares; a chain that breaks order, band or least separation does not count.
";

/// The tables and the notes.
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
    let (machine, versions) = (&results.machine, &results.versions);
    _ = writeln!(
        text,
        "\n{} on {}; Python {}, SciPy {}, NLopt {}, at most {} s a solver and problem.",
        machine.date,
        machine.processor,
        versions.python,
        versions.scipy,
        versions.nlopt,
        results.limit_s
    );
    Ok(text)
}

/// The lines of one problem.
fn rows(solved: &Solved) -> Result<String, String> {
    let problem = solved.problem;
    let optimum = problem
        .optimum()
        .ok_or_else(|| format!("{problem}: not one of the problems"))?;
    let (link, band) = problem.link()?;
    let own_s = solved.runs.first().and_then(|own| match &own.answer {
        Answer::Found(found) => Some(found.time_s),
        Answer::Error(_) => None,
    });
    let own_s = own_s.ok_or_else(|| format!("{problem}: nothing to compare with"))?;
    let mut text = String::new();
    for Run { solver, answer } in &solved.runs {
        let cells = match answer {
            Answer::Error(why) => nothing(why),
            Answer::Found(found) => match score(&link, band, optimum, found) {
                Err(refusal) => nothing(&format!("does not count: {refusal}")),
                Ok(score) => cells(found, &score, optimum, own_s),
            },
        };
        _ = writeln!(text, "| {} | {solver} | {cells} |", problem.relays);
    }
    Ok(text)
}

/// The cells of a chain that counts.
fn cells(found: &Found, score: &Score, optimum: f64, own_s: f64) -> String {
    let short = short((optimum - score.sir) / optimum);
    let evaluations = found.evaluations.map_or_else(String::new, spaced);
    let good = score
        .good_after_s
        .map_or_else(|| "never".to_owned(), |after_s| time(after_s, own_s));
    let all = time(found.time_s, own_s);
    let cut = if found.cut { ", cut off" } else { "" };
    format!(
        "{:.6} | {short} | {evaluations} | {good} | {all}{cut}",
        score.sir
    )
}

/// The cells of a solver that has no chain to show.
fn nothing(why: &str) -> String {
    format!("{} | | | |", why.replace(['|', '\n'], " "))
}

/// What is missing to the optimum, relative; that is known to nine digits.
fn short(by: f64) -> String {
    if by.abs() < 1e-8 {
        "less than 1e-8".to_owned()
    } else {
        format!("{by:.1e}")
    }
}

/// A time in s to two digits, and how many times our own that is.
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

/// A number above 0, rounded to two digits.
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

/// A whole number in groups of three digits.
fn spaced(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}
