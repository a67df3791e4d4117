//! What is wrong with a scenario file, as one line for people.

use core::fmt;

use toml::Value;

use crate::endpoint::EndpointError;

/// Longest piece of a value that is quoted, in characters: enough to recognise it by.
const QUOTED: usize = 60;

/// A mistake in a scenario file; displayed as exactly one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioError {
    /// The file as the user named it.
    pub file: String,
    /// Where in the file: a key such as `relay[1].index`, or a line and column; none if the whole file is at fault.
    pub key: Option<String>,
    /// The offending value as TOML (cut short when long); none where there is none.
    pub value: Option<String>,
    /// The kind of mistake.
    pub problem: Problem,
    /// What would be right: a range with its unit, or the keys of that table.
    pub allowed: String,
}

/// The kinds of mistakes a scenario file can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Problem {
    /// There is no such file.
    NoSuchFile,
    /// The name is that of a directory.
    Directory,
    /// The system refused to read the file.
    Unreadable(std::io::ErrorKind),
    /// The file is longer than any scenario.
    TooLong,
    /// The file is not UTF-8 text.
    NotUtf8,
    /// The file holds nothing but blanks and comments.
    Empty,
    /// The file is not TOML.
    Syntax,
    /// The table has no such key.
    UnknownKey,
    /// A key that has no default is absent.
    Missing,
    /// Two keys say the same.
    SaidTwice,
    /// A place on earth is no place on a line that is not.
    NoSite,
    /// The text is none of those that are known.
    UnknownChoice,
    /// The text begins like a UDP address and is none.
    NoEndpoint(EndpointError),
    /// There are more or fewer entries than another key says.
    OtherNumber,
    /// A table stands where a list of tables does.
    NoList,
    /// A list of tables stands where a table does.
    NoTable,
    /// The value is of another type.
    WrongType,
    /// The value is outside its range, NaN or infinite.
    OutOfRange,
    /// The list needs at least one entry.
    EmptyList,
    /// `[field]` and `[[interferer]]` are both given.
    TwoInterferences,
    /// Neither `[field]` nor `[[interferer]]` is given.
    NoInterference,
    /// A relay is described twice.
    DuplicateRelay,
    /// A relay is described, but nothing about it differs.
    NothingDiffers,
    /// The distance is not that of the sites.
    OtherDistance,
    /// The places are not in order.
    Unsorted,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NoSuchFile => "no such file",
            Self::Directory => "is a directory",
            Self::Unreadable(kind) => return write!(f, "cannot be read ({kind})"),
            Self::TooLong => "is too long",
            Self::NotUtf8 => "is not UTF-8 text",
            Self::Empty => "is empty",
            Self::Syntax => "is not valid TOML",
            Self::UnknownKey => "is not a known key",
            Self::Missing => "is missing",
            Self::SaidTwice => "says the same twice",
            Self::NoSite => "needs [site]",
            Self::UnknownChoice => "is not known",
            Self::NoEndpoint(error) => return error.fmt(f),
            Self::OtherNumber => "contradicts plan.uavs",
            Self::NoList => "is one table, and may be several",
            Self::NoTable => "is a list, and there is only one",
            Self::WrongType => "has the wrong type",
            Self::OutOfRange => "is out of range",
            Self::EmptyList => "has no entry",
            Self::TwoInterferences => "contradicts [[interferer]]",
            Self::NoInterference => "is missing, and so is field",
            Self::DuplicateRelay => "is taken",
            Self::NothingDiffers => "changes nothing",
            Self::OtherDistance => "contradicts [site]",
            Self::Unsorted => "is not in increasing order",
        })
    }
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            file,
            problem,
            allowed,
            ..
        } = self;
        let what = match (&self.key, &self.value) {
            (Some(key), Some(value)) => format!("{key} = {value} "),
            (Some(part), None) | (None, Some(part)) => format!("{part} "),
            (None, None) => String::new(),
        };
        let line = format!("{file}: {what}{problem}; allowed: {allowed}");
        f.write_str(&one_line(&line))
    }
}

impl std::error::Error for ScenarioError {}

/// Escapes whatever a terminal or a log reader could take for the end of the line.
fn one_line(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if c.is_control() || matches!(c, '\u{2028}' | '\u{2029}') {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
    }
    out
}

/// A value as the file could have it, cut short when long.
pub(super) fn quote(value: &Value) -> String {
    cut(&value.to_string())
}

/// The start of a text, with an ellipsis where something was left out.
pub(super) fn cut(text: &str) -> String {
    match text.char_indices().nth(QUOTED) {
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}
