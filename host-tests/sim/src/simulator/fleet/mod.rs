//! Drones with simulated autopilots, connected to their relays by MAVLink.
//!
//! | file | contents |
//! | --- | --- |
//! | [`spec`] | flight parameters and pilots' actions |
//! | `frames` | MAVLink frames of the autopilot |
//! | `pilot` | take-off, hand-over, takeover |
//! | `vehicle` | one drone: dynamics, modes and messages |

mod frames;
mod pilot;
pub mod spec;
mod vehicle;

pub(super) use vehicle::Vehicle;
