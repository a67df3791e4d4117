//! `cargo chain` without its files and its terminal: options, what they make of a run, and what is reported of it. The page runs the same.
//!
//! | step | by |
//! | --- | --- |
//! | options are read | [`Options`] |
//! | a scenario and they make a run | [`Prepared::new`] |
//! | the chain flies | [`Prepared::fly`] |
//! | what came of it is told, and drawn | [`Prepared::report`], [`Prepared::picture`] |

mod air;
mod flight;
mod hostile;
mod listening;
mod options;
mod prepared;
mod said;
mod times;
mod upload;

pub use options::{Method, Options};
pub use prepared::{Prepared, Refused};
