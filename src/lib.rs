#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("tour.md")]
// The tests of this workspace use more of the crate (`internals`), and a missing feature leaves out what uses an item: only a build with
// all features can tell that an item is unused.
#![cfg_attr(
    not(all(feature = "internals", feature = "upload", feature = "mavlink-signing")),
    allow(
        dead_code,
        unused_imports,
        unreachable_pub,
        clippy::trivially_copy_pass_by_ref
    )
)]

#[macro_use]
mod error_text;

#[cfg(feature = "async")]
pub mod asynch;
pub mod channel;
mod channel_load;
#[cfg(doc)]
pub mod docs;
mod event;
pub mod field;
#[cfg(feature = "flight")]
pub mod flight;
mod geodetic;
#[cfg(feature = "upload")]
pub mod ground;
#[cfg(not(feature = "internals"))]
mod guard;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod guard;
#[cfg(feature = "defmt")]
mod log_text;
pub mod mission;
mod node;
#[cfg(not(feature = "internals"))]
mod optimiser;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod optimiser;
#[cfg(not(feature = "internals"))]
mod place;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod place;
pub mod planning;
pub mod pointing;
#[cfg(not(feature = "internals"))]
mod power_ratio;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod power_ratio;
mod relay;
mod root;
pub mod sensing;
pub mod serial;
mod settings;
mod side;
#[cfg(not(feature = "internals"))]
mod sir;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod sir;
mod stats;
#[cfg(feature = "telemetry")]
mod telemetry;
pub mod time;
mod view;
#[cfg(not(feature = "internals"))]
mod wire;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod wire;

pub use without_quorum::WithoutQuorum;
mod without_quorum;

pub use channel::Channel;
pub use channel_load::{ChannelFull, ChannelLoad};
pub use event::Event;
pub use field::{Field, FieldPoint};
pub use geodetic::{Geodetic, LineError, Sites};
#[cfg(feature = "upload")]
pub use ground::{FlownMission, Ground, Progress};
pub use guard::HoldReason;
pub use guard::config::{Geofence, GuardConfig};
pub use mission::{Band, Interference, Interferer, Mission, MissionConfig, Profile};
#[cfg(feature = "departures")]
pub use node::departure::Departure;
pub use node::round::state::Phase;
pub use node::sample::Sample;
pub use node::view::record::{RecordError, ViewRecord};
pub use optimiser::joint::fitted::SlotShares;
pub use optimiser::local::Local;
pub use optimiser::search::Schedule;
pub use place::Placement;
pub use relay::{Port, Relay, Transmit};
pub use sensing::Listen;
pub use settings::{Adjust, Identity, Measure, Method, Settings, SetupError, Wiring};
#[cfg(feature = "internals")]
#[doc(hidden)]
pub use side::Heading;
pub use side::Side;
pub use stats::Stats;
#[cfg(feature = "telemetry")]
pub use telemetry::Report;
pub use time::{Duration, Instant};
pub use view::{View, ViewId};
pub use wire::CRC_32C;
pub use wire::auth::Auth;
#[cfg(feature = "auth")]
pub use wire::auth::Key;
pub use wire::digest::MissionId;
pub use wire::frame::MAX_FRAME;
#[cfg(feature = "upload")]
pub use wire::upload::{Upload, UploadError};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
