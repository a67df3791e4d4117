//! What a flashed relay keeps over a reboot, for any board: two sectors of flash for each.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`journal`] | the log in two sectors of flash that each of the others is in |
//! | [`epoch`] | the number that rises at every start |
//! | [`views`] | what the relay has said in the votes on views |
//! | [`nor`] | those sectors, by the traits of `embedded-storage` |
#![no_std]
#![forbid(unsafe_code)]

pub mod epoch;
pub mod journal;
pub mod nor;
pub mod views;
