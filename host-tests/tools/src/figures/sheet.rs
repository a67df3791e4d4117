//! A figure that is ready to be written: its chart, its tables, and what has to be said beside them.

use std::fmt::Write as _;

use serde::Serialize;

use super::chart::Chart;
use super::trouble::Trouble;

/// One figure.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// What it is called on the command line, and its file without `.svg`.
    pub name: &'static str,
    /// What it shows, in a few words.
    pub title: &'static str,
    /// What is to be seen.
    pub says: Vec<String>,
    /// Which parameters were taken, those among them that the paper leaves out named as such.
    pub taken: Vec<String>,
    /// What is drawn.
    pub chart: Chart,
    /// The numbers.
    pub tables: Vec<Table>,
    /// A short table beside the chart: its head, then its rows.
    pub shown: Vec<Vec<String>>,
}

/// Rows of numbers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    /// Its file without `.csv`.
    pub name: &'static str,
    /// The rows under their head, as CSV.
    pub rows: String,
}

impl Table {
    /// The table of `rows`, whose head is the names of their fields.
    ///
    /// # Errors
    /// [`Trouble::Table`] where a row is no row, [`Trouble::NotFinite`] where it holds a number that is not finite.
    pub fn new<R: Serialize>(
        name: &'static str,
        rows: impl IntoIterator<Item = R>,
    ) -> Result<Self, Trouble> {
        let mut writer = csv::Writer::from_writer(Vec::new());
        for row in rows {
            writer.serialize(row)?;
        }
        let bytes = writer
            .into_inner()
            .map_err(|error| Trouble::File(format!("{name}.csv"), error.into_error()))?;
        let rows = String::from_utf8_lossy(&bytes).into_owned();
        let not_finite = |cell: &str| matches!(cell, "NaN" | "inf" | "-inf");
        if rows.split([',', '\n']).any(not_finite) {
            return Err(Trouble::NotFinite(format!("{name}.csv")));
        }
        Ok(Self { name, rows })
    }
}

impl Sheet {
    /// The file of `table`: what it is and what was taken, as comments, then its rows.
    pub fn csv(&self, table: &Table) -> String {
        let mut text = format!("# {}\n", self.title);
        for line in &self.taken {
            _ = writeln!(text, "# {line}");
        }
        text + &table.rows
    }
}
