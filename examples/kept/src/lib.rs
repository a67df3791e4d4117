//! State of a relay that survives a reboot, in two flash sectors for each kind; for any board.
//!
//! | file | content |
//! | --- | --- |
//! | [`journal`] | journal in two sectors of flash, used by the others |
//! | [`epoch`] | epoch, a number that increases at every start |
//! | [`views`] | the relay's votes on views |
//! | [`nor`] | flash sectors through the traits of `embedded-storage` |
#![no_std]
#![forbid(unsafe_code)]

pub mod epoch;
pub mod journal;
pub mod nor;
pub mod views;
