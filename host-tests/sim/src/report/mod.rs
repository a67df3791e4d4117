//! Reports of runs and plans, as text and JSON.

pub mod attack;
pub mod chain;
pub mod hops;
pub mod rotation;
pub mod sensing;
pub mod timeline;
pub mod traffic;

pub use attack::AttackReport;
pub use chain::{AirReport, AllInterferersReport, ChainReport, flown};
pub use hops::{
    HopSlots, RelayReport, WorstBack, db, direction, direction_words, hop_sirs, hop_sirs_back,
    hops_table, place, relays,
};
pub use sensing::SensingReport;
pub use timeline::{counted, seconds};
pub use traffic::TrafficReport;
