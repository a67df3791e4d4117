//! Checks a scenario file against the table of keys.
//!
//! The checks are for the form of the file, unknown and missing keys, types and ranges.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use toml::{Table, Value};

use super::endpoint::Endpoint;
use super::error::{Problem, ScenarioError, cut, quote};
use super::keys::Rule::{LinkOrNumber, Number, Whole};
use super::keys::{FILE, Key, Range, Rule, SECTIONS, names};

pub(super) fn mistake(
    file: &str,
    key: &str,
    value: Option<String>,
    problem: Problem,
    allowed: String,
) -> ScenarioError {
    ScenarioError {
        file: file.to_owned(),
        key: Some(key.to_owned()),
        value,
        problem,
        allowed,
    }
}

pub(super) fn table(file: &str, table: &Table) -> Result<(), ScenarioError> {
    Check { file }.table("", table, sections())
}

fn sections() -> impl Iterator<Item = &'static Key> + Clone {
    FILE.iter().chain(SECTIONS)
}

struct Check<'a> {
    file: &'a str,
}

impl Check<'_> {
    fn table(
        &self,
        path: &str,
        table: &Table,
        keys: impl IntoIterator<Item = &'static Key> + Clone,
    ) -> Result<(), ScenarioError> {
        let is_known = |name: &str| keys.clone().into_iter().any(|key| key.name == name);
        if let Some((name, value)) = table.iter().find(|(name, _)| !is_known(name)) {
            let meant = nearest(name, keys.clone());
            let allowed = format!("the keys {}{meant}", names(keys));
            // The name comes from the file, so it may be as long as the file.
            let path = join(path, &cut(name));
            return Err(mistake(
                self.file,
                &path,
                Some(quote(value)),
                Problem::UnknownKey,
                allowed,
            ));
        }
        for key in keys.clone() {
            let path = join(path, key.name);
            match table.get(key.name) {
                Some(value) => {
                    self.check_exclusive(&path, value, table, key)?;
                    self.value(&path, value, &key.rule)?;
                }
                None if !key.is_missed(table) => {}
                // A missing table counts as an empty table, so that its first required key is reported.
                None => match key.rule {
                    Rule::Table(inner) => self.table(&path, &Table::new(), inner)?,
                    ref rule => {
                        return Err(mistake(
                            self.file,
                            &path,
                            None,
                            Problem::Missing,
                            key.alternatives(keys.clone())
                                .fold(rule.to_string(), |said, other| {
                                    format!(
                                        "{said}, or the key {} instead, {}",
                                        other.name, other.rule
                                    )
                                }),
                        ));
                    }
                },
            }
        }
        Ok(())
    }

    /// Rejects `key` if its table also has a key that `key` excludes, such as `power_w` and `power_dbm`.
    fn check_exclusive(
        &self,
        path: &str,
        value: &Value,
        table: &Table,
        key: &Key,
    ) -> Result<(), ScenarioError> {
        let mut beside = key.without.iter();
        let Some((other, twice)) = beside.find_map(|name| table.get_key_value(*name)) else {
            return Ok(());
        };
        let allowed = format!("{} or {other}, not both", key.name);
        let both = format!("{} together with {other} = {}", quote(value), quote(twice));
        Err(mistake(
            self.file,
            path,
            Some(both),
            Problem::SaidTwice,
            allowed,
        ))
    }

    /// Checks that `value`, an entry of a list, is a number within `range`.
    fn number(&self, path: &str, value: &Value, range: &Range) -> Result<(), ScenarioError> {
        let problem = match as_number(value) {
            Some(number) if range.holds(number) => return Ok(()),
            Some(_) => Problem::OutOfRange,
            None => Problem::WrongType,
        };
        let allowed = format!("a number, {range}");
        Err(mistake(
            self.file,
            path,
            Some(quote(value)),
            problem,
            allowed,
        ))
    }

    fn value(&self, path: &str, value: &Value, rule: &Rule) -> Result<(), ScenarioError> {
        let fail = |problem| {
            let allowed = match problem {
                Problem::NoList => format!("[[{path}]] instead of [{path}], {rule}"),
                Problem::NoTable => format!("[{path}] instead of [[{path}]], {rule}"),
                _ => rule.to_string(),
            };
            Err(mistake(
                self.file,
                path,
                Some(quote(value)),
                problem,
                allowed,
            ))
        };
        match (rule, value) {
            (LinkOrNumber(_), Value::String(link)) if link == "los" || link == "nlos" => Ok(()),
            (Number(range) | LinkOrNumber(range), _) => match as_number(value) {
                Some(number) if range.holds(number) => Ok(()),
                Some(_) => fail(Problem::OutOfRange),
                None => fail(Problem::WrongType),
            },
            (Whole(range), Value::Integer(whole)) if !range.holds(*whole as f64) => {
                fail(Problem::OutOfRange)
            }
            (Rule::Text | Rule::TtyOrUdp, Value::String(text)) if text.is_empty() => {
                fail(Problem::OutOfRange)
            }
            (Rule::TtyOrUdp, Value::String(text)) => match Endpoint::parse(text) {
                Some(Err(error)) => fail(Problem::NoEndpoint(error)),
                None | Some(Ok(_)) => Ok(()),
            },
            (Rule::Choice(texts), Value::String(text)) if !texts.contains(&text.as_str()) => {
                fail(Problem::UnknownChoice)
            }
            (Rule::Texts, Value::Array(list)) if list.is_empty() => fail(Problem::EmptyList),
            (Rule::Texts, Value::Array(list)) => {
                for (index, item) in list.iter().enumerate() {
                    self.value(&format!("{path}[{index}]"), item, &Rule::Text)?;
                }
                Ok(())
            }
            (Rule::NumberOrTwo(range), Value::Array(list)) => match list.as_slice() {
                [low, high] => {
                    for (index, item) in [low, high].into_iter().enumerate() {
                        self.number(&format!("{path}[{index}]"), item, range)?;
                    }
                    if as_number(low) > as_number(high) {
                        return fail(Problem::Unsorted);
                    }
                    Ok(())
                }
                _ => fail(Problem::WrongType),
            },
            (Rule::NumberOrTwo(range), _)
                if as_number(value).is_some_and(|own| range.holds(own)) =>
            {
                Ok(())
            }
            (Rule::NumberOrTwo(_), _) if as_number(value).is_some() => fail(Problem::OutOfRange),
            (Rule::Numbers(ranges), Value::Array(list)) if list.len() == ranges.len() => {
                for (index, (item, range)) in list.iter().zip(*ranges).enumerate() {
                    self.number(&format!("{path}[{index}]"), item, range)?;
                }
                Ok(())
            }
            (Rule::Points(ranges, [least, most]), Value::Array(list))
                if (*least..=*most).contains(&list.len()) =>
            {
                for (index, item) in list.iter().enumerate() {
                    self.value(&format!("{path}[{index}]"), item, &Rule::Numbers(ranges))?;
                }
                Ok(())
            }
            (Rule::Points(..), Value::Array(list)) if list.is_empty() => fail(Problem::EmptyList),
            (Rule::Numbers(_) | Rule::Points(..), Value::Array(_)) => fail(Problem::OutOfRange),
            (Whole(_), Value::Integer(_))
            | (Rule::Flag, Value::Boolean(_))
            | (Rule::Text | Rule::Choice(_), Value::String(_)) => Ok(()),
            (Rule::Table(keys), Value::Table(table)) => self.table(path, table, *keys),
            (Rule::Tables(_, least), Value::Array(list)) if list.len() < *least => {
                fail(Problem::EmptyList)
            }
            (Rule::Tables(keys, _), Value::Array(list)) => {
                for (index, item) in list.iter().enumerate() {
                    self.value(&format!("{path}[{index}]"), item, &Rule::Table(keys))?;
                }
                Ok(())
            }
            (Rule::Tables(..), Value::Table(_)) => fail(Problem::NoList),
            (Rule::Table(_), Value::Array(list)) if list.iter().any(Value::is_table) => {
                fail(Problem::NoTable)
            }
            // serde would accept a list in place of a table, with the list's entries as fields.
            _ => fail(Problem::WrongType),
        }
    }
}

/// Minimum similarity for an error message to suggest a known key: Jaro-Winkler, 0 to 1.
const ALIKE: f64 = 0.8;

/// Returns "; did you mean KEY?" with the most similar known key; empty if no key is similar.
fn nearest(name: &str, keys: impl IntoIterator<Item = &'static Key>) -> String {
    let alike = keys
        .into_iter()
        .map(|key| (strsim::jaro_winkler(name, key.name), key.name));
    alike
        .filter(|(alike, _)| *alike >= ALIKE)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map_or_else(String::new, |(_, key)| format!("; did you mean {key}?"))
}

fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_owned()
    } else {
        format!("{path}.{name}")
    }
}

fn as_number(value: &Value) -> Option<f64> {
    match value {
        Value::Integer(whole) => Some(*whole as f64),
        Value::Float(number) => Some(*number),
        _ => None,
    }
}

/// Creates the error for a scenario table that the function [`table`] accepts, but serde rejects.
///
/// Such an error is a bug of this crate: the list of allowed keys contradicts the Rust types.
pub(super) fn internal_mismatch(file: &str, error: &toml::de::Error) -> ScenarioError {
    ScenarioError {
        file: file.to_owned(),
        key: None,
        value: None,
        problem: Problem::WrongType,
        allowed: error.message().to_owned(),
    }
}

/// Largest size of a scenario file, bytes.
///
/// The limit ends the reading of endless files such as `/dev/zero`.
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
            fail(problem, None, "the name of a readable TOML file")
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
            format!("valid TOML (the parser reports: {why})"),
        )
    })?;
    if table.is_empty() {
        let allowed =
            "at least [geometry], [power], and one of [[interferer]] and [field]".to_owned();
        return Err(fail(None, None, Problem::Empty, allowed));
    }
    Ok(table)
}

/// Returns line and column of a byte offset, both counted from 1, and the text of that line.
///
/// The column is in characters.
fn place(text: &str, byte: usize) -> (usize, usize, &str) {
    let before = text.get(..byte).unwrap_or(text);
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = before.matches('\n').count() + 1;
    let column = before.get(start..).unwrap_or_default().chars().count() + 1;
    let rest = text.get(start..).unwrap_or_default();
    (line, column, rest.lines().next().unwrap_or_default())
}
