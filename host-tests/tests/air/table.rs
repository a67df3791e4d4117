//! Figures of chains on bad channels, printed on demand.

use std::time;

use host_tests::fixtures::mission;
use uav_relay_sim::simulator::chain::run_seeds;
use uav_relay_sim::simulator::faults::OneWayFailure;
use uav_relay_sim::simulator::setup::Setup;

use super::*;

/// Returns the simulation setup of eight relays on a CSMA channel of 57 600 baud, without losses.
fn usual() -> Setup {
    let mut setup = Setup::on_air(mission(8), Access::Csma);
    setup.link.baud = 57_600;
    setup
}

fn losing(share: f64, burst: f64) -> Setup {
    let mut setup = usual();
    setup.faults.loss = share;
    setup.burst = burst;
    setup
}

fn at_baud(baud: u32) -> Setup {
    let mut setup = usual();
    setup.link.baud = baud;
    setup
}

#[test]
#[ignore = "prints a table"]
fn chains_on_bad_channels() {
    let mut deaf = usual();
    deaf.deaf = vec![OneWayFailure {
        by: 4,
        of: 3,
        from: at(0),
        until: None,
    }];
    let cases = [
        ("good", usual()),
        ("loss 50 %", losing(0.5, 1.0)),
        ("loss 70 %", losing(0.7, 1.0)),
        ("loss 30 % in bursts of 20", losing(0.3, 20.0)),
        ("loss 50 % in bursts of 20", losing(0.5, 20.0)),
        ("1 200 baud", at_baud(1_200)),
        ("2 400 baud", at_baud(2_400)),
        ("4 800 baud", at_baud(4_800)),
        ("9 600 baud", at_baud(9_600)),
        ("4 deaf to 3", deaf),
    ];
    println!(
        "| 8 relays by CSMA at 57 600 baud, 20 seeds of 600 s | availability, mean | least | first agreement, latest | agreed in | \
         groups at once, most | least separation | collided, dropped per s | times real time |"
    );
    println!("| --- | --- | --- | --- | --- | --- | --- | --- | --- |");
    for (name, setup) in cases {
        let setup = setup.soaked(seconds(600));
        let started = time::Instant::now();
        let ends = run_seeds(&setup, 1..=20, |_, outcome| {
            (outcome.watched.unwrap(), outcome.air)
        })
        .unwrap();
        let took = started.elapsed().as_secs_f64();
        let shares: Vec<f64> = ends
            .iter()
            .map(|(end, _)| end.availability.unwrap())
            .collect();
        let mean = shares.iter().sum::<f64>() / shares.len() as f64;
        let least = shares.iter().copied().reduce(f64::min).unwrap();
        let firsts = ends.iter().filter_map(|(end, _)| end.first_agreement);
        let agreed = firsts.clone().count();
        let first = firsts
            .max()
            .map_or(f64::NAN, |at| at.as_micros() as f64 / 1e6);
        let most = ends.iter().map(|(end, _)| end.most_flying).max().unwrap();
        let near = ends.iter().filter_map(|(end, _)| end.least_separation_m);
        let near = near.reduce(f64::min).unwrap_or(f64::NAN);
        let per_s = |count: fn(&AirCounts) -> u64| {
            ends.iter().map(|(_, air)| count(air)).sum::<u64>() as f64 / 12_000.0
        };
        println!(
            "| {name} | {mean:.4} | {least:.4} | {first:.1} s | {agreed} of 20 | {most} | {near:.2} m | {:.2}, {:.2} | {:.0} |",
            per_s(|air| air.collided),
            per_s(|air| air.dropped),
            12_000.0 / took
        );
    }
}
