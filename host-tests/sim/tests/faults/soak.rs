//! Availability of a chain on channels with high loss.

use uav_relay_sim::simulator::parallel::run_seeds;

use super::*;

/// Returns a setup of eight signed relays with CSMA at 57 600 baud.
fn losing(loss: f64, burst: f64) -> Setup {
    let mut setup = by_radio(8, 57_600);
    setup.auth = true;
    setup.faults.loss = loss;
    setup.burst = burst;
    setup
}

/// Loss, mean burst length (1 for independent losses), and required availability.
const ASKED: [(f64, f64, f64); 4] = [
    (0.5, 1.0, 0.999),
    (0.7, 1.0, 0.97),
    (0.3, 20.0, 0.97),
    (0.5, 20.0, 0.85),
];

/// Results of several seeds: availabilities and times of the first agreement, s.
struct Soaked {
    shares: Vec<(u64, f64)>,
    firsts: Vec<f64>,
    most_flying: usize,
}

fn soak(loss: f64, burst: f64, seeds: u64, until: Instant) -> Soaked {
    let setup = losing(loss, burst).soaked(until);
    let ends = run_seeds(&setup, 1..=seeds, |seed, outcome| {
        (seed, outcome.watched.unwrap())
    });
    let ends = ends.unwrap();
    Soaked {
        shares: ends
            .iter()
            .map(|(seed, end)| (*seed, end.availability.unwrap()))
            .collect(),
        firsts: ends
            .iter()
            .filter_map(|(_, end)| end.first_agreement)
            .map(seconds)
            .collect(),
        most_flying: ends.iter().map(|(_, end)| end.most_flying).max().unwrap(),
    }
}

impl Soaked {
    fn mean(&self) -> f64 {
        self.shares.iter().map(|(_, share)| share).sum::<f64>() / self.shares.len() as f64
    }

    fn least(&self) -> (u64, f64) {
        let least = self
            .shares
            .iter()
            .copied()
            .reduce(|one, other| if other.1 < one.1 { other } else { one });
        least.unwrap()
    }

    fn below(&self, asked: f64) -> Vec<(u64, f64)> {
        self.shares
            .iter()
            .copied()
            .filter(|(_, share)| *share < asked)
            .collect()
    }
}

#[test]
fn the_mean_of_ten_chains_is_right_for_as_long_as_is_asked() {
    for (loss, burst, asked) in ASKED {
        let soaked = soak(loss, burst, 10, at(600));
        let (mean, (seed, least)) = (soaked.mean(), soaked.least());
        println!("loss {loss}, runs of {burst}: mean {mean:.5}, least {least:.5} (seed {seed})");
        assert!(
            mean >= asked,
            "loss {loss}, runs of {burst}: {:?}",
            soaked.shares
        );
        assert!(
            least > 0.0 && soaked.most_flying == 1,
            "loss {loss}, runs of {burst}, seed {seed}"
        );
    }
}

#[test]
#[ignore = "prints a table"]
fn an_hour_on_bad_channels() {
    let seeds = number("COUNT", 200);
    println!(
        "| loss, mean length of a run | asked for | mean | least (seed) | below what is asked for | never | first agreement, median | worst | \
         groups at once |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (loss, burst, asked) in ASKED {
        let soaked = soak(loss, burst, seeds, at(3_600));
        let (seed, least) = soaked.least();
        let below = soaked.below(asked);
        let never = seeds - soaked.firsts.len() as u64;
        let (median, worst) = median_and_worst(soaked.firsts.clone());
        println!(
            "| {loss}, {burst} | {asked} | {:.5} | {least:.5} ({seed}) | {} | {never} | {median:.1} s | {worst:.1} s | {} |",
            soaked.mean(),
            below.len(),
            soaked.most_flying
        );
        println!("below: {below:.4?}");
    }
}
