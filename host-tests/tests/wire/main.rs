//! The wire format judged from outside: against golden vectors, against a second codec written from `FORMAT.md`'s rules,
//! and with everything that must be refused.
//!
//! Random tests draw from the environment variable `SEED` (1 if unset), which each of them prints.

use proptest::test_runner::{Config, RngSeed};
use uav_relay_oracle::random::seed;

mod adopted;
mod anything;
mod bodies;
mod bounds;
mod calls;
mod codec;
mod damage;
mod decoded;
mod document;
mod duplicate;
mod extremes;
mod forming;
mod gathered;
mod gathering;
mod golden;
mod ground;
mod kinds;
mod ladder;
mod lies;
mod offer;
mod offered;
mod random;
mod ranges;
mod receive;
mod reject;
mod sequence;
mod shared;
mod signed;
mod sited;
mod strategies;
mod stream;
mod stream_strategies;
mod uploads;
mod view_strategies;
mod views;
mod votes;

/// `cases` cases from the seed in `SEED`; a failure prints its shrunk input and leaves no file behind.
fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed(1)),
        ..Config::default()
    }
}
