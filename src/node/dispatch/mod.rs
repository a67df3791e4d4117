//! What a relay does with what happens to it: each message, each timer and each effect of a layer goes to the layer that it is for.
//!
//! [`Node`] is one struct; each of the files below [`state`] has what it does on one occasion.
//!
//! | file | one idea |
//! | --- | --- |
//! | `state` | all that a relay holds, the five layers, and how the effects of one layer come to the others; links that a part without a quorum gives up |
//! | `incoming` | a message comes: is it for this relay, of its mission and view, and which layer takes it; what a decision and a tag mean |
//! | `outgoing` | the next message, what is due at a time, and the setpoint |
//! | `hellos` | hellos: the ones that are owed, and who is taken for the neighbour by one that comes |
//! | `offers` | newer missions between neighbours, and with the ground |
//! | `identity` | another node under this relay's number, and claims to it |

mod hellos;
mod identity;
mod incoming;
#[cfg(feature = "upload")]
mod offers;
mod outgoing;
mod state;

#[cfg(feature = "upload")]
#[cfg(test)]
mod tests;

pub(crate) use state::Node;
