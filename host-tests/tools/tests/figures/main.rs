//! Runs of `cargo figures` as a program.
//!
//! Each table is compared with a reference that shares no formula with the crate, or with values of a separate program.
//! The tool runs once, in full; the tests read its files.
#![cfg(test)]
#![allow(clippy::float_cmp)]

mod altitudes;
mod chains;
mod files;
mod link;
mod single;

use std::path::Path;
use std::process::{Command, Output};
use std::sync::OnceLock;

use tempfile::TempDir;
use uav_relay_oracle::cases::Case;

fn figures(arguments: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_figures"))
        .args(arguments.split_whitespace())
        .output()
        .unwrap()
}

fn written() -> &'static Path {
    static DIR: OnceLock<TempDir> = OnceLock::new();
    DIR.get_or_init(|| {
        let dir = TempDir::new().unwrap();
        let output = figures(&format!("--out {}", dir.path().display()));
        let errors = String::from_utf8_lossy(&output.stderr);
        let is_progress = |line: &str| line.contains(" figures: ");
        assert!(
            output.status.success() && errors.lines().all(is_progress),
            "{errors}"
        );
        dir
    })
    .path()
}

struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(name: &str) -> Self {
        let file = written().join(format!("{name}.csv"));
        let mut reader = csv::ReaderBuilder::new()
            .comment(Some(b'#'))
            .from_path(file)
            .unwrap();
        let owned = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect();
        let head = owned(reader.headers().unwrap());
        let rows: Vec<Vec<String>> = reader.records().map(|row| owned(&row.unwrap())).collect();
        assert!(!rows.is_empty(), "{name} is empty");
        Self { head, rows }
    }

    fn column(&self, name: &str) -> usize {
        self.head
            .iter()
            .position(|head| head == name)
            .unwrap_or_else(|| panic!("no {name} in {:?}", self.head))
    }

    fn rows(&self, of: &[(&str, f64)]) -> Vec<Row<'_>> {
        let matches = |row: &Row<'_>| of.iter().all(|(name, value)| row.get(name) == Some(*value));
        let all = self.rows.iter().map(|cells| Row { table: self, cells });
        all.filter(matches).collect()
    }

    fn row(&self, of: &[(&str, f64)]) -> Row<'_> {
        let mut rows = self.rows(of);
        assert_eq!(rows.len(), 1, "{of:?}");
        rows.remove(0)
    }
}

#[derive(Clone, Copy)]
struct Row<'a> {
    table: &'a Table,
    cells: &'a [String],
}

impl Row<'_> {
    fn text(&self, name: &str) -> &str {
        &self.cells[self.table.column(name)]
    }

    fn get(&self, name: &str) -> Option<f64> {
        self.text(name).parse().ok()
    }

    fn number(&self, name: &str) -> f64 {
        self.get(name)
            .unwrap_or_else(|| panic!("no number in {name}: {:?}", self.cells))
    }
}

fn off(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}

/// Checks that a number of a row equals a part of a case, by a relative error below 1e-7.
#[track_caller]
fn equals(row: &Row, name: &str, case: &Case, part: &str) {
    let (got, want) = (row.number(name), case.part(part).unwrap());
    assert!(off(got, want) < 1e-7, "{name}: {got} against {want}");
}

/// Checks that `got` is between `want` x (1 - `least`) and `want` x (1 + `most`).
#[track_caller]
fn within(got: f64, want: f64, least: f64, most: f64) {
    assert!(
        got >= want * (1.0 - least) && got <= want * (1.0 + most),
        "{got} against {want}"
    );
}
