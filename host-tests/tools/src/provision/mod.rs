//! From a scenario to the configuration block that is written to one drone.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the block, byte by byte; a crate of its own, as the firmware has it |
//! | [`block`] | from a scenario to the block of one drone |
//! | [`firmware`] | what the firmware can be told of the section `[network]` |
//! | [`folder`] | the blocks of a whole flight: all of them, or none |
//! | [`summary`] | what is in that folder, and what to type |

pub mod block;
pub mod firmware;
pub mod folder;
pub mod summary;

pub use uav_relay_block as config;
