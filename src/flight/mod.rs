//! From the agreed place to a flying drone: sites on earth, and the autopilot.
//!
//! | module | one idea |
//! | --- | --- |
//! | [`geodetic`] | a point on earth, in the integers that autopilots speak |
//! | [`axis`] | the line from transmitter to receiver on earth, and places along it |
//! | [`mavlink`] | the bytes that autopilots speak |
//! | [`autopilot`] | where to fly, who flies, and where the drone is |

pub mod autopilot;
pub mod axis;
pub mod geodetic;
pub mod mavlink;
