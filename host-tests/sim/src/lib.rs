//! A chain of relays on a virtual clock: the simulator that runs the on-board code, what came of a run as text, JSON
//! and pictures.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`simulator`] | relays, links, faults and attackers on a virtual clock |
//! | [`report`] | what came of a run, as text and JSON |
//! | [`svg`] | the same as a picture |
//! | [`beta`] | random interference powers |
//! | [`cli`] | `cargo chain` without its files and its terminal |
//! | [`command`] | what the commands have in common |

pub mod beta;
pub mod cli;
pub mod report;
pub mod simulator;
pub mod svg;

pub use uav_relay_command as command;
