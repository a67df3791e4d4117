//! Drones with an autopilot each, which the relay's link talks to in MAVLink.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`spec`] | how they fly, and what pilots do |
//! | `frames` | the bytes of an autopilot |
//! | `pilot` | take-off, handing over, taking over |
//! | `vehicle` | one drone: its body, its modes, what it says and what it does |

mod frames;
mod pilot;
pub mod spec;
mod vehicle;

pub(super) use vehicle::Vehicle;
