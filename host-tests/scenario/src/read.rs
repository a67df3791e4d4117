//! Reads a file into a TOML table: errors that occur before keys are checked.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use toml::Table;

use crate::error::{Problem, ScenarioError, cut};

/// Largest file size, bytes. Far more than 1000 relays and as many interferers, and it bounds `/dev/zero`.
const LONGEST: u64 = 1 << 20;

pub(super) fn text_of(path: &Path) -> Result<String, ScenarioError> {
    let fail = |problem, value, allowed: &str| ScenarioError {
        file: path.display().to_string(),
        key: None,
        value,
        problem,
        allowed: allowed.to_owned(),
    };
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LONGEST + 1).read_to_end(&mut bytes))
        .map_err(|error| {
            let problem = match error.kind() {
                ErrorKind::NotFound => Problem::NoSuchFile,
                ErrorKind::IsADirectory => Problem::Directory,
                kind => Problem::Unreadable(kind),
            };
            fail(problem, None, "a readable TOML file")
        })?;
    if bytes.len() as u64 > LONGEST {
        return Err(fail(
            Problem::TooLong,
            None,
            "at most 1 MiB (1048576 bytes)",
        ));
    }
    String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let byte = error.as_bytes().get(at).copied().unwrap_or_default();
        let value = format!("byte 0x{byte:02x} at offset {at}");
        fail(Problem::NotUtf8, Some(value), "UTF-8 text")
    })
}

pub(super) fn table_of(file: &str, text: &str) -> Result<Table, ScenarioError> {
    let fail = |key, value, problem, allowed| ScenarioError {
        file: file.to_owned(),
        key,
        value,
        problem,
        allowed,
    };
    let table: Table = text.parse().map_err(|error: toml::de::Error| {
        let start = error.span().map_or(0, |span| span.start);
        let (line, column, source) = place(text, start);
        let key = format!("line {line}, column {column}: {}", cut(source.trim()));
        let why = error.message().lines().collect::<Vec<_>>().join(", ");
        fail(
            Some(key),
            None,
            Problem::Syntax,
            format!("valid TOML ({why})"),
        )
    })?;
    if table.is_empty() {
        let allowed = "at least [geometry], [power] and [[interferer]] or [field]".to_owned();
        return Err(fail(None, None, Problem::Empty, allowed));
    }
    Ok(table)
}

/// Returns line and column (from 1, in characters) of a byte offset, and the text of that line.
fn place(text: &str, byte: usize) -> (usize, usize, &str) {
    let before = text.get(..byte).unwrap_or(text);
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.matches('\n').count() + 1;
    let column = before.get(start..).unwrap_or_default().chars().count() + 1;
    let rest = text.get(start..).unwrap_or_default();
    (line, column, rest.lines().next().unwrap_or_default())
}
