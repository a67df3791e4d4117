//! Errors in a scenario file, displayed as one line.

use core::fmt;

use toml::Value;

use crate::endpoint::EndpointError;

/// Largest number of characters of a quoted value in an error message.
const QUOTED: usize = 60;

/// A mistake in a scenario file; displayed as exactly one line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ScenarioError {
    /// Name of the scenario file, as given by the user.
    pub file: String,
    /// Location: a key such as `relay[1].index`, or a line and column. `None` if the mistake concerns the whole file.
    pub key: Option<String>,
    /// Wrong value as TOML, shortened if it is long; `None` if the mistake is not in a value.
    pub value: Option<String>,
    /// Kind of the mistake in the scenario file.
    pub problem: Problem,
    /// Allowed values, for the message: a range with its unit, or the keys that the table may have.
    pub allowed: String,
}

/// Kind of mistake in a scenario file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Problem {
    /// The scenario file does not exist.
    NoSuchFile,
    /// The path names a directory instead of a file.
    Directory,
    /// The operating system refused to read the file, with this error.
    Unreadable(std::io::ErrorKind),
    /// The scenario file exceeds the limit of 1 MiB.
    TooLong,
    /// The scenario file is not UTF-8 text.
    NotUtf8,
    /// The scenario file contains only blanks and comments.
    Empty,
    /// The scenario file is not valid TOML.
    Syntax,
    /// A table of the scenario file has an unknown key.
    UnknownKey,
    /// A table of the scenario file lacks a required key.
    Missing,
    /// Two keys that exclude each other are both given, such as a power in W and in dBm.
    SaidTwice,
    /// A position in latitude and longitude is given, but the table `[site]` that it needs is missing.
    NoSite,
    /// The value of a key is a text that is none of the allowed texts.
    UnknownChoice,
    /// The UDP address of an autopilot is malformed.
    NoEndpoint(EndpointError),
    /// The number of positions in `[plan]`, or of relays in the chain, differs from `plan.uavs`.
    OtherNumber,
    /// The relays have spares, but a port to each neighbour instead of one shared channel.
    NeedsChannel,
    /// The relays have spares, but some of them have an altitude or power of their own.
    RelaysDiffer,
    /// The file has a single table where a list of tables is required.
    NoList,
    /// The file has a list of tables where a single table is required.
    NoTable,
    /// The value of a key has the wrong type.
    WrongType,
    /// The value of a key is outside its range, is NaN or infinite, or is an empty text.
    OutOfRange,
    /// The value of a key is an empty list, although it needs at least one entry.
    EmptyList,
    /// `[field]` and `[[interferer]]` are both given, although they exclude each other.
    TwoInterferences,
    /// `[listen]` and `[field]` are both given: a random field has no interferer to locate.
    MeasuredField,
    /// Neither `[field]` nor `[[interferer]]` is given.
    NoInterference,
    /// Two `[[relay]]` tables have the same index.
    DuplicateRelay,
    /// A `[[relay]]` table is useless, because it states neither an altitude nor a power.
    NothingDiffers,
    /// The distance from Tx to Rx in the file differs from the distance between their geographic positions.
    OtherDistance,
    /// The values of a list are not in increasing order.
    Unsorted,
    /// The area of an interferer contains Tx or Rx.
    ContainsSite,
    /// A range of powers is given for an interferer without an area.
    NeedsArea,
    /// The boundary of an area crosses itself, or encloses no surface.
    NoArea,
    /// The bandwidths in `[link]` and in `[noise]` differ.
    OtherBandwidth,
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
            Self::SaidTwice | Self::TwoInterferences | Self::MeasuredField => "is not allowed",
            Self::NoSite => "needs [site]",
            Self::UnknownChoice => "is not known",
            Self::NoEndpoint(error) => return error.fmt(f),
            Self::OtherNumber => "contradicts plan.uavs",
            Self::NeedsChannel => "needs a shared channel",
            Self::RelaysDiffer => "contradicts [[relay]]",
            Self::NoList => "is a table, and must be a list of tables",
            Self::NoTable => "is a list of tables, and must be a single table",
            Self::WrongType => "has the wrong type",
            Self::OutOfRange => "is out of range",
            Self::EmptyList => "has no entry",
            Self::NoInterference => "and field are both missing, so there is no interference",
            Self::DuplicateRelay => "is already used",
            Self::NothingDiffers => "has no effect by itself",
            Self::OtherDistance => "contradicts [site]",
            Self::OtherBandwidth => "contradicts noise.bandwidth_hz",
            Self::ContainsSite => "contains a site",
            Self::NeedsArea => "needs an area",
            Self::NoArea => "is not a valid area",
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
        let word = match problem {
            Problem::NoSuchFile | Problem::Directory | Problem::Unreadable(_) => "give",
            _ => "allowed:",
        };
        let line = format!("{file}: {what}{problem}; {word} {allowed}");
        f.write_str(&one_line(&line))
    }
}

impl std::error::Error for ScenarioError {}

/// Escapes line ends and control characters, so that the text stays one line in a terminal or log.
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

pub(super) fn quote(value: &Value) -> String {
    cut(&value.to_string())
}

pub(super) fn cut(text: &str) -> String {
    match text.char_indices().nth(QUOTED) {
        Some((end, _)) => format!("{}...", text.get(..end).unwrap_or_default()),
        None => text.to_owned(),
    }
}
