//! Costs in the documents: the table of `host-tests/RESULTS.md`, and three rows of `README.md`.

use std::path::{Path, PathBuf};

use uav_relay_xtask::number::spaced;

use crate::row::Row;

const HEAD: &str =
    "| | measured | at 168 MHz, an instruction a cycle | budget |\n| --- | --- | --- | --- |\n";

/// Clock of the STM32F405, in instructions per microsecond at one per cycle.
const CLOCK_MHZ: u64 = 168;

/// A document with its current and its expected text.
pub(crate) struct Document {
    name: &'static str,
    path: PathBuf,
    kept: String,
    measured: String,
}

impl Document {
    /// Returns true if the document has the measured costs.
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

/// Formats the time of a number of instructions, to the microsecond.
fn milliseconds(instructions: u64) -> String {
    let micros = (instructions + CLOCK_MHZ / 2) / CLOCK_MHZ;
    format!("{}.{:03} ms", micros / 1_000, micros % 1_000)
}

pub(crate) fn all(root: &Path, rows: &[Row]) -> Result<[Document; 2], String> {
    let results = with(root, "host-tests/RESULTS.md", |text| {
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

/// Returns true if the documents are of this compiler and emulator, on which costs depend.
pub(crate) fn are_of(root: &Path, rustc: &str, qemu: &str) -> bool {
    let results = std::fs::read_to_string(root.join("host-tests/RESULTS.md"));
    results.is_ok_and(|text| text.contains(&format!("(rustc {rustc}, QEMU {qemu}, ")))
}

fn with(
    root: &Path,
    name: &'static str,
    measured: impl Fn(&str) -> Option<String>,
) -> Result<Document, String> {
    let path = root.join(name);
    let kept = std::fs::read_to_string(&path).map_err(|error| format!("{name}: {error}"))?;
    let measured = measured(&kept).ok_or_else(|| format!("{name}: no place for costs"))?;
    Ok(Document {
        name,
        path,
        kept,
        measured,
    })
}

/// Returns the beginnings of the README's rows and their text.
fn lines(rows: &[Row]) -> Option<[(&'static str, String); 3]> {
    let image = |what: &str| {
        let at = rows.iter().position(|row| row.what == what)?;
        let [flash, ram, stack] = rows.get(at..at + 3)? else {
            return None;
        };
        let [flash, ram, stack] = [flash, ram, stack].map(|row| spaced(row.value));
        Some(format!("{flash}, {ram} and {stack} bytes"))
    };
    let sweep = rows
        .iter()
        .position(|row| row.what == "a full sweep, message in to message out")?;
    let [sweep, frame] = rows.get(sweep..sweep + 2)? else {
        return None;
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
            "| a sweep of 16 targets, message in to message out | ",
            format!(
                "{} instructions, {} bytes on the wire",
                spaced(sweep.value),
                frame.value
            ),
        ),
    ])
}
