//! Reports of runs and plans, as text and JSON.

pub mod against;
pub mod air;
pub mod attack;
pub mod chain;
mod drones;
mod failure;
pub mod flown;
pub mod hops;
pub mod left;
pub mod listened;
pub mod recovery;
pub mod silences;
pub mod timeline;
pub mod watched;

pub use against::AgainstAll;
pub use air::AirReport;
pub use attack::AttackReport;
pub use chain::ChainReport;
pub use flown::flown;
pub use hops::{RelayReport, db, hop_sirs, hops_table, relays};
pub use listened::ListenedReport;
