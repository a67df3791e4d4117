//! Simulator of a relay chain on a virtual clock: runs the on-board code and reports the outcome.
//!
//! | module | contents |
//! | --- | --- |
//! | [`simulator`] | relays, links, faults and attackers on a virtual clock |
//! | [`report`] | the outcome of a run, as text and JSON |
//! | [`svg`] | the outcome of a run, as a picture |
//! | [`live`] | a running chain on the screen of an operator |
//! | [`cli`] | `cargo chain` without its file and terminal access |
//! | [`command`] | code shared by all commands |

pub mod cli;
pub mod live;
pub mod report;
pub mod simulator;
pub mod svg;

pub use uav_relay_command as command;
