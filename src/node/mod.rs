//! Protocol of one relay, in terms of messages and times, without bytes.
//!
//! Each of the five layers is a state machine with a state table and the same verbs: `handle` processes a message, `poll_...`
//! returns a pending message, `handle_timeout` and `next_timeout` handle timers. Layers do not call each other: each receives a `context`
//! and returns effects, which `dispatch` applies to the others.
//!
//! | layer | content |
//! | --- | --- |
//! | `neighbour` | selection of the neighbour on each side, and detection of its loss |
//! | `view` | view change: agreement on the members of the chain |
//! | `lease` | how long a relay knows that no later view has positions |
//! | `mission_update` | distribution of a newer mission in flight |
//! | `round` | rounds of agreement on positions: sweeps, profile collection, tokens, sensing |
//!
//! | above the layers | content |
//! | --- | --- |
//! | `dispatch` | [`Node`], which owns the layers, and is a relay as its facade sees it; `incoming` is a good start |
//! | `duplicate` | detection of another node with the same number, and the choice of the one that becomes passive |
//! | `steering` | setpoint on the way to the agreed position |
//! | `reports` | states of the relays, on their way to a ground station that watches; without the feature `telemetry` the file `forwarding.rs`, which only forwards them |
//!
//! | below the layers | content |
//! | --- | --- |
//! | `context` | state that every layer receives, the effects of a layer, and durations that several layers share |
//! | `circulation` | message along the chain and the reply with its result: stages, duplicates, retransmission, late numbers |
//! | [`measurement`] | measurements of a relay |
//!
//! A received message only sets flags, and a pending message is built from the state when it is polled. So there are no queues,
//! and duplicates are harmless.

mod circulation;
pub(crate) mod context;
mod dispatch;
pub(crate) mod duplicate;
mod lease;
pub(crate) mod measurement;
pub(crate) mod mission_update;
pub(crate) mod neighbour;
#[cfg_attr(not(feature = "telemetry"), path = "forwarding.rs")]
pub(crate) mod reports;
pub(crate) mod round;
mod steering;
pub(crate) mod view;

pub(crate) use dispatch::Node;
pub(crate) use dispatch::departure;
