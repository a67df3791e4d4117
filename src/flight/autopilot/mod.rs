//! A PX4 or ArduCopter over a serial port: it is told where to fly, and tells where it is. Sans-IO.
//!
//! | file | one idea |
//! | --- | --- |
//! | `link` | the link: bytes, setpoints and the time in; frames, places and events out; what it and the relay hand each other in one turn |
//! | [`state`] | who flies: the table of states; flight modes, why the drone was released, why it cannot be engaged |
//! | `vehicle` | the autopilot: PX4 or ArduCopter, what it has said of itself, how late its link is, its clock; a drone far from its line |
//! | [`carrot`] | the target on its way to the setpoint, and how often it is told |
//! | `streams` | the messages that it is asked for |
//! | `clearance` | the operator's command to clear lost relays |
//! | `report` | what the operator reads, and events that the firmware is told of |
//! | [`trust`] | whom it believes: signatures |
//!
//! It never arms, takes off, lands or changes the mode. What it sends as a target is finite and near the mission's line.

pub mod carrot;
mod clearance;
mod link;
mod report;
pub mod state;
mod streams;
pub mod trust;
mod vehicle;

pub use link::Autopilot;
pub use report::{AutopilotEvent, RelayNumbers};
pub use state::{FlightMode, Release, ReleaseCause, WaitReason};
pub use vehicle::{Kind, OffLine, Position};

pub use super::mavlink::frame::Address;
pub use super::mavlink::incoming::Counters;
pub use super::mavlink::outgoing::FrameBytes;
#[cfg(feature = "mavlink-signing")]
pub use super::mavlink::signing::{Flaw, Signing, Stamp};
