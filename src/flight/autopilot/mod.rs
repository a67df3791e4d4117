//! Link to a PX4 or ArduCopter over a serial port: sends targets, receives positions. Sans-IO.
//!
//! | file | content |
//! | --- | --- |
//! | `link` | the link: bytes, setpoints and time in; frames, positions and events out; exchange with the relay in one turn |
//! | [`state`] | control states and their table; flight modes, causes of a release, reasons to wait |
//! | `vehicle` | the autopilot: its kind, its reports, delay and clock of the link, a drone far from its line |
//! | [`carrot`] | motion of the target to the setpoint, and its repetition |
//! | `streams` | requests for messages |
//! | `clearance` | the operator's command to clear lost relays |
//! | `report` | texts and numbers for the operator, events for the firmware |
//! | [`trust`] | signatures |
//!
//! The link never arms, takes off, lands or changes the mode. Every target is finite and near the mission's line.

pub mod carrot;
mod clearance;
mod link;
mod report;
pub mod state;
mod streams;
pub mod trust;
mod vehicle;

pub use link::Autopilot;
pub use report::AutopilotEvent;
pub use state::{FlightMode, Kind, Release, ReleaseCause, WaitReason};
pub use vehicle::{OffLine, Position};

pub use super::mavlink::frame::Address;
pub use super::mavlink::incoming::Counters;
#[cfg(feature = "mavlink-signing")]
pub use super::mavlink::signing::{Flaw, Signing, Stamp};
