//! Wire format compared with golden vectors and a second codec by the tables of `FORMAT.md`.
//!
//! Random tests use the environment variable `SEED` (1 if unset), which each prints.

use proptest::test_runner::{Config, RngSeed};
use uav_relay_oracle::random::seed;

mod adopted;
mod anything;
mod bench;
mod calls;
mod damage;
mod document;
mod duplicate;
mod extremes;
mod forming;
mod gathered;
mod golden;
mod ground;
mod kinds;
mod ladder;
mod meaning;
mod message;
mod mutations;
mod offer;
mod random;
mod ranges;
mod receive;
mod sequence;
mod shared;
mod signed;
mod sited;
mod strategies;
mod stream;
mod uploads;
mod views;
mod votes;

/// Returns a proptest configuration for `cases` cases from `SEED`. Failures leave no file behind.
fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed(1)),
        ..Config::default()
    }
}
