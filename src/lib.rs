#![no_std]
#![forbid(unsafe_code)]
#![doc = include_str!("tour.md")]
// Only a build with all features can tell that an item is unused: a missing feature leaves out code that uses the item.
// The tests of this workspace use more of the crate (`internals`).
#![cfg_attr(
    not(all(feature = "internals", feature = "upload", feature = "mavlink-signing")),
    allow(
        dead_code,
        unused_imports,
        unreachable_pub,
        clippy::trivially_copy_pass_by_ref
    )
)]

/// Implements `Display`, `Error` and `defmt::Format` for an error enum, from one text for each variant.
///
/// The texts are string literals, because `defmt` accepts nothing else. `defmt` stores only a number for each text in
/// the image. The function `text` returns the text; it is a `const fn`, so that a `const fn` that panics can use it.
macro_rules! error_texts {
    ($type:ty { $($variant:ident => $text:literal),* $(,)? }) => {
        impl $type {
            /// Returns the error's text: what is wrong, and the allowed range.
            pub(crate) const fn text(self) -> &'static str {
                match self {
                    $(Self::$variant => $text,)*
                }
            }
        }

        impl core::fmt::Display for $type {
            fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str(self.text())
            }
        }

        impl core::error::Error for $type {}

        #[cfg(feature = "defmt")]
        impl defmt::Format for $type {
            fn format(&self, f: defmt::Formatter<'_>) {
                let text = match *self {
                    $(Self::$variant => defmt::intern!($text),)*
                };
                defmt::write!(f, "{=istr}", text);
            }
        }
    };
}

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
pub mod pointing;
mod relay;
#[cfg(not(feature = "internals"))]
mod root;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod root;
mod sample;
pub mod sensing;
pub mod serial;
mod serial_number;
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

/// Features of this build. Each constant is true if the crate is built with the feature of that name.
///
/// Code that can only run with a feature that is not built in is compiled, but takes no flash.
mod features {
    pub(crate) const ADJUST: bool = cfg!(feature = "adjust");
    pub(crate) const ALTITUDE: bool = cfg!(feature = "altitude");
    pub(crate) const AUTH: bool = cfg!(feature = "auth");
    pub(crate) const DEPARTURES: bool = cfg!(feature = "departures");
    pub(crate) const FIELD: bool = cfg!(feature = "field");
    pub(crate) const GUARD: bool = cfg!(feature = "guard");
    pub(crate) const MAVLINK_SIGNING: bool = cfg!(feature = "mavlink-signing");
    pub(crate) const NOISE: bool = cfg!(feature = "noise");
    pub(crate) const REVERSE: bool = cfg!(feature = "reverse");
    pub(crate) const SENSING: bool = cfg!(feature = "sensing");
    pub(crate) const TELEMETRY: bool = cfg!(feature = "telemetry");
    pub(crate) const UPLOAD: bool = cfg!(feature = "upload");
}

pub use channel::Channel;
pub use channel_load::{ChannelFull, ChannelLoad};
pub use event::Event;
pub use field::{Field, FieldPoint};
pub use geodetic::{Geodetic, LineError, Sites};
pub use guard::HoldReason;
pub use guard::config::{Geofence, GuardConfig};
pub use mission::{Band, Interference, Interferer, Mission, MissionConfig, Profile};
#[cfg(feature = "departures")]
pub use node::departure::Departure;
pub use node::round::state::Phase;
pub use node::view::record::{RecordError, ViewRecord};
pub use optimiser::joint::fitted::SlotShares;
pub use optimiser::local::Local;
pub use optimiser::search::Schedule;
pub use place::{Placement, WithoutQuorum};
pub use relay::{Port, Relay, Transmit};
pub use sample::Sample;
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
pub use {
    ground::{FlownMission, Ground, Progress},
    wire::upload::{Upload, UploadError},
};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
