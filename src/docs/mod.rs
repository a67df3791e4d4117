//! Guides for flying a chain.
//!
//! | page | content |
//! | --- | --- |
//! | [`firmware`] | from an empty folder to a flying relay: in a loop, by interrupts, with RTIC or Embassy |
//! | [`planning`] | number of relays, their positions, and whether the plan is proven optimal |
//! | [`link`] | both directions, data rates, and access to the radio |
//! | [`lost_relays`] | behaviour when a relay fails or comes back, or the chain is split |
//! | [`batteries`] | replacement of a drone whose battery runs low |
//! | [`uploads`] | new missions in flight |
//! | [`sensing`] | estimation and tracking of an unknown interferer |
//! | [`flight`] | control of the drone through its autopilot |
//! | [`decisions`] | reasons of unusual design decisions |
//! | [`security`] | protection by signed frames, and its limits |
//! | [`protocol`] | rules and times: departures, lost neighbours, two nodes with one number; continues `wire_format` |
//! | [`wire_format`] | specification of every byte on the wire |

#[doc = include_str!("firmware.md")]
pub mod firmware {}

#[doc = include_str!("planning.md")]
pub mod planning {}

#[doc = include_str!("link.md")]
pub mod link {}

#[doc = include_str!("lost_relays.md")]
pub mod lost_relays {}

#[doc = include_str!("batteries.md")]
pub mod batteries {}

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

#[doc = include_str!("protocol.md")]
pub mod protocol {}

#[doc = include_str!("../wire/FORMAT.md")]
pub mod wire_format {}
