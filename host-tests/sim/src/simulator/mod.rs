//! Simulated relay chain on a virtual clock: on-board code and simulated links.
//!
//! | file | contents |
//! | --- | --- |
//! | [`link`] | one direction of a serial link: baud rate, latency |
//! | [`medium`] | one half-duplex radio channel shared by all nodes |
//! | [`faults`], [`bursts`] | frame faults (loss, corruption, ...); bursts of losses |
//! | [`one_way`] | one-way link failures |
//! | [`attack`], [`forge`] | the attacker, and the frames that it forges |
//! | [`queue`] | the event queue |
//! | [`film`] | state changes and transmissions of the relays, for an animation |
//! | [`record`] | transmitted frames, for a capture file |
//! | [`setup`], [`outcome`] | inputs and results of a run |
//! | [`true_interference`] | interferers that the relays must find by measuring |
//! | [`drones`] | simple drone dynamics with position errors |
//! | [`fleet`] | drones with simulated autopilots and pilots |
//! | [`flying`] | groups of relays that hold an agreement |
//! | [`longest`] | longest possible chains of the relays that are on |
//! | [`optima`], [`optimum`] | reference positions from an undisturbed run |
//! | [`watch`] | availability of the chain over time |
//! | [`parallel`] | the same run with many seeds |
//! | [`chain`] | the event loop that connects the relays |

pub mod attack;
pub mod chain;
pub mod drones;
pub mod faults;
pub mod fleet;
pub mod medium;
pub mod outcome;
pub mod setup;
pub mod true_interference;
pub mod watch;
