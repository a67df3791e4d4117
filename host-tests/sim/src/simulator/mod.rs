//! A chain of relays on a virtual clock: every relay runs the on-board code, every byte goes through a simulated link.
//!
//! | file | one idea |
//! | --- | --- |
//! | [`link`] | one direction of a serial link: baud rate, latency |
//! | [`medium`] | one half-duplex radio channel that all share |
//! | [`faults`], [`bursts`] | what may happen to a frame on its way; losses in runs |
//! | [`deaf`] | a relay that does not hear another one |
//! | [`attack`], [`forge`] | what an attacker does, and the frames it makes up |
//! | [`queue`] | what happens when, in order |
//! | [`film`] | what a run looks like from outside, change by change |
//! | [`record`] | the frames that were put on the air, for a capture |
//! | [`setup`], [`outcome`] | what a chain is run with, and what came of it |
//! | [`sky`] | interferers that nobody told the relays of |
//! | [`drones`] | drones that fly to where they are told, and know where they are only nearly |
//! | [`fleet`] | drones with an autopilot each, and their pilots |
//! | [`flying`] | groups of relays with an agreement of their own |
//! | [`longest`] | which relays can be in one chain |
//! | [`optima`], [`optimum`] | where exactly these relays would be if nothing had happened |
//! | [`watch`] | how much of the time the chain is right |
//! | [`many`] | the same run with many seeds |
//! | [`chain`] | the relays, connected, run until they hold their places |

pub mod attack;
pub mod bursts;
pub mod chain;
pub mod deaf;
pub mod drones;
pub mod faults;
pub mod film;
pub mod fleet;
pub mod flying;
pub mod forge;
pub mod link;
pub mod longest;
pub mod many;
pub mod medium;
pub mod optima;
pub mod optimum;
pub mod outcome;
pub mod queue;
pub mod record;
pub mod setup;
pub mod sky;
pub mod watch;
