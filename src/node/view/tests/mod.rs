//! Tests of the view change at one relay.

mod decisions;
mod leaders;
mod proposals;
mod relay;
