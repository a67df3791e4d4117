//! Faults on the air, one by one and at random: partitions, one-way links, losses, deaths.
//!
//! `COUNT` and `SEED` in the environment set the number and the first seed of random runs. `-- --ignored --nocapture` prints the
//! tables of long runs.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod deaths;
mod healing;
mod one_way;
mod random;
mod soak;

use std::env;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

use uav_relay::{Instant, Mission};
use uav_relay_scenario::Scenario;
use uav_relay_scenario::mission;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::Outcome;
use uav_relay_sim::simulator::setup::Setup;

/// Returns the mission of `cargo chain --uavs N`.
fn paper(relays: u16) -> Mission {
    mission::mission(&Scenario::default(), relays, 1e-4)
        .unwrap()
        .0
}

fn by_radio(relays: u16, baud: u32) -> Setup {
    let mut setup = Setup::on_air(paper(relays), Access::Csma);
    setup.link.baud = baud;
    setup
}

const fn at(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

fn seconds(at: Instant) -> f64 {
    at.as_micros() as f64 / 1e6
}

/// Returns a number from the environment, or the default.
fn number(name: &str, usual: u64) -> u64 {
    env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Runs all `setups` on all cores. Returns the results of `of` in order.
fn run_all<T: Send>(setups: &[Setup], of: impl Fn(&Setup, Outcome) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let at = next.fetch_add(1, Ordering::Relaxed)
            && let Some(setup) = setups.get(at)
        {
            done.push((at, of(setup, run(setup.clone()).unwrap())));
        }
        done
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let mut all: Vec<(usize, T)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join().unwrap());
        done.flatten().collect()
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, one)| one).collect()
}

fn median_and_worst(mut all: Vec<f64>) -> (f64, f64) {
    all.sort_by(f64::total_cmp);
    let middle = all.get(all.len() / 2).copied();
    let worst = all.last().copied();
    (middle.unwrap_or(f64::NAN), worst.unwrap_or(f64::NAN))
}
