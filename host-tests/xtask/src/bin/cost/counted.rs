//! Figures that the counting image reports, and their table rows.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use super::image::{build, run};
use super::{Row, row};

pub(crate) fn of_the_counting_image() -> Result<Vec<Row>, String> {
    let counted = count(&build("cost", &["--features", "internals"])?)?;
    let figure = |name: &str| figure(&counted, name);
    let settled = [
        "settled",
        "agreed",
        "joint_settled",
        "predicted_settled",
        "adjust_settled",
        "field_settled",
    ];
    for chain in settled {
        if figure(chain)? != 1 {
            return Err(format!("a chain in the counting image: not {chain}"));
        }
    }
    if figure("fewest_relays")? != 22 {
        return Err("the counting image does not count 22 relays".to_owned());
    }
    for sign in ["passed_on", "replayed"] {
        if figure(sign)? != 1 {
            return Err(format!("a signed sweep in the counting image: not {sign}"));
        }
    }
    if figure("held")? != 1 {
        return Err("an offer in the counting image: not held".to_owned());
    }
    let mut rows = table(&counted, COUNTED)?;
    let mut worst = 0;
    for call in CALLS {
        worst = figure(call)?.max(worst);
    }
    rows.push(row(
        "the costliest call",
        "instructions",
        worst,
        Some(50_000),
    ));
    rows.extend(table(&counted, SIGNED)?);
    rows.extend(table(&counted, UPLOADED)?);
    // A separate image: more code would change the compiler's choices everywhere.
    let runners = count(&build("cost", &["--features", "async,internals"])?)?;
    rows.extend(table(&runners, RUNNERS)?);
    rows.extend(table(&runners, FLOWN)?);
    Ok(rows)
}

fn figure(counted: &BTreeMap<String, u64>, name: &str) -> Result<u64, String> {
    counted
        .get(name)
        .copied()
        .ok_or_else(|| format!("the image did not report {name}"))
}

fn table(counted: &BTreeMap<String, u64>, of: &[Counted]) -> Result<Vec<Row>, String> {
    let mut rows = Vec::new();
    for &(what, unit, names, budget) in of {
        let mut most = 0;
        for name in names {
            most = figure(counted, name)?.max(most);
        }
        rows.push(row(what, unit, most, budget));
    }
    Ok(rows)
}

const SIGNED: &[Counted] = &[
    (
        "the tag of a body of 32 bytes, made or checked",
        "instructions",
        &["tag_32"],
        None,
    ),
    ("the tag of a full sweep", "instructions", &["tag_84"], None),
    (
        "the tag of the longest body",
        "instructions",
        &["tag_longest"],
        None,
    ),
    (
        "a full sweep with tags, message in to message out",
        "instructions",
        &["signed_sweep"],
        None,
    ),
    ("its frame", "bytes", &["signed_sweep_bytes"], Some(108)),
    (
        "a replayed sweep, refused",
        "instructions",
        &["refused"],
        None,
    ),
];

/// Figures of the runners, which move bytes between ports and a relay.
const RUNNERS: &[Counted] = &[
    (
        "a full sweep on polled ports, bytes in to bytes out",
        "instructions",
        &["polled_sweep"],
        None,
    ),
    (
        "the same on asynchronous ports",
        "instructions",
        &["async_sweep"],
        None,
    ),
    (
        "a poll of both polled ports with nothing to do",
        "instructions",
        &["polled_idle"],
        None,
    ),
    (
        "the same of asynchronous ports",
        "instructions",
        &["async_idle"],
        None,
    ),
    ("RAM of two polled links", "bytes", &["polled_size"], None),
    (
        "RAM of two asynchronous links and the future that runs them",
        "bytes",
        &["async_size"],
        None,
    ),
];

/// Figures of mission uploads.
const UPLOADED: &[Counted] = &[
    (
        "an offer of a new mission, taken",
        "instructions",
        &["offer"],
        None,
    ),
    ("its frame", "bytes", &["offer_bytes"], Some(148)),
];

/// A row of the table: description, unit, names of figures (the largest counts), and budget.
pub(crate) type Counted = (
    &'static str,
    &'static str,
    &'static [&'static str],
    Option<u64>,
);

const COUNTED: &[Counted] = &[
    (
        "stack, measured: the calls of a relay",
        "bytes",
        &["stack"],
        None,
    ),
    ("`size_of::<Relay>()`", "bytes", &["size_of_relay"], None),
    ("one reach", "instructions", &["reach"], Some(165)),
    (
        "one reach in noise, the longest of 120",
        "instructions",
        &["reach_noise"],
        None,
    ),
    (
        "one reach in noise, the median of 120",
        "instructions",
        &["reach_noise_median"],
        None,
    ),
    (
        "a full sweep, message in to message out",
        "instructions",
        &["sweep"],
        Some(14_000),
    ),
    ("its frame", "bytes", &["sweep_bytes"], Some(100)),
    (
        "a full sweep at the last relay, message in to verdict out",
        "instructions",
        &["sweep_at_tail"],
        None,
    ),
    (
        "a full verdict, message in to message out",
        "instructions",
        &["verdict"],
        None,
    ),
    (
        "a full verdict at the leader",
        "instructions",
        &["verdict_at_head"],
        None,
    ),
    (
        "a full frame, deframed and checked",
        "instructions",
        &["frame"],
        None,
    ),
    (
        "a portion of the leader's prediction",
        "instructions",
        &["predict"],
        None,
    ),
    (
        "portions for a chain of 100",
        "",
        &["predict_portions"],
        None,
    ),
    (
        "one evaluation of both hops in Algorithm 2",
        "instructions",
        &["evaluation"],
        None,
    ),
    (
        "a local search, at most 1080 evaluations",
        "instructions",
        &["search"],
        None,
    ),
    ("its RAM", "bytes", &["size_of_search"], None),
    (
        "Theorem 1: one relay placed along x",
        "instructions",
        &["theorem_1"],
        None,
    ),
    (
        "Theorem 2: its altitude",
        "instructions",
        &["theorem_2"],
        None,
    ),
    ("Theorem 3: both", "instructions", &["theorem_3"], None),
    (
        "the fewest relays for an SIR of 5: 22",
        "instructions",
        &["fewest"],
        None,
    ),
    (
        "a sample of the interference",
        "instructions",
        &["sample"],
        None,
    ),
    (
        "an estimate from the samples",
        "instructions",
        &["estimate"],
        None,
    ),
    (
        "the costliest call of the joint method",
        "instructions",
        &["joint", "predicted"],
        None,
    ),
    ("its longest frame", "bytes", &["joint_bytes"], None),
    (
        "8 relays solved by the joint method",
        "instructions",
        &["solved_8"],
        None,
    ),
    ("in portions", "", &["portions_8"], None),
    (
        "50 relays solved by the joint method",
        "instructions",
        &["solved_50"],
        None,
    ),
    ("in portions", "", &["portions_50"], None),
    (
        "50 relays with room to the side solved by the joint method",
        "instructions",
        &["solved_50_wide"],
        None,
    ),
    ("in portions", "", &["portions_50_wide"], None),
    (
        "`size_of::<Solver>()` for up to 100 relays",
        "bytes",
        &["size_of_solver"],
        None,
    ),
    (
        "the costliest call of Algorithm 2",
        "instructions",
        &["adjust"],
        None,
    ),
    (
        "the costliest call in a field",
        "instructions",
        &["field"],
        None,
    ),
];

/// Figures of the geographic line, in the image of the runners.
const FLOWN: &[Counted] = &[
    (
        "the line between two sites",
        "instructions",
        &["line"],
        None,
    ),
    (
        "a place along it as latitude and longitude",
        "instructions",
        &["to_earth"],
        None,
    ),
    (
        "a latitude and longitude as a place along it",
        "instructions",
        &["from_earth"],
        None,
    ),
];

/// Figures that are calls of a relay.
const CALLS: &[&str] = &[
    "begin_sweep",
    "sweep",
    "sweep_at_tail",
    "verdict",
    "verdict_at_head",
    "predict",
    "joint",
    "predicted",
    "portion_8",
    "portion_50",
    "portion_50_wide",
    "adjust",
    "field",
    "sample",
    "estimate",
];

/// Runs the counting image in QEMU and returns its figures by name.
pub(crate) fn count(elf: &Path) -> Result<BTreeMap<String, u64>, String> {
    let arguments = [
        "300",
        "qemu-system-arm",
        "-machine",
        "netduinoplus2",
        "-nographic",
        "-monitor",
        "none",
        "-serial",
        "null",
        "-icount",
        "shift=7",
        "-semihosting-config",
        "enable=on,target=native",
        "-kernel",
    ];
    let output = run(Command::new("timeout").args(arguments).arg(elf))?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let figures: BTreeMap<String, u64> = text
        .lines()
        .filter_map(|line| {
            let (name, value) = line.trim().split_once(' ')?;
            Some((name.to_owned(), value.parse().ok()?))
        })
        .collect();
    if figures.contains_key("done") {
        Ok(figures)
    } else {
        Err(format!("the counting image did not finish:\n{text}"))
    }
}
