//! Pages on flying a chain, beside the reference of the modules.
//!
//! | page | what it answers |
//! | --- | --- |
//! | [`firmware`] | from an empty folder to a relay that flies: in a loop, by interrupts, with RTIC or Embassy |
//! | [`planning`] | how many relays, where, and whether that is the best there is |
//! | [`lost_relays`] | what happens when a relay falls silent, comes back, or the chain is split |
//! | [`uploads`] | how a flying chain is given a new mission |
//! | [`sensing`] | how the relays find an interferer, and follow it |
//! | [`flight`] | how a drone flies to its place, and who flies it |
//! | [`decisions`] | why the parts that surprise are as they are |
//! | [`security`] | what signed frames protect, and what not |
//! | [`wire_format`] | every byte on the wire, enough for another implementation |

#[doc = include_str!("firmware.md")]
pub mod firmware {}

#[doc = include_str!("planning.md")]
pub mod planning {}

#[doc = include_str!("lost_relays.md")]
pub mod lost_relays {}

#[doc = include_str!("uploads.md")]
pub mod uploads {}

#[doc = include_str!("sensing.md")]
pub mod sensing {}

#[cfg(feature = "flight")]
#[doc = include_str!("flight.md")]
pub mod flight {}

#[doc = include_str!("decisions.md")]
pub mod decisions {}

#[doc = include_str!("../../SECURITY.md")]
pub mod security {}

#[doc = include_str!("../wire/FORMAT.md")]
pub mod wire_format {}
