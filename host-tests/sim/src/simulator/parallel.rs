//! Parallel runs of one setup with many seeds.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use uav_relay::SetupError;

use super::chain::run;
use super::outcome::Outcome;
use super::setup::Setup;

/// Runs `setup` with each of `seeds` on all cores and maps each outcome with `of`. The results keep the order of the seeds.
///
/// # Errors
/// [`SetupError`] if a relay rejects its profile or settings.
pub fn run_seeds<T: Send>(
    setup: &Setup,
    seeds: impl IntoIterator<Item = u64>,
    of: impl Fn(u64, Outcome) -> T + Sync,
) -> Result<Vec<T>, SetupError> {
    let seeds: Vec<u64> = seeds.into_iter().collect();
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(seed) = seeds.get(at).copied() else {
                return done;
            };
            let setup = Setup {
                seed,
                ..setup.clone()
            };
            done.push((at, run(setup).map(|outcome| of(seed, outcome))));
        }
    };
    let mut all: Vec<_> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores.min(seeds.len()))
            .map(|_| scope.spawn(work))
            .collect();
        let done = workers.into_iter().map(|worker| match worker.join() {
            Ok(done) => done,
            Err(panic) => std::panic::resume_unwind(panic),
        });
        done.flatten().collect()
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, result)| result).collect()
}
