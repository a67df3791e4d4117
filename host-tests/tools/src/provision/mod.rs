//! From a scenario to the configuration block that is written to one drone.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the block, byte by byte; the firmware's own file |
//! | [`key`] | the network's key, from a file; the Linux companion's own file |
//! | [`block`] | from a scenario to the block of one drone |

pub mod block;
#[path = "../../../../examples/stm32f405/config.rs"]
pub mod config;
#[path = "../../../../examples/linux_companion/key.rs"]
pub mod key;
