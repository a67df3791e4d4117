//! Tests of one relay: received messages, and its replies and events.

mod fixture;
mod offers;
mod telling;
