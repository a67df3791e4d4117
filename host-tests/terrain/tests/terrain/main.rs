//! Tests of elevation files, profiles and diffraction losses.
#![cfg(test)]
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    clippy::unreadable_literal
)]

mod files;
mod grids;
mod itu;
mod judge;
mod peaks;
mod profiles;

use chacha20::ChaCha8Rng;
use rand::SeedableRng as _;

/// Returns the seeds of a random test.
///
/// `SEED` in the environment sets the first seed, and `COUNT` the number of seeds.
fn seeds(count: u64) -> std::ops::Range<u64> {
    let number = |name: &str| std::env::var(name).ok().and_then(|text| text.parse().ok());
    let first = number("SEED").unwrap_or(1);
    first..first + number("COUNT").unwrap_or(count)
}

fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}
