#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("tour.md")]

pub mod channel;
pub mod field;
pub mod gain;
#[cfg(feature = "upload")]
pub mod ground;
pub mod guard;
pub mod mission;
pub mod node;
pub mod placement;
pub mod pointing;
pub mod relay;
mod root;
pub mod serial;
pub mod sir;
pub mod time;
pub mod wire;

pub use channel::Channel;
pub use field::{Field, FieldPoint};
#[cfg(feature = "upload")]
pub use ground::{Ground, Progress};
pub use mission::{Band, Heading, Interference, Interferer, Mission, MissionConfig, Profile};
pub use node::Side;
pub use node::event::Event;
pub use node::exchange::Phase;
pub use node::sample::Sample;
pub use node::settings::{Adjust, Identity, Measure, Method, Settings, Wiring};
pub use node::stats::Stats;
pub use placement::local::Local;
pub use placement::search::Schedule;
pub use relay::{Port, Relay, Transmit};
pub use sir::Placement;
pub use time::{Duration, Instant};
#[cfg(feature = "auth")]
pub use wire::auth::{Auth, Key};
pub use wire::frame::FrameBuf;
#[cfg(feature = "upload")]
pub use wire::upload::Upload;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
