//! Dispatch of messages, timers and effects to the layers.
//!
//! [`Node`] is one struct; each file has its methods for one purpose.
//!
//! | file | content |
//! | --- | --- |
//! | `state` | state of a relay, its layers, effects of one layer on the others, and search without a quorum |
//! | `incoming` | received messages: checks, choice of the layer, decisions on views, and results of handshakes |
//! | `outgoing` | next message, expired timers, and setpoint |
//! | `hellos` | pending hellos, and selection of the neighbour by received ones |
//! | `offers` | newer missions, exchanged with neighbours and with the ground |
//! | `identity` | duplicates of this relay's node number, and claims to it |

mod hellos;
mod identity;
mod incoming;
mod offers;
mod outgoing;
mod state;

#[cfg(all(test, feature = "upload"))]
mod tests;

pub(crate) use state::Node;
