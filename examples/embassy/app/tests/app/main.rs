//! The application on a PC: in-memory UARTs, a flash in RAM, and a clock that stands until it is told to go on.
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
