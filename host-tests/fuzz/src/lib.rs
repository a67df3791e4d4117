//! Fuzz targets as plain functions. A plain test also runs them, on the corpora and on random bytes.
//!
//! | file | content |
//! | --- | --- |
//! | [`deframe()`] | a stream is split into the same frames however it arrives |
//! | [`frame()`] | a decoded frame is encoded identically |
//! | [`relay()`] | one relay with arbitrary inputs |
//! | [`chain()`] | a chain on faulty links: always safe, and in agreement after the faults |
//! | [`scenario()`] | any text as a scenario file |
//! | [`mavlink()`] | arbitrary bytes from an autopilot, and arbitrary calls of its link |
//! | [`watch`] | checks of a relay's promises after every input |
//! | [`message`] | frames with arbitrary content |
//! | [`member`] | frames signed with the network's key |
//! | [`setting`] | missions and settings from bytes |
//! | [`input`] | numbers and choices from bytes |
//! | [`heap`] | check that the crate never allocates |
//!
//! Every target accepts any bytes, and panics if a rule is broken.

pub mod chain;
pub mod counted;
pub mod deframe;
pub mod frame;
pub mod heap;
pub mod input;
pub mod mavlink;
pub mod member;
pub mod message;
pub mod relay;
pub mod scenario;
pub mod setting;
pub mod watch;

pub use chain::chain;
pub use deframe::deframe;
pub use frame::frame;
pub use mavlink::mavlink;
pub use relay::relay;
pub use scenario::scenario;

/// Fuzz target: its name, which is also that of its corpus (collection of inputs), and its function.
pub type Target = (&'static str, fn(&[u8]));

/// List of all fuzz targets.
pub const TARGETS: [Target; 6] = [
    ("deframe", deframe),
    ("frame", frame),
    ("relay", relay),
    ("chain", chain),
    ("scenario", scenario),
    ("mavlink", mavlink),
];
