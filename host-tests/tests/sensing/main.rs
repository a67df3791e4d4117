//! Search for an unknown interferer in random scenes. `COUNT` sets the scenes of each row, `SEED` the first.

mod ends;
mod following;
mod found;
mod steady;
mod wrong;

fn count(usual: u64) -> u64 {
    let count = std::env::var("COUNT").ok();
    count.and_then(|count| count.parse().ok()).unwrap_or(usual)
}
