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
mod ram;
mod vehicle;
mod votes;
mod watchdog;

/// Logger that discards all lines, but formats them, so that a panic in a log line makes a test fail.
#[defmt::global_logger]
struct Logger;

// SAFETY: nothing is written, so writes can not overlap.
unsafe impl defmt::Logger for Logger {
    fn acquire() {}
    unsafe fn flush() {}
    unsafe fn release() {}
    unsafe fn write(_: &[u8]) {}
}
