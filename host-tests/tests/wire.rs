//! The wire format judged from outside: against golden vectors, against a second codec written from `FORMAT.md`'s rules,
//! and with everything that must be refused.
//!
//! Random tests draw from the environment variable `SEED` (1 if unset), which each of them prints.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    missing_docs
)]

use crc::{CRC_32_ISCSI, Crc};
use host_tests::random::seed;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};
use uav_relay::wire::crc::Crc32c;

#[path = "wire/codec.rs"]
mod codec;
#[path = "wire/course.rs"]
mod course;
#[path = "wire/damage.rs"]
mod damage;
#[path = "wire/document.rs"]
mod document;
#[path = "wire/forming.rs"]
mod forming;
#[path = "wire/golden.rs"]
mod golden;
#[path = "wire/ground.rs"]
mod ground;
#[path = "wire/ladder.rs"]
mod ladder;
#[path = "wire/lies.rs"]
mod lies;
#[path = "wire/offer.rs"]
mod offer;
#[path = "wire/offered.rs"]
mod offered;
#[path = "wire/random.rs"]
mod random;
#[path = "wire/ranges.rs"]
mod ranges;
#[path = "wire/receive.rs"]
mod receive;
#[path = "wire/reject.rs"]
mod reject;
#[path = "wire/sequence.rs"]
mod sequence;
#[path = "wire/shared.rs"]
mod shared;
#[path = "wire/signed.rs"]
mod signed;
#[path = "wire/strategies.rs"]
mod strategies;
#[path = "wire/stream.rs"]
mod stream;
#[path = "wire/uploads.rs"]
mod uploads;
#[path = "wire/views.rs"]
mod views;

/// `cases` cases from the seed in `SEED`; a failure prints its shrunk input and leaves no file behind.
fn config(cases: u32) -> Config {
    Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed(1)),
        ..Config::default()
    }
}

proptest! {
    #![proptest_config(config(1000))]

    #[test]
    fn crc_agrees_with_a_published_one(pieces in vec(vec(any::<u8>(), 0..100), 0..8)) {
        let mut own = Crc32c::new();
        for piece in &pieces {
            own.update(piece);
        }
        let published = Crc::<u32>::new(&CRC_32_ISCSI).checksum(&pieces.concat());
        prop_assert_eq!(own.finish(), published);
    }
}
