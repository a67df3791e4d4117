//! Link to a PX4 or ArduCopter over a serial port: sends targets, receives positions. Sans-IO.
//!
//! | file | content |
//! | --- | --- |
//! | `link` | the link: bytes, setpoints and time in; frames, positions and events out |
//! | [`state`] | control states: the state table |
//! | `kind` | PX4 or ArduCopter |
//! | `vehicle` | reports of the autopilot, and the noise that its radio measures |
//! | `clock` | conversion between the clocks of autopilot and relay |
//! | `echo` | delay of the link |
//! | `mode` | flight modes, causes of a release, reasons to wait |
//! | `event` | events for the firmware |
//! | `exchange` | exchange between link and relay in one turn |
//! | `streams` | requests for messages |
//! | `target` | target of the autopilot, and its repetition |
//! | [`carrot`] | motion of the target to the setpoint |
//! | `astray` | a drone that is far from its line |
//! | `clearance` | the operator's command to clear lost relays |
//! | `report` | texts and numbers for the operator |
//! | [`trust`] | signatures |
//!
//! The link never arms, takes off, lands or changes the mode. Every target is finite and near the mission's line.

mod astray;
pub mod carrot;
mod clearance;
mod clock;
mod echo;
mod event;
mod exchange;
mod kind;
mod link;
mod mode;
mod report;
pub mod state;
mod streams;
mod target;
pub mod trust;
mod vehicle;

pub use astray::OffLine;
pub use event::{AutopilotEvent, RelayNumbers};
pub use kind::Kind;
pub use link::Autopilot;
pub use mode::{FlightMode, Release, ReleaseCause, WaitReason};
pub use vehicle::Position;

pub use super::mavlink::frame::Address;
pub use super::mavlink::incoming::Counters;
pub use super::mavlink::outgoing::FrameBytes;
#[cfg(feature = "mavlink-signing")]
pub use super::mavlink::signing::{Flaw, Signing, Stamp};
