//! One still source: how much of the optimum after how many agreements.

use rayon::prelude::*;
use uav_relay::Interference;
use uav_relay_sim::simulator::chain::run;

use crate::scenes::{Wild, by_agreement, count, quantile};

/// Shares of the optimum after 0, 1, 2, .. agreements that followed what was heard: of every scene, one list for each number.
fn shares(relays: u16, sources: usize, change: impl Fn(&Wild, &mut uav_relay_sim::simulator::setup::Setup) + Sync) -> Vec<Vec<f64>> {
    let scenes: Vec<u64> = (0..count(60)).collect();
    let each: Vec<Vec<f64>> = scenes
        .into_par_iter()
        .map(|seed| {
            let wild = Wild::new(seed, relays, sources);
            let mut setup = wild.setup(Interference::Unknown);
            change(&wild, &mut setup);
            let outcome = run(setup).unwrap();
            let best = wild.optimum();
            let sirs = by_agreement(&wild.scene(), &outcome.stands);
            (0..=8)
                .map(|at| sirs.get(at).or(sirs.last()).map_or(0.0, |sir| sir / best))
                .collect()
        })
        .collect();
    (0..=8)
        .map(|at| each.iter().map(|one| one[at]).collect())
        .collect()
}

fn print(what: &str, shares: &mut [Vec<f64>]) {
    for (at, shares) in shares.iter_mut().enumerate() {
        println!(
            "{what}, after {at}: least {:.4} 1 % {:.4} 10 % {:.4} median {:.4} most {:.6}",
            quantile(shares, 0.0),
            quantile(shares, 0.01),
            quantile(shares, 0.1),
            quantile(shares, 0.5),
            quantile(shares, 1.0)
        );
    }
}

#[test]
fn one_source_is_found() {
    for relays in [3, 5, 8, 20] {
        let mut shares = shares(relays, 1, |_, _| {});
        print(&format!("N = {relays}"), &mut shares);
    }
}

#[test]
fn one_or_two_relays_fly_to_learn() {
    for relays in [1, 2] {
        let mut shares = shares(relays, 1, |_, _| {});
        print(&format!("N = {relays}"), &mut shares);
    }
}

#[test]
fn shadows() {
    let mut hovering = shares(8, 1, |_, setup| setup.sky.as_mut().unwrap().shadow_db = 1.0);
    print("N = 8, 1 dB", &mut hovering);
    let mut flown = shares(8, 1, |wild, setup| {
        *setup = wild.flown(Interference::Unknown);
        setup.sky.as_mut().unwrap().shadow_db = 1.0;
    });
    print("N = 8, 1 dB, flown", &mut flown);
}

#[test]
fn two_sources() {
    let mut shares = shares(8, 2, |_, _| {});
    print("N = 8, two", &mut shares);
}
