//! Reports of runs and plans, as text and JSON.

pub mod air;
pub mod all_interferers;
pub mod attack;
pub mod availability;
pub mod chain;
mod drones;
mod failure;
pub mod final_mission;
pub mod hops;
pub mod recovery;
pub mod remaining;
pub mod sensing;
pub mod silences;
pub mod timeline;

pub use air::AirReport;
pub use all_interferers::AllInterferersReport;
pub use attack::AttackReport;
pub use chain::ChainReport;
pub use final_mission::flown;
pub use hops::{RelayReport, db, hop_sirs, hops_table, relays};
pub use sensing::SensingReport;
