//! How long it takes until a chain flies without a relay that has died.

use super::*;

/// Relay 4 of eight dies then.
const DIES_S: u64 = 20;

/// How long it was not right from then on, s: what the death has cost, and anything else. `None` where it does not hold the places of those
/// that are left in the end.
fn recovery(outcome: &Outcome) -> Option<f64> {
    let left = || outcome.relays.iter().filter(|relay| relay.killed.is_none());
    // They may be forming anew, with the same relays, when the run ends.
    let same = left().all(|relay| relay.relays == 7);
    let watched = outcome.watched?;
    let first = seconds(watched.first_agreement?);
    let wrong = (1.0 - watched.availability?) * (seconds(outcome.ended) - first);
    same.then_some(wrong + (first - DIES_S as f64).max(0.0))
}

/// The loss, in how many of the seeds it was not got over, the median and the worst of the others, s.
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

/// Some seeds are not got over yet: they are printed.
#[test]
#[ignore = "prints a table"]
fn deaths_on_bad_channels() {
    println!("| loss | median | worst | seeds in which it was not got over |");
    println!("| --- | --- | --- | --- |");
    for loss in [0.0, 0.5, 0.7] {
        losing(loss, number("COUNT", 50));
    }
}
