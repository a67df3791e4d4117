//! A figure ready to be written: chart, tables and text.

use std::fmt::Write as _;

use serde::Serialize;

use super::chart::Chart;
use super::error::FigureError;

/// A figure.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// Name on the command line, and of its file without `.svg`.
    pub name: &'static str,
    /// Title.
    pub title: &'static str,
    /// Findings, one paragraph each.
    pub says: Vec<String>,
    /// Parameters; those that the paper omits are marked.
    pub taken: Vec<String>,
    /// Chart.
    pub chart: Chart,
    /// Tables, written as CSV files.
    pub tables: Vec<Table>,
    /// Short table beside the chart: head, then rows.
    pub shown: Vec<Vec<String>>,
}

/// A table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    /// Name of its file without `.csv`.
    pub name: &'static str,
    /// CSV text: head, then rows.
    pub rows: String,
}

impl Table {
    /// Creates the table of `rows`; the head has the names of their fields.
    ///
    /// # Errors
    /// [`FigureError::Table`] if a row cannot be serialised, [`FigureError::NotFinite`] if a number is not finite.
    pub fn new<R: Serialize>(
        name: &'static str,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<Self, FigureError> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in rows {
            writer.serialize(row)?;
        }
        let bytes = writer
            .into_inner()
            .map_err(|error| FigureError::File(format!("{name}.csv"), error.into_error()))?;
        let rows = String::from_utf8_lossy(&bytes).into_owned();
        let not_finite = |cell: &str| matches!(cell, "NaN" | "inf" | "-inf");
        if rows.split([',', '\n']).any(not_finite) {
            return Err(FigureError::NotFinite(format!("{name}.csv")));
        }
        Ok(Self { name, rows })
    }
}

impl Sheet {
    /// Returns the CSV file of `table`, with title and parameters as comments.
    pub fn csv(&self, table: &Table) -> String {
        let mut text = format!("# {}\n", self.title);
        for line in &self.taken {
            _ = writeln!(text, "# {line}");
        }
        text + &table.rows
    }
}
