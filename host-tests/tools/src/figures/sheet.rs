//! A figure ready to be written: chart, tables and text.

use std::fmt;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Serialize;
use uav_relay::SetupError;
use uav_relay::optimiser::search::Infeasible;
use uav_relay_scenario::mission::Refusal;

use super::chart::Chart;
use super::draw::{NotDrawn, draw};

/// Figure that is ready to be written: chart, tables and text.
#[derive(Clone, PartialEq, Debug)]
pub struct Sheet {
    /// Name of the figure on the command line, and of its file without `.svg`.
    pub name: &'static str,
    /// Title of the figure, shown above it.
    pub title: &'static str,
    /// Paragraphs of the figure's caption.
    pub says: Vec<String>,
    /// Notes below the figure: all parameters of the computation, also those that the paper omits.
    pub taken: Vec<String>,
    /// Chart of the figure, written as an SVG file.
    pub chart: Chart,
    /// Tables with the figure's numbers, written as CSV files.
    pub tables: Vec<Table>,
    /// Cells of a short table in the caption, headings first; empty for no table.
    pub shown: Vec<Vec<String>>,
}

/// Table of a figure's numbers, in CSV format.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    /// Name of the table's file without `.csv`.
    pub name: &'static str,
    /// Content of the table as CSV text: a header line, then the rows.
    pub rows: String,
}

impl Table {
    /// Creates a table of `rows`. The headings are the names of the rows' fields.
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
    /// Returns the CSV file of `table`, with the figure's title and parameters as comments.
    pub fn csv(&self, table: &Table) -> String {
        let mut text = format!("# {}\n", self.title);
        for line in &self.taken {
            _ = writeln!(text, "# {line}");
        }
        text + &table.rows
    }
}

const STYLE: &str = "body{font:16px/1.45 Helvetica,Arial,'DejaVu Sans',sans-serif;color:#222;max-width:62rem;margin:2rem auto;padding:0 1rem}\
figure{margin:2.5rem 0;break-inside:avoid}img{width:30rem;max-width:100%;height:auto}\
h2{font-size:1.15rem;margin:0 0 .5rem}figcaption{max-width:46rem}p,ul{margin:.5rem 0}\
.taken{color:#555;font-size:.9rem}table{border-collapse:collapse;font-size:.85rem;margin:.7rem 0}\
th,td{border-bottom:1px solid #ccc;padding:.15rem .7rem .15rem 0;text-align:right}th:first-child,td:first-child{text-align:left}";

/// Writes the figure's picture (SVG) and tables (CSV) to the folder `dir`.
pub fn write_sheet(dir: &Path, sheet: &Sheet) -> Result<(), FigureError> {
    let svg = draw(&sheet.chart, sheet.title)?;
    write(&dir.join(format!("{}.svg", sheet.name)), &svg)?;
    for table in &sheet.tables {
        write(&dir.join(format!("{}.csv", table.name)), &sheet.csv(table))?;
    }
    Ok(())
}

/// Writes the page `index.html` with all figures to the folder `dir`; returns the page's path.
pub fn write_index(dir: &Path, sheets: &[Sheet]) -> Result<PathBuf, FigureError> {
    let mut html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>uav-relay: figures</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>The evaluation, computed by the on-board code</h1>\n\
         <p>Hosseinalipour, Rahmati and Dai, <em>Interference Avoidance Position Planning in Dual-hop and Multi-hop UAV Relay \
         Networks</em>, section Numerical Results, and what this project adds.</p>\n"
    );
    contents(&mut html, sheets);
    for sheet in sheets {
        figure(&mut html, sheet);
    }
    html.push_str("</body>\n</html>\n");
    let file = dir.join("index.html");
    write(&file, &html)?;
    Ok(file)
}

fn contents(html: &mut String, sheets: &[Sheet]) {
    html.push_str("<nav>\n<h2>Contents</h2>\n<ol>\n");
    for sheet in sheets {
        let (name, title) = (sheet.name, escape(sheet.title));
        _ = writeln!(html, "<li><a href=\"#{name}\">{title}</a></li>");
    }
    html.push_str("</ol>\n</nav>\n");
}

fn figure(html: &mut String, sheet: &Sheet) {
    let (name, title) = (sheet.name, escape(sheet.title));
    _ = write!(
        html,
        "<figure id=\"{name}\">\n<h2>{title}</h2>\n<img src=\"{name}.svg\" alt=\"{title}\">\n<figcaption>\n"
    );
    for said in &sheet.says {
        _ = writeln!(html, "<p>{}</p>", escape(said));
    }
    short_table(html, &sheet.shown);
    html.push_str("<ul class=\"taken\">\n");
    for line in &sheet.taken {
        _ = writeln!(html, "<li>{}</li>", escape(line));
    }
    html.push_str("</ul>\n");
    let files: Vec<String> = sheet
        .tables
        .iter()
        .map(|table| format!("<a href=\"{0}.csv\">{0}.csv</a>", table.name))
        .collect();
    _ = writeln!(html, "<p class=\"taken\">Numbers: {}</p>", files.join(", "));
    html.push_str("</figcaption>\n</figure>\n");
}

fn short_table(html: &mut String, rows: &[Vec<String>]) {
    let Some((head, rows)) = rows.split_first() else {
        return;
    };
    let row = |html: &mut String, cells: &[String], tag: &str| {
        html.push_str("<tr>");
        for cell in cells {
            _ = write!(html, "<{tag}>{}</{tag}>", escape(cell));
        }
        html.push_str("</tr>\n");
    };
    html.push_str("<table>\n");
    row(html, head, "th");
    for cells in rows {
        row(html, cells, "td");
    }
    html.push_str("</table>\n");
}

fn write(file: &Path, text: &str) -> Result<(), FigureError> {
    std::fs::write(file, text).map_err(|error| FigureError::File(file.display().to_string(), error))
}

fn escape(words: &str) -> String {
    words
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

/// Reason why a figure cannot be made. Any reason but `File` is a bug, because the inputs are fixed.
#[derive(Debug)]
#[non_exhaustive]
pub enum FigureError {
    /// The scenario of the figure is not a valid mission, for this reason.
    Mission(Refusal),
    /// A relay rejects the settings of the figure, for this reason.
    Setup(SetupError),
    /// A target SIR cannot be met, or a simulated chain has no final positions. The text names the chain.
    Unsettled(&'static str),
    /// The chart of the figure cannot be drawn, for this reason.
    Drawing(NotDrawn),
    /// A table of the figure cannot be written as CSV, for this reason.
    Table(csv::Error),
    /// The table with this file name contains a number that is not finite.
    NotFinite(String),
    /// The file with this path cannot be written, for this reason.
    File(String, std::io::Error),
}

impl fmt::Display for FigureError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mission(refusal) => refusal.fmt(f),
            Self::Setup(error) => error.fmt(f),
            Self::Unsettled(what) => write!(f, "{what} has not settled"),
            Self::Drawing(NotDrawn(why)) => write!(f, "the chart cannot be drawn: {why}"),
            Self::Table(error) => write!(f, "the table cannot be written: {error}"),
            Self::NotFinite(table) => write!(f, "{table} holds a number that is not finite"),
            Self::File(file, error) => write!(f, "{file} cannot be written: {error}"),
        }
    }
}

impl std::error::Error for FigureError {}

impl From<Refusal> for FigureError {
    fn from(refusal: Refusal) -> Self {
        Self::Mission(refusal)
    }
}

impl From<SetupError> for FigureError {
    fn from(error: SetupError) -> Self {
        Self::Setup(error)
    }
}

impl From<Infeasible> for FigureError {
    fn from(_: Infeasible) -> Self {
        Self::Unsettled("a chain")
    }
}

impl From<NotDrawn> for FigureError {
    fn from(why: NotDrawn) -> Self {
        Self::Drawing(why)
    }
}

impl From<csv::Error> for FigureError {
    fn from(error: csv::Error) -> Self {
        Self::Table(error)
    }
}
