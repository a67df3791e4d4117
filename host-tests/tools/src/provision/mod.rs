//! From a scenario to the configuration block that is written to one drone.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`config`] | the block, byte by byte; the firmware's own files |
//! | [`course`] | the line on earth that its sites make; the firmware's own file |
//! | [`key`] | the network's key, from a file; the Linux companion's own file |
//! | [`block`] | from a scenario to the block of one drone |

pub mod block;
#[path = "../../../../examples/stm32f405/config/mod.rs"]
pub mod config;
#[path = "../../../../examples/stm32f405/course.rs"]
pub mod course;
#[path = "../../../../examples/linux_companion/key.rs"]
pub mod key;
