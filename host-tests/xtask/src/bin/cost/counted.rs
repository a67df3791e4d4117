//! Figures of the image that counts instructions, and their table rows.

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
        "settled_both_ways",
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
        Some(51_000),
    ));
    rows.extend(table(&counted, SIGNED)?);
    rows.extend(table(&counted, UPLOADED)?);
    // These figures have an image of their own, because more code would change how the rest is compiled.
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
    (
        "the tag of a sweep message of 16 targets",
        "instructions",
        &["tag_84"],
        None,
    ),
    (
        "the tag of the longest body",
        "instructions",
        &["tag_longest"],
        None,
    ),
    (
        "a sweep message of 16 targets with tags, from receiving to sending it",
        "instructions",
        &["signed_sweep"],
        None,
    ),
    (
        "length of its frame",
        "bytes",
        &["signed_sweep_bytes"],
        Some(108),
    ),
    (
        "a replayed sweep message, rejected",
        "instructions",
        &["refused"],
        None,
    ),
];

/// Table rows for the runners, which move bytes between ports and a relay.
const RUNNERS: &[Counted] = &[
    (
        "a sweep message of 16 targets on polled ports, from bytes to bytes",
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
        "the same with asynchronous ports",
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

/// Table rows for the upload of a new mission in flight.
const UPLOADED: &[Counted] = &[
    (
        "an offer of a new mission, accepted",
        "instructions",
        &["offer"],
        None,
    ),
    ("length of its frame", "bytes", &["offer_bytes"], Some(149)),
];

/// Table row: description, unit, names of measured figures, and budget. The row shows the largest of these figures.
pub(crate) type Counted = (
    &'static str,
    &'static str,
    &'static [&'static str],
    Option<u64>,
);

const COUNTED: &[Counted] = &[
    (
        "stack, measured, of the calls of a relay",
        "bytes",
        &["stack"],
        None,
    ),
    ("`size_of::<Relay>()`", "bytes", &["size_of_relay"], None),
    (
        "reach of a hop: one relay, one target SIR",
        "instructions",
        &["reach"],
        Some(165),
    ),
    (
        "the same with receiver noise, the longest of 120",
        "instructions",
        &["reach_noise"],
        None,
    ),
    (
        "the same with receiver noise, the median of 120",
        "instructions",
        &["reach_noise_median"],
        None,
    ),
    (
        "a sweep message of 16 targets, from receiving to sending it",
        "instructions",
        &["sweep"],
        Some(14_000),
    ),
    ("length of its frame", "bytes", &["sweep_bytes"], Some(100)),
    (
        "a sweep message at the last relay, which sends the verdict",
        "instructions",
        &["sweep_at_tail"],
        None,
    ),
    (
        "a sweep message in both directions, from receiving to sending it",
        "instructions",
        &["sweep_both_ways"],
        None,
    ),
    (
        "length of its frame",
        "bytes",
        &["sweep_both_ways_bytes"],
        Some(100),
    ),
    (
        "a sweep message in both directions at the last relay, which sends the verdict",
        "instructions",
        &["sweep_both_ways_at_tail"],
        None,
    ),
    (
        "a verdict message in both directions, from receiving to sending it",
        "instructions",
        &["verdict_both_ways"],
        None,
    ),
    (
        "a verdict message of 16 targets, from receiving to sending it",
        "instructions",
        &["verdict"],
        None,
    ),
    (
        "a verdict message at the leader, which receives it last",
        "instructions",
        &["verdict_at_head"],
        None,
    ),
    (
        "a frame of full length, decoded and checked",
        "instructions",
        &["frame"],
        None,
    ),
    (
        "one portion of the leader's advance solution of the chain",
        "instructions",
        &["predict"],
        None,
    ),
    (
        "portions of that for a chain of 100",
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
    (
        "longest frame of the joint method",
        "bytes",
        &["joint_bytes"],
        None,
    ),
    (
        "8 relays solved by the joint method",
        "instructions",
        &["solved_8"],
        None,
    ),
    ("number of portions", "", &["portions_8"], None),
    (
        "50 relays solved by the joint method",
        "instructions",
        &["solved_50"],
        None,
    ),
    ("number of portions", "", &["portions_50"], None),
    (
        "50 relays with room to the side solved by the joint method",
        "instructions",
        &["solved_50_wide"],
        None,
    ),
    ("number of portions", "", &["portions_50_wide"], None),
    (
        "8 relays solved by the joint method for both directions",
        "instructions",
        &["solved_8_both"],
        None,
    ),
    ("number of portions", "", &["portions_8_both"], None),
    (
        "50 relays solved by the joint method for both directions",
        "instructions",
        &["solved_50_both"],
        None,
    ),
    ("number of portions", "", &["portions_50_both"], None),
    (
        "8 relays on the line solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_8_fitted"],
        None,
    ),
    ("number of portions", "", &["portions_8_fitted"], None),
    (
        "its costliest portion",
        "instructions",
        &["portion_8_fitted"],
        None,
    ),
    (
        "50 relays on the line solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_50_fitted"],
        None,
    ),
    ("number of portions", "", &["portions_50_fitted"], None),
    (
        "its costliest portion",
        "instructions",
        &["portion_50_fitted"],
        None,
    ),
    (
        "8 relays with free altitudes solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_8_fitted_high"],
        None,
    ),
    ("number of portions", "", &["portions_8_fitted_high"], None),
    (
        "20 relays with free altitudes solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_20_fitted_high"],
        None,
    ),
    ("number of portions", "", &["portions_20_fitted_high"], None),
    (
        "50 relays with free altitudes solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_50_fitted_high"],
        None,
    ),
    ("number of portions", "", &["portions_50_fitted_high"], None),
    (
        "100 relays with free altitudes solved by the joint method for fitted slots, both directions",
        "instructions",
        &["solved_100_fitted_high"],
        None,
    ),
    (
        "number of portions",
        "",
        &["portions_100_fitted_high"],
        None,
    ),
    (
        "its costliest portion",
        "instructions",
        &["portion_100_fitted_high"],
        None,
    ),
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

/// Table rows for conversions between latitude, longitude and positions on the line Tx-Rx.
///
/// The same image that measures the runners measures these conversions.
const FLOWN: &[Counted] = &[
    (
        "conversion set-up for the line between two sites",
        "instructions",
        &["line"],
        None,
    ),
    (
        "a position along the line to latitude and longitude",
        "instructions",
        &["to_earth"],
        None,
    ),
    (
        "a latitude and longitude to a position along the line",
        "instructions",
        &["from_earth"],
        None,
    ),
];

/// Names of figures that are single calls of a relay's functions. The largest of these figures has a budget.
const CALLS: &[&str] = &[
    "begin_sweep",
    "sweep",
    "sweep_at_tail",
    "begin_sweep_both_ways",
    "sweep_both_ways",
    "sweep_both_ways_at_tail",
    "verdict_both_ways",
    "verdict",
    "verdict_at_head",
    "predict",
    "joint",
    "predicted",
    "portion_8",
    "portion_50",
    "portion_50_wide",
    "portion_100",
    "portion_8_both",
    "portion_50_both",
    "portion_100_both",
    "adjust",
    "field",
    "sample",
    "estimate",
];

/// Runs the image `elf` in QEMU; returns its instruction counts by name.
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
