//! HTML page of the figures, with their parameters and findings.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use super::draw::draw;
use super::error::FigureError;
use super::sheet::Sheet;

const STYLE: &str = "body{font:16px/1.45 Helvetica,Arial,'DejaVu Sans',sans-serif;color:#222;max-width:62rem;margin:2rem auto;padding:0 1rem}\
figure{margin:2.5rem 0;break-inside:avoid}img{width:30rem;max-width:100%;height:auto}\
h2{font-size:1.15rem;margin:0 0 .5rem}figcaption{max-width:46rem}p,ul{margin:.5rem 0}\
.taken{color:#555;font-size:.9rem}table{border-collapse:collapse;font-size:.85rem;margin:.7rem 0}\
th,td{border-bottom:1px solid #ccc;padding:.15rem .7rem .15rem 0;text-align:right}th:first-child,td:first-child{text-align:left}";

/// Writes a figure's picture and tables to `dir`.
///
/// # Errors
/// [`FigureError::Drawing`] or [`FigureError::File`].
pub fn write_sheet(dir: &Path, sheet: &Sheet) -> Result<(), FigureError> {
    let svg = draw(&sheet.chart, sheet.title)?;
    write(&dir.join(format!("{}.svg", sheet.name)), &svg)?;
    for table in &sheet.tables {
        write(&dir.join(format!("{}.csv", table.name)), &sheet.csv(table))?;
    }
    Ok(())
}

/// Writes `index.html` with these figures to `dir` and returns its path.
///
/// # Errors
/// [`FigureError::File`].
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
