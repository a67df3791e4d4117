//! A chain of relays on a virtual clock: every relay runs the on-board code, every byte goes through a simulated link.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`link`] | one direction of a serial link: baud rate, latency |
//! | [`faults`] | what may happen to a frame on its way |
//! | [`attack`], [`forge`] | what an attacker does, and the frames it makes up |
//! | [`queue`] | what happens when, in order |
//! | [`setup`], [`outcome`] | what a chain is run with, and what came of it |
//! | [`drones`] | drones that fly straight to where they are told |
//! | [`chain`] | the relays, connected, run until they hold their places |

pub mod attack;
pub mod chain;
pub mod drones;
pub mod faults;
pub mod forge;
pub mod link;
pub mod outcome;
pub mod queue;
pub mod setup;
