//! Throughput of pure and slotted ALOHA, compared with Abramson (1970) and Roberts (1975).

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};

use super::*;

/// Number of radios that send to one listener. With so many radios, no radio ever has two frames to send at the same time.
const NODES: usize = 400;

/// Length of a frame in bytes, chosen so that its air time is a whole number of microseconds.
const BYTES: usize = 90;

/// Creates a radio channel with `NODES` senders and a listener that receives all of them. With `in_range`, the
/// senders receive each other too.
fn crowd(access: Access, in_range: bool, seed: u64) -> Bench {
    let listener = NODES;
    let hearers = |node| {
        let others = (0..NODES).filter(move |by| in_range && *by != node);
        others
            .chain((node != listener).then_some(listener))
            .collect()
    };
    Bench::new(access, (0..=NODES).map(hearers).collect(), seed)
}

/// Returns the fraction of time in which the listener receives intact frames. `offered` is the mean number of frames
/// sent per frame time, `frames` is the duration in frame times, and `slots` selects slotted ALOHA.
fn throughput(mut bench: Bench, offered: f64, frames: u64, slots: bool) -> f64 {
    let frame = bench.medium.air_time(BYTES).as_micros();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut now = 0.0;
    while now < frames as f64 {
        now -= (1.0 - rng.random::<f64>()).ln() / offered;
        let begins = if slots {
            now.ceil() as u64 * frame
        } else {
            (now * frame as f64) as u64
        };
        let node = rng.random_range(0..NODES);
        bench.offer(at(begins), node, &[0; BYTES]);
    }
    let (who, _) = bench.end();
    let received = who.iter().filter(|(_, by)| by.contains(&NODES)).count();
    received as f64 / frames as f64
}

#[test]
fn pure_aloha_has_its_throughput() {
    for (offered, says) in [(0.1, 0.0819), (0.25, 0.1516), (0.5, 0.1839), (1.0, 0.1353)] {
        let bench = crowd(Access::Aloha, false, 1);
        let share = throughput(bench, offered, 200_000, false);
        println!("G = {offered}: {share:.4}, and the textbook has {says}");
        assert!((share - says).abs() < 0.003, "G = {offered}: {share}");
    }
}

#[test]
fn slotted_aloha_has_twice_that_throughput() {
    for (offered, says) in [(0.5, 0.3033), (1.0, 0.3679)] {
        let bench = crowd(Access::Aloha, false, 1);
        let share = throughput(bench, offered, 100_000, true);
        println!("G = {offered} in slots: {share:.4}, and the textbook has {says}");
        assert!((share - says).abs() < 0.005, "G = {offered}: {share}");
    }
}

#[test]
fn carrier_sense_has_more_throughput_without_hidden_nodes() {
    let frames = 5_000;
    let near = throughput(crowd(Access::Csma, true, 1), 0.5, frames, false);
    let hidden = throughput(crowd(Access::Csma, false, 1), 0.5, frames, false);
    println!("G = 0.5 by CSMA: {near:.4} in one range, {hidden:.4} hidden");
    assert!(near > 0.4, "{near}");
    assert!((hidden - 0.1839).abs() < 0.015, "{hidden}");
}
