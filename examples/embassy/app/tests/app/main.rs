//! Tests of the application on a PC: in-memory UARTs, a flash in RAM, and a mock clock.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "tests"
)]

mod autopilot;
mod bench;
mod key;
mod logger;
mod ram;
mod vehicle;
mod votes;
mod watchdog;
