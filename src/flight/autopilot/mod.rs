//! A PX4 or ArduCopter over a serial port: it is told where to fly, and tells where it is. Sans-IO.
//!
//! | file | one idea |
//! | --- | --- |
//! | `link` | the link: bytes, setpoints and the time in; frames, places and events out |
//! | [`state`] | who flies: the table of states |
//! | `kind` | whose autopilot it is: PX4 or ArduCopter |
//! | `vehicle` | what the autopilot has said of itself, and what its radio hears |
//! | `clock` | the autopilot's clock, on the relay's; the relay's own |
//! | `echo` | how late the link is |
//! | `mode` | flight modes, why the drone was released, why it cannot be engaged|
//! | `event` | events that the firmware is told of |
//! | `exchange` | what the link and the relay hand each other in one turn |
//! | `streams` | the messages that it is asked for |
//! | `target` | what it is told to fly to, and how often |
//! | [`carrot`] | the target on its way to the setpoint |
//! | `astray` | a drone that is far from its line |
//! | `clearance` | the operator's command to clear lost relays |
//! | `report` | what the operator reads |
//! | [`trust`] | whom it believes: signatures |
//!
//! It never arms, takes off, lands or changes the mode. What it sends as a target is finite and near the mission's line.

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
