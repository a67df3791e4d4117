//! Chains that find an interferer that nobody told them of, in random scenes, against the chain that was told.
//!
//! `COUNT=1000` flies as many scenes a row, `SEED` begins elsewhere.

mod ends;
mod following;
mod found;
mod steady;
mod wrong;

/// How many scenes a row: `COUNT`, or `usual`.
fn count(usual: u64) -> u64 {
    let count = std::env::var("COUNT").ok();
    count.and_then(|count| count.parse().ok()).unwrap_or(usual)
}
