//! From a scenario to the configuration block that is written to one drone.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the block, byte by byte; a crate of its own, as the firmware has it |
//! | [`course`] | the line on earth that its sites make; the firmware's own file |
//! | [`key`] | the network's key, from a file; the Linux companion's own file |
//! | [`block`] | from a scenario to the block of one drone |

pub mod block;
#[path = "../../../../examples/stm32f405/course.rs"]
pub mod course;
#[path = "../../../../examples/linux_companion/key.rs"]
pub mod key;

pub use uav_relay_block as config;
