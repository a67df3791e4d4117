//! What a relay does with what happens to it: each message, each timer and each effect of a layer goes to the layer that it is for.
//!
//! [`Node`] is one struct; each of the files below [`state`] has what it does on one occasion.
//!
//! | file | one idea |
//! | --- | --- |
//! | `layers` | the five layers, and the context that each is handed |
//! | `state` | all that a relay holds, and how the effects of one layer come to the others |
//! | `telemetry` | what the firmware is told |
//! | `sides` | on which side a node is |
//! | `incoming` | a message comes: is it for this relay, of its mission and view, and which layer takes it |
//! | `outgoing` | what is said next |
//! | `timeouts` | what has run out |
//! | `adrift` | a part without a quorum gives its links up |
//! | `hellos` | the hellos that are owed |
//! | `pairing` | a hello comes: who is taken for the neighbour |
//! | `decision` | a proposal is decided on: the new view, its mission |
//! | `offers` | newer missions between neighbours, and with the ground |
//! | `setpoint` | where to be, and where to fly now |
//! | `identity` | another node under this relay's number, and claims to it |
//! | `keys` | what tags say of a neighbour |

mod adrift;
mod decision;
mod hellos;
mod identity;
mod incoming;
#[cfg(feature = "auth")]
mod keys;
mod layers;
#[cfg(feature = "upload")]
mod offers;
mod outgoing;
mod pairing;
mod setpoint;
mod sides;
mod state;
mod telemetry;
mod timeouts;

#[cfg(feature = "upload")]
#[cfg(test)]
mod tests;

pub(crate) use state::Node;
