//! Simulated relay chain on a virtual clock: on-board code and simulated links.
//!
//! | file | contents |
//! | --- | --- |
//! | [`medium`] | one half-duplex radio channel shared by all nodes |
//! | [`faults`] | one direction of a serial link: baud rate, latency, frame faults, bursts of losses, failures |
//! | [`attack`] | the attacker, and the frames that it forges |
//! | [`setup`] | inputs of a run |
//! | [`outcome`] | results of a run, with its film for an animation and its frames for a capture file |
//! | [`true_interference`] | interferers that the relays must find by measuring |
//! | [`drones`] | simple drone dynamics with position errors |
//! | [`fleet`] | drones with simulated autopilots and pilots |
//! | [`rotation`] | a fleet larger than its chain: batteries, pilots, chargers, and what a run with replacements has shown |
//! | [`observed`] | states of the relays for the statistics of a run, and groups that fly by one agreement |
//! | [`route`] | the hops of the data through the chain over time: true rates and time slots |
//! | [`traffic`] | packets on that route, with a queue at every node |
//! | [`watch`] | availability of the chain over time, against the longest possible chain and its best positions |
//! | [`chain`] | the event loop that connects the relays; the same run with many seeds |

pub mod attack;
pub mod chain;
pub mod drones;
pub mod faults;
pub mod fleet;
pub mod medium;
pub mod observed;
pub mod outcome;
pub mod rotation;
pub mod route;
pub mod setup;
pub mod traffic;
pub mod true_interference;
pub mod watch;
