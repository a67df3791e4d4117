//! What the tests of uav-relay share.

// On a microcontroller there is nothing to run tests: `cargo check --target thumbv7em-none-eabihf` leaves this package empty.
#![cfg_attr(target_os = "none", no_std)]

#[cfg(not(target_os = "none"))]
pub mod firmware;
#[cfg(not(target_os = "none"))]
pub mod fixtures;
#[cfg(not(target_os = "none"))]
pub mod flights;
#[cfg(target_os = "linux")]
pub mod python;
