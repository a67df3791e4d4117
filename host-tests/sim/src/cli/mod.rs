//! `cargo chain` without its file and terminal access; the browser page runs the same code.
//!
//! | step | item |
//! | --- | --- |
//! | parse the options | [`Options`] |
//! | prepare a run from a scenario and options | [`Prepared::new`] |
//! | run the chain | [`Prepared::fly`] |
//! | report and draw the outcome | [`Prepared::report`], [`Prepared::traffic`], [`Prepared::picture`] |

mod data;
mod hostile;
mod options;
mod prepared;
mod rotation;
mod time;
mod upload;
mod web;

pub use options::{Method, Options};
pub use prepared::{Prepared, Refused};
pub use web::Web;
