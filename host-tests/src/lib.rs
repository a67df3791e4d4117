//! Shared code of the tests of uav-relay.

// Empty on a microcontroller, where no tests run, for `cargo check --target thumbv7em-none-eabihf`.
#![cfg_attr(target_os = "none", no_std)]

#[cfg(not(target_os = "none"))]
pub mod firmware;
#[cfg(not(target_os = "none"))]
pub mod fixtures;
#[cfg(not(target_os = "none"))]
pub mod flights;
#[cfg(not(target_os = "none"))]
pub mod placing;
#[cfg(target_os = "linux")]
pub mod python;
