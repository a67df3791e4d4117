//! Shared code of the tests of uav-relay.
//!
//! | module | content |
//! | --- | --- |
//! | [`mod@bench`] | relays and ground stations in virtual time, whose frames a test can see, delay, change and drop |
//! | [`fixtures`], [`flights`] | missions, relays, and simulated flights that several tests use |
//! | [`ledger`] | random schedules of faults for simulated chains, and the judgement of their results |
//! | [`placing`] | comparison of the crate's positions with the f64 reference |
//! | [`mod@make`] | constructors of small values, such as positions |
//! | [`firmware`] | firmware images, their flash, and emulated drones |
//! | [`python`] | independent peers in Python |

// Empty on a microcontroller, where no tests run; for `cargo check --target thumbv7em-none-eabihf`.
#![cfg_attr(target_os = "none", no_std)]

#[cfg(not(target_os = "none"))]
pub mod bench;
#[cfg(not(target_os = "none"))]
pub mod firmware;
#[cfg(not(target_os = "none"))]
pub mod fixtures;
#[cfg(not(target_os = "none"))]
pub mod flights;
#[cfg(not(target_os = "none"))]
pub mod ledger;
#[cfg(not(target_os = "none"))]
pub mod make;
#[cfg(not(target_os = "none"))]
pub mod placing;
#[cfg(target_os = "linux")]
pub mod python;
