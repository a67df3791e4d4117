//! What the fuzz targets do, as plain functions: a plain test runs them too, on the corpora and on random bytes.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`deframe()`] | a stream is cut into the same frames however it comes |
//! | [`frame()`] | what can be read is written the same |
//! | [`relay()`] | one relay under anything that may come |
//! | [`chain()`] | a chain on bad links: safe at any time, and in agreement once they are good |
//! | [`scenario()`] | any text as a scenario file |
//! | [`mavlink()`] | any bytes from an autopilot, and any orders to the link to it |
//! | [`watch`] | what a relay promises, looked at after every input |
//! | [`message`] | frames of mad neighbours |
//! | [`member`] | the same, signed with the network's key |
//! | [`setting`] | a mission and settings from bytes |
//! | [`input`] | numbers and choices from bytes |
//! | [`cobs`] | COBS by a published encoder, and back by its definition |
//! | [`heap`] | that the crate never asks for memory |
//!
//! Every function takes any bytes, panics where something promised does not hold, and else gives nothing.

pub mod chain;
pub mod cobs;
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

/// A target: its name, which is that of its corpus too, and what it does with an input.
pub type Target = (&'static str, fn(&[u8]));

/// Every target.
pub const TARGETS: [Target; 6] = [
    ("deframe", deframe),
    ("frame", frame),
    ("relay", relay),
    ("chain", chain),
    ("scenario", scenario),
    ("mavlink", mavlink),
];
