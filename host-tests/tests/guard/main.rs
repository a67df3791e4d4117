//! Motion guard of simulated drones on a faulty medium with random agreements.
//!
//! `COUNT` and `SEED` select other schedules; a failure names its seed.

mod agenda;
mod anywhere;
mod drone;
mod known;
mod leaving;
mod medium;
mod schedule;
mod world;

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay_oracle::random::seed;

use schedule::{Report, fly};

fn count() -> u64 {
    let count = std::env::var("COUNT").ok();
    let default = if cfg!(debug_assertions) { 300 } else { 10_000 };
    count.and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Checks in random flights that every two drones keep the separation, and that every drone arrives.
#[test]
fn drones_keep_apart_and_all_arrive() {
    let first = seed(20_260);
    let reports: Vec<Report> = (0..count())
        .into_par_iter()
        .map(|k| fly(first.wrapping_add(k)))
        .collect();
    let sum = |of: fn(&Report) -> u64| reports.iter().map(of).sum::<u64>();
    println!(
        "{} schedules, {} drone-steps, {} agreements heard, {} reboots, {} relays silent, {} gone, {} taken by pilots and {} moved along the line, {} neighbours that end closer along x",
        reports.len(),
        sum(|report| report.steps),
        sum(|report| report.heard),
        sum(|report| report.reboots),
        sum(|report| report.silences),
        sum(|report| report.gone),
        sum(|report| report.taken),
        sum(|report| report.along),
        sum(|report| report.close),
    );
    let closest = reports
        .iter()
        .map(|report| report.closest_m)
        .fold(f64::INFINITY, f64::min);
    let latest = reports
        .iter()
        .map(|report| report.share_of_time)
        .fold(0.0, f64::max);
    println!(
        "least of (distance - separation + allowed) {closest:.6} m, latest arrival at {latest:.3} of the time allowed"
    );
    println!(
        "messages a relay and second while all fly to the last places: {:.2} on average, at most {:.2}",
        reports.iter().map(|report| report.messages).sum::<f64>() / reports.len() as f64,
        reports
            .iter()
            .map(|report| report.messages)
            .fold(0.0, f64::max),
    );
    assert!(
        sum(|report| report.reboots) > 0
            && sum(|report| report.silences) > 0
            && sum(|report| report.gone) > 0
            && sum(|report| report.along) > 0
            && sum(|report| report.close) > 0
    );
}
