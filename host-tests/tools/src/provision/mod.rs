//! Builds the configuration blocks of drones from a scenario.
//!
//! | file | content |
//! | --- | --- |
//! | [`config`] | block format, byte by byte: a separate crate, shared with the firmware |
//! | [`block`] | the block of one drone, and the check that the firmware supports section `[network]` |
//! | [`bundle`] | a folder for each drone and the ground station, if they have Linux computers |
//! | [`folder`] | the blocks of a whole flight: all of them, or none; with `summary.txt`, the commands to flash them |

pub mod block;
#[cfg(unix)]
pub mod bundle;
pub mod folder;

pub use uav_relay_block as config;
