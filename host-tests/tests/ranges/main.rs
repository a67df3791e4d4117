//! Every input of the public API over its whole range; `COUNT` chains from seed `SEED`.

use std::panic::catch_unwind;

use rayon::prelude::*;

mod draw;
mod line;
mod measured;
mod missions;
mod positions;

/// Returns the random seeds of a test. The environment variables `SEED` and `COUNT` set the first seed and the number
/// of seeds; the defaults are 0 and `usual`.
fn seeds(usual: u64) -> std::ops::Range<u64> {
    let of = |name: &str| std::env::var(name).ok()?.parse().ok();
    let (first, count) = (of("SEED").unwrap_or(0), of("COUNT").unwrap_or(usual));
    first..first + count
}

/// Returns the result of `fly` for every random seed. Reports the seeds for which it panics.
fn each<T: Send>(usual: u64, fly: impl Fn(u64) -> T + Sync + std::panic::RefUnwindSafe) -> Vec<T> {
    let came: Vec<Result<T, u64>> = seeds(usual)
        .into_par_iter()
        .map(|seed| catch_unwind(|| fly(seed)).map_err(|_| seed))
        .collect();
    let failed: Vec<u64> = came
        .iter()
        .filter_map(|it| it.as_ref().err().copied())
        .collect();
    let all = came.len();
    println!("{} of {all} seeds fail", failed.len());
    assert!(
        failed.is_empty(),
        "{} of {all} seeds fail: {:?} ..",
        failed.len(),
        &failed[..failed.len().min(20)]
    );
    came.into_iter().flatten().collect()
}
