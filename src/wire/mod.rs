//! Bytes on the link: [`deframe`] cuts the byte stream at delimiters and undoes COBS, [`frame`] checks integrity and holds
//! the addresses, [`message`] is what neighbours say, [`digest`] how they tell missions apart, [`auth`] how they tell
//! members from others, `endpoint` which frames count and how a node signs its own, `upload` how a newer mission is told, [`node_number`] which nodes there can be. `FORMAT.md` beside this file has byte tables and examples.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

pub mod auth;
#[cfg(feature = "auth")]
mod blake2s;
pub mod crc;
pub mod deframe;
pub mod digest;
pub(crate) mod endpoint;
pub mod frame;
pub mod message;
pub mod node_number;
#[cfg(feature = "auth")]
pub(crate) mod session;
#[cfg(feature = "upload")]
pub mod upload;
