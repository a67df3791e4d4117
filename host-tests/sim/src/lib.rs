//! A chain of relays on a virtual clock: scenario files, the simulator that runs the on-board code, what came of a run as text, JSON
//! and pictures.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`scenario`] | a scenario file, read and checked |
//! | [`mission`] | from a scenario to the mission that relays fly |
//! | [`scene`], [`hypothetical`] | several interferers whose powers add up, and the one that stands for them |
//! | [`simulator`] | relays, links, faults and attackers on a virtual clock |
//! | [`report`] | what came of a run, as text and JSON |
//! | [`svg`] | the same as a picture |
//! | [`beta`] | random interference powers |
//! | [`command`] | what the commands have in common |

pub mod beta;
pub mod hypothetical;
pub mod mission;
pub mod report;
pub mod scenario;
pub mod scene;
pub mod simulator;
pub mod svg;

pub use uav_relay_command as command;
