//! Recovery time after the death of a relay.

use super::*;

/// Time at which relay 4 of eight dies, s.
const DIES_S: u64 = 20;

/// Returns the time without a correct chain after the death, s. `None` unless the remaining relays hold their positions.
fn recovery(outcome: &Outcome) -> Option<f64> {
    let left = || outcome.relays.iter().filter(|relay| relay.killed.is_none());
    // The remaining relays may be forming another view when the run ends.
    let same = left().all(|relay| relay.relays == 7);
    let watched = outcome.watched?;
    let first = seconds(watched.first_agreement?);
    let wrong = (1.0 - watched.availability?) * (seconds(outcome.ended) - first);
    same.then_some(wrong + (first - DIES_S as f64).max(0.0))
}

/// Returns the loss, the number of seeds without recovery, and the median and worst recovery times, s.
fn losing(loss: f64, seeds: u64) -> (f64, usize, f64, f64) {
    let setups: Vec<Setup> = (1..=seeds)
        .map(|seed| {
            let mut setup = by_radio(8, 57_600);
            setup.auth = true;
            setup.faults.loss = loss;
            setup.kills = vec![(4, at(DIES_S))];
            setup.seed = seed;
            setup.soaked(at(400))
        })
        .collect();
    let ends = run_all(&setups, |setup, outcome| (setup.seed, recovery(&outcome)));
    let never = ends.iter().filter(|(_, time)| time.is_none());
    let never: Vec<u64> = never.map(|(seed, _)| *seed).collect();
    let times: Vec<f64> = ends.iter().filter_map(|(_, time)| *time).collect();
    let (median, worst) = median_and_worst(times);
    println!("| {loss} | {median:.1} s | {worst:.1} s | {never:?} |");
    (loss, never.len(), median, worst)
}

#[test]
fn without_losses_a_death_is_got_over_within_a_minute() {
    let (_, never, _, worst) = losing(0.0, number("COUNT", 50));
    assert_eq!(never, 0);
    assert!(worst < 60.0, "{worst}");
}

/// Prints the seeds that do not recover.
#[test]
#[ignore = "prints a table"]
fn deaths_on_bad_channels() {
    println!("| loss | median | worst | seeds in which it was not got over |");
    println!("| --- | --- | --- | --- |");
    for loss in [0.0, 0.5, 0.7] {
        losing(loss, number("COUNT", 50));
    }
}
