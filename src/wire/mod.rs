//! Wire format: [`deframe`] splits the byte stream and decodes COBS, [`frame`] has addresses and the CRC, [`message`] the
//! messages, [`digest`] the digest of a mission, [`auth`] the authentication, `endpoint` one node's frames, `upload` uploaded missions,
//! [`node_number`] the range of node numbers. `FORMAT.md` in this folder has byte tables and examples.

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
