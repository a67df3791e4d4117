//! Compares the firmware's costs with budgets and documents; run by `cargo cost`.
//!
//! It also proves that the firmware cannot panic.
//!
//! It builds the relay image and the image that counts instructions, with the firmware profile. It reads sizes and the
//! largest stack from the relay's ELF, and runs the counting image in QEMU. It links the relay image with a panic
//! handler that makes the link fail if it is used. `cargo cost --write` writes the measured costs to the documents.

mod counted;
mod image;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use uav_relay_xtask::toolchain::spaced;

const USAGE: &str = "Measures flash, RAM, stack and instructions of the firmware, and compares them with their budgets\n\nUsage: cargo cost [--write]\n\n  --write  write the measured figures into README.md and examples/RESULTS.md";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let write = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => false,
        ["--write"] => true,
        ["--help" | "-h"] => {
            println!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        _ => {
            eprintln!("cost: {}: not an option\n\n{USAGE}", arguments.join(" "));
            return ExitCode::from(2);
        }
    };
    match measure().and_then(|rows| report(&rows, write)) {
        Ok(()) => {
            println!("cost: all within budget");
            ExitCode::SUCCESS
        }
        Err(error) => {
            println!("cost: {error}");
            ExitCode::FAILURE
        }
    }
}

fn report(rows: &[Row], write: bool) -> Result<(), String> {
    print!("{}", table(rows));
    println!("No panic is reachable in any of these images, and a deliberate panic does not link.");
    let over: Vec<&str> = rows
        .iter()
        .filter(|row| row.budget.is_some_and(|budget| row.value > budget))
        .map(|row| row.what)
        .collect();
    if !over.is_empty() {
        return Err(format!("over budget: {}", over.join("; ")));
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let (rustc, qemu) = (version("rustc")?, version("qemu-system-arm")?);
    if !are_of(&root, &rustc, &qemu) {
        println!(
            "The figures in the documents were measured with another compiler or emulator than rustc {rustc} and QEMU {qemu}."
        );
        return Ok(());
    }
    for document in all(&root, rows)? {
        if write {
            document.write()?;
        } else if !document.is_right() {
            return Err(format!(
                "{} differs from the measured costs: run `cargo cost --write`",
                document.name()
            ));
        }
    }
    Ok(())
}

fn version(program: &str) -> Result<String, String> {
    let output = Command::new(program).arg("--version").output();
    let output = output.map_err(|error| format!("{program}: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let numbers = text
        .split_whitespace()
        .find(|word| word.starts_with(|first: char| first.is_ascii_digit()));
    let mut parts = numbers.unwrap_or_default().split('.');
    match (parts.next(), parts.next()) {
        (Some(major), Some(minor)) => Ok(format!("{major}.{minor}")),
        _ => Err(format!("{program} prints no version: {text}")),
    }
}

fn measure() -> Result<Vec<Row>, String> {
    // A missing tool is reported before the builds, which take minutes.
    image::objdump()?;
    version("qemu-system-arm")?;
    image::a_panic_is_found()?;
    let mut rows = image::of_the_relay_image()?;
    rows.extend(counted::of_the_counting_image()?);
    Ok(rows)
}

pub(crate) struct Row {
    pub(crate) what: &'static str,
    pub(crate) unit: &'static str,
    pub(crate) value: u64,
    pub(crate) budget: Option<u64>,
}

pub(crate) const fn row(
    what: &'static str,
    unit: &'static str,
    value: u64,
    budget: Option<u64>,
) -> Row {
    Row {
        what,
        unit,
        value,
        budget,
    }
}

const HEAD: &str =
    "| | measured | at 168 MHz, an instruction a cycle | budget |\n| --- | --- | --- | --- |\n";

/// Clock of the STM32F405, MHz: number of instructions per microsecond at one instruction per cycle.
const CLOCK_MHZ: u64 = 168;

/// Document with costs: its present text, and its text with the measured costs.
pub(crate) struct Document {
    name: &'static str,
    path: PathBuf,
    kept: String,
    measured: String,
}

impl Document {
    /// Returns true if the document states the measured costs.
    pub(crate) fn is_right(&self) -> bool {
        self.kept == self.measured
    }

    pub(crate) const fn name(&self) -> &'static str {
        self.name
    }

    pub(crate) fn write(&self) -> Result<(), String> {
        let written = std::fs::write(&self.path, &self.measured);
        written.map_err(|error| format!("{}: {error}", self.name))
    }
}

pub(crate) fn table(rows: &[Row]) -> String {
    let lines = rows.iter().map(|row| {
        let (what, unit, value) = (row.what, row.unit, row.value);
        let budget = row
            .budget
            .map_or_else(String::new, |budget| format!("{budget} {unit}"));
        let time = if unit == "instructions" {
            milliseconds(value)
        } else {
            String::new()
        };
        format!("| {what} | {value} {unit} | {time} | {budget} |\n")
    });
    std::iter::once(HEAD.to_owned()).chain(lines).collect()
}

/// Formats the duration of a number of instructions, in ms with three decimals.
fn milliseconds(instructions: u64) -> String {
    let micros = (instructions + CLOCK_MHZ / 2) / CLOCK_MHZ;
    format!("{}.{:03} ms", micros / 1_000, micros % 1_000)
}

pub(crate) fn all(root: &Path, rows: &[Row]) -> Result<[Document; 2], String> {
    let results = with(root, "examples/RESULTS.md", |text| {
        let begin = text.find(HEAD)?;
        let after = text.get(begin..)?;
        let end = begin + after.find("\n\n")? + 1;
        Some([text.get(..begin)?, &table(rows), text.get(end..)?].concat())
    })?;
    let readme = with(root, "README.md", |text| {
        let mut text = text.to_owned();
        for (begins, says) in lines(rows)? {
            let begin = text.find(begins)?;
            let end = begin + text.get(begin..)?.find('\n')?;
            text.replace_range(begin..end, &format!("{begins}{says} | `cargo cost` |"));
        }
        Some(text)
    })?;
    Ok([results, readme])
}

/// Returns true if the documented costs are for the installed compiler and emulator.
///
/// The costs depend on both versions, so costs of other versions are not compared.
pub(crate) fn are_of(root: &Path, rustc: &str, qemu: &str) -> bool {
    let results = std::fs::read_to_string(root.join("examples/RESULTS.md"));
    results.is_ok_and(|text| text.contains(&format!("(rustc {rustc}, QEMU {qemu}, ")))
}

fn with(
    root: &Path,
    name: &'static str,
    measured: impl Fn(&str) -> Option<String>,
) -> Result<Document, String> {
    let path = root.join(name);
    let kept = std::fs::read_to_string(&path).map_err(|error| format!("{name}: {error}"))?;
    let measured = measured(&kept)
        .ok_or_else(|| format!("{name}: the marked place for the costs is missing"))?;
    Ok(Document {
        name,
        path,
        kept,
        measured,
    })
}

/// Returns the four cost rows of the README's table. Each is a pair: the first cell, and the text of the second cell.
///
/// The text of the second cell has the measured costs. `None` if `rows` lacks a cost.
fn lines(rows: &[Row]) -> Option<[(&'static str, String); 4]> {
    let image = |what: &str| {
        let at = rows.iter().position(|row| row.what == what)?;
        let [flash, ram, stack] = rows.get(at..at + 3)? else {
            return None;
        };
        let [flash, ram, stack] = [flash, ram, stack].map(|row| spaced(row.value));
        Some(format!("{flash}, {ram} and {stack} bytes"))
    };
    let sweep = |what: &str| {
        let at = rows.iter().position(|row| row.what == what)?;
        let [sweep, frame] = rows.get(at..at + 2)? else {
            return None;
        };
        let (sweep, frame) = (spaced(sweep.value), frame.value);
        Some(format!("{sweep} instructions, {frame} bytes on the wire"))
    };
    Some([
        (
            "| flash, static RAM, stack: Algorithm 1 alone | ",
            image("flash of the relay image, Algorithm 1 alone")?,
        ),
        (
            "| the same with every feature | ",
            image("flash of the relay image, everything")?,
        ),
        (
            "| one sweep message with 16 target SIRs, from receiving to sending it | ",
            sweep("a sweep message of 16 targets, from receiving to sending it")?,
        ),
        (
            "| the same for both directions | ",
            sweep("a sweep message in both directions, from receiving to sending it")?,
        ),
    ])
}
