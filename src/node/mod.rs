//! The protocol of one relay, on messages and without bytes: what it does with a message, and with silence.
//!
//! Five layers, each a machine of its own beside its state table, with the same verbs: `handle` takes a message, `take_...` gives what
//! there is to send, `handle_timeout` and `next_timeout` keep the time. None knows another: each is handed a `context` and gives back
//! effects, which `dispatch` passes on.
//!
//! | layer | one idea |
//! | --- | --- |
//! | `neighbour` | which node is taken for the neighbour on each side, and when it counts as lost |
//! | `view` | the view change: how the chain comes to a new view of who is in it |
//! | `lease` | how long what was agreed on may be held |
//! | `mission_update` | a newer mission, in flight |
//! | `round` | a round of agreement: sweeps, gatherings of the joint method, turns |
//!
//! | above the layers | |
//! | --- | --- |
//! | `dispatch` | [`Node`], which holds the layers: a relay as its facade sees it. Begin there, with `incoming` |
//! | `duplicate` | another node with this relay's number, and which of the two becomes passive |
//! | `steering` | the setpoint on its way to the agreed place |
//!
//! | below the layers | |
//! | --- | --- |
//! | `context` | what a relay is and flies, as every layer is handed it, and what a layer asks of the others |
//! | `circulation` | a message along the chain and the reply with its result: stages, duplicates, retransmission |
//! | `numbering` | what a number that is not the expected one means |
//! | `timing` | what the layers have in common in keeping time |
//! | [`sample`] | the interference that a relay measures |
//!
//! A message is answered by setting flags, and what is sent is built from the state when it is asked for, so nothing queues up and a
//! message sent twice is harmless.

mod circulation;
pub(crate) mod context;
mod dispatch;
pub(crate) mod duplicate;
mod lease;
pub(crate) mod mission_update;
pub(crate) mod neighbour;
mod numbering;
pub(crate) mod round;
pub(crate) mod sample;
mod steering;
mod timing;
pub(crate) mod view;

pub(crate) use dispatch::Node;
