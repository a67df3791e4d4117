//! Errors of making a figure.

use std::fmt;

use uav_relay::SetupError;
use uav_relay::optimiser::search::Infeasible;

use super::draw::NotDrawn;
use uav_relay_scenario::mission::Refusal;

/// Error of making a figure. The numbers are fixed, so any error except `File` is a bug.
#[derive(Debug)]
#[non_exhaustive]
pub enum FigureError {
    /// The scenario is not a valid mission.
    Mission(Refusal),
    /// A relay rejects its settings.
    Setup(SetupError),
    /// The target cannot be met, or the simulated chain has not settled.
    Unsettled(&'static str),
    /// The chart could not be drawn.
    Drawing(NotDrawn),
    /// A table could not be written.
    Table(csv::Error),
    /// A table contains a number that is not finite.
    NotFinite(String),
    /// A file could not be written.
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
