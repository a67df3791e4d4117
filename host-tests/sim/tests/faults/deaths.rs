//! How long it takes until a chain flies without a relay that has died.

use super::*;

/// Relay 4 of eight dies then.
const DIES_S: u64 = 20;

/// How long it was not right from then on, s: what the death has cost, and anything else. `None` where it does not hold the places of those
/// that are left in the end.
fn recovery(outcome: &Outcome) -> Option<f64> {
    let left = || outcome.relays.iter().filter(|relay| relay.killed.is_none());
    let view = left().next()?.seen.view;
    let same =
        left().all(|relay| relay.relays == 7 && relay.seen.view == view && relay.seen.leased);
    let watched = outcome.watched?;
    let first = seconds(watched.first_agreement?);
    let wrong = (1.0 - watched.availability?) * (seconds(outcome.ended) - first);
    same.then_some(wrong + (first - DIES_S as f64).max(0.0))
}

fn table(seeds: u64) -> Vec<(f64, usize, f64, f64)> {
    let rows = [0.0, 0.5, 0.7].map(|loss| {
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
        let never: Vec<u64> = ends
            .iter()
            .filter(|(_, time)| time.is_none())
            .map(|(seed, _)| *seed)
            .collect();
        let times: Vec<f64> = ends.iter().filter_map(|(_, time)| *time).collect();
        let (median, worst) = median_and_worst(times);
        println!("| {loss} | {median:.1} s | {worst:.1} s | {never:?} |");
        (loss, never.len(), median, worst)
    });
    rows.to_vec()
}

#[test]
fn a_death_is_got_over() {
    println!("| loss | median | worst | seeds in which it was not got over |");
    for (loss, never, median, worst) in table(number("COUNT", 50)) {
        assert_eq!(never, 0, "loss {loss}");
        println!("{median} {worst}");
    }
}
