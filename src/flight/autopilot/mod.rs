//! Link to a PX4 or ArduCopter over a serial port: sends targets, receives positions, does no I/O.
//!
//! | file | content |
//! | --- | --- |
//! | `link` | the link: bytes, setpoints and time in; frames, positions and events out; exchange with the relay |
//! | [`state`] | control states and their table; flight modes, causes of a release, reasons to wait |
//! | `vehicle` | the autopilot: its kind and its reports; delay and clock of the link; a drone far from the line Tx to Rx |
//! | [`carrot`] | motion of the target to the setpoint, and its repetition |
//! | `streams` | requests for messages of the autopilot |
//! | `clearance` | the operator's command that reports lost relays as landed |
//! | `report` | texts and numbers for the operator, events for the firmware |
//! | [`trust`] | signatures |
//!
//! The link never arms, takes off, lands or changes the mode. Every target is finite and near the line Tx to Rx.

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
