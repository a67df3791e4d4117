//! Capacity of a shared channel. How many relays agree and stay in agreement, and with how many messages.
//!
//! `-- --ignored --nocapture` prints the tables of long chains.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod least_baud;
mod messages;

use uav_relay::{Instant, Mission};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;

/// Returns the paper's mission for `relays` relays with a minimum separation of 0.1 m.
fn close(relays: u16) -> Mission {
    let scenario = Scenario {
        min_separation_m: 0.1,
        ..Scenario::default()
    };
    mission::mission(&scenario, relays, 1e-4).unwrap().0
}

fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}
