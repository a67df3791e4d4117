//! Figures of the image that counts instructions, and their table rows.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use super::image::{build, run};
use super::{Row, row};

pub(crate) fn of_the_counting_image() -> Result<Vec<Row>, String> {
    let counted = count(&build("cost", &["--features", "internals"])?)?;
    let figure = |name: &str| figure(&counted, name);
    let settled = "settled settled_both_ways agreed joint_settled predicted_settled adjust_settled \
        field_settled";
    for chain in settled.split_whitespace() {
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
    for call in CALLS.split_whitespace() {
        worst = figure(call)?.max(worst);
    }
    rows.push(row(
        "the costliest call",
        "instructions",
        worst,
        Some(51_500),
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

/// Returns the rows of `table`. Its lines have names of figures, unit and budget, and a description.
///
/// A row shows the largest of its figures. The budget may be absent.
fn table(counted: &BTreeMap<String, u64>, table: &'static str) -> Result<Vec<Row>, String> {
    let mut rows = Vec::new();
    for line in table.lines() {
        let [names, unit, what] = line.split(" | ").collect::<Vec<_>>()[..] else {
            return Err(format!("a row of the counting image has 3 columns: {line}"));
        };
        let mut most = 0;
        for name in names.split(' ') {
            most = figure(counted, name)?.max(most);
        }
        let (unit, budget) = unit.split_once(' ').unwrap_or((unit, ""));
        let budget = Some(budget).filter(|budget| !budget.is_empty());
        let budget = budget.map(str::parse).transpose();
        let budget = budget.map_err(|error| format!("{line}: {error}"))?;
        rows.push(row(what, unit, most, budget));
    }
    Ok(rows)
}

const SIGNED: &str = "\
tag_32 | instructions | the tag of a body of 32 bytes, made or checked
tag_84 | instructions | the tag of a sweep message of 16 targets
tag_longest | instructions | the tag of the longest body
signed_sweep | instructions | a sweep message of 16 targets with tags, from receiving to sending it
signed_sweep_bytes | bytes 108 | length of its frame
refused | instructions | a replayed sweep message, rejected";

/// Table rows for the runners, which move bytes between ports and a relay.
const RUNNERS: &str = "\
polled_sweep | instructions | a sweep message of 16 targets on polled ports, from bytes to bytes
async_sweep | instructions | the same on asynchronous ports
polled_idle | instructions | a poll of both polled ports with nothing to do
async_idle | instructions | the same with asynchronous ports
polled_size | bytes | RAM of two polled links
async_size | bytes | RAM of two asynchronous links and the future that runs them";

/// Table rows for the upload of a new mission in flight.
const UPLOADED: &str = "\
offer | instructions | an offer of a new mission, accepted
offer_bytes | bytes 149 | length of its frame";

const COUNTED: &str = "\
stack | bytes | stack, measured, of the calls of a relay
size_of_relay | bytes | `size_of::<Relay>()`
reach | instructions 165 | reach of a hop: one relay, one target SIR
reach_noise | instructions | the same with receiver noise, the longest of 120
reach_noise_median | instructions | the same with receiver noise, the median of 120
sweep | instructions 14000 | a sweep message of 16 targets, from receiving to sending it
sweep_bytes | bytes 100 | length of its frame
sweep_at_tail | instructions | a sweep message at the last relay, which sends the verdict
sweep_both_ways | instructions | a sweep message in both directions, from receiving to sending it
sweep_both_ways_bytes | bytes 100 | length of its frame
sweep_both_ways_at_tail | instructions | a sweep message in both directions at the last relay, which sends the verdict
verdict_both_ways | instructions | a verdict message in both directions, from receiving to sending it
verdict | instructions | a verdict message of 16 targets, from receiving to sending it
verdict_at_head | instructions | a verdict message at the leader, which receives it last
frame | instructions | a frame of full length, decoded and checked
predict | instructions | one portion of the leader's advance solution of the chain
predict_portions |  | portions of that for a chain of 100
evaluation | instructions | one evaluation of both hops in Algorithm 2
search | instructions | a local search, at most 1080 evaluations
size_of_search | bytes | its RAM
sample | instructions | a sample of the interference
estimate | instructions | an estimate from the samples
joint predicted | instructions | the costliest call of the joint method
joint_bytes | bytes | longest frame of the joint method
solved_8 | instructions | 8 relays solved by the joint method
portions_8 |  | number of portions
solved_50 | instructions | 50 relays solved by the joint method
portions_50 |  | number of portions
solved_50_wide | instructions | 50 relays with room to the side solved by the joint method
portions_50_wide |  | number of portions
solved_8_both | instructions | 8 relays solved by the joint method for both directions
portions_8_both |  | number of portions
solved_50_both | instructions | 50 relays solved by the joint method for both directions
portions_50_both |  | number of portions
solved_8_fitted | instructions | 8 relays on the line solved by the joint method for fitted slots, both directions
portions_8_fitted |  | number of portions
portion_8_fitted | instructions | its costliest portion
solved_50_fitted | instructions | 50 relays on the line solved by the joint method for fitted slots, both directions
portions_50_fitted |  | number of portions
portion_50_fitted | instructions | its costliest portion
solved_8_fitted_high | instructions | 8 relays with free altitudes solved by the joint method for fitted slots, both directions
portions_8_fitted_high |  | number of portions
solved_20_fitted_high | instructions | 20 relays with free altitudes solved by the joint method for fitted slots, both directions
portions_20_fitted_high |  | number of portions
solved_50_fitted_high | instructions | 50 relays with free altitudes solved by the joint method for fitted slots, both directions
portions_50_fitted_high |  | number of portions
solved_100_fitted_high | instructions | 100 relays with free altitudes solved by the joint method for fitted slots, both directions
portions_100_fitted_high |  | number of portions
portion_100_fitted_high | instructions | its costliest portion
size_of_solver | bytes | `size_of::<Solver>()` for up to 100 relays
adjust | instructions | the costliest call of Algorithm 2
field | instructions | the costliest call in a field";

/// Table rows for conversions between latitude, longitude and positions on the line Tx-Rx.
///
/// The same image that measures the runners measures these conversions.
const FLOWN: &str = "\
line | instructions | conversion set-up for the line between two sites
to_earth | instructions | a position along the line to latitude and longitude
from_earth | instructions | a latitude and longitude to a position along the line";

/// Names of figures that are single calls of a relay's functions. The largest of these figures has a budget.
const CALLS: &str = "\
begin_sweep sweep sweep_at_tail begin_sweep_both_ways sweep_both_ways sweep_both_ways_at_tail \
verdict_both_ways verdict verdict_at_head predict joint predicted portion_8 portion_50 \
portion_50_wide portion_100 portion_8_both portion_50_both portion_100_both adjust field sample \
estimate";

/// Runs the image `elf` in QEMU; returns its instruction counts by name.
pub(crate) fn count(elf: &Path) -> Result<BTreeMap<String, u64>, String> {
    let arguments = "300 qemu-system-arm -machine netduinoplus2 -nographic -monitor none -serial null -icount \
        shift=7 -semihosting-config enable=on,target=native -kernel";
    let arguments = arguments.split_whitespace();
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
