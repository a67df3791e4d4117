//! Coverage counters of the model test: a rule that was never exercised proves nothing.

use std::collections::BTreeMap;

use uav_relay::Duration;

use super::scenario::{Kind, Scenario};

/// Counters of events in the model test, and the largest values of some measurements.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tally {
    counts: BTreeMap<&'static str, u64>,
    most: BTreeMap<&'static str, u64>,
    /// Longest time to an agreement, µs, by kind of mission and by signed (true) or unsigned frames.
    took_us: BTreeMap<(Kind, bool), u64>,
    sequences: BTreeMap<(Kind, bool), u64>,
}

/// Events that must occur, each with a number n. On average, n test sequences must have at least one such event.
const EXPECTED: [(&str, u64); 18] = [
    ("frames in bursts", 1),
    ("frames delayed", 1),
    ("frames delivered", 1),
    ("frames lost", 1),
    ("frames doubled", 1),
    ("frames overtaking", 1),
    ("frames damaged", 1),
    ("leaders rebooted", 4),
    ("others rebooted", 2),
    ("links cut", 2),
    ("frames replayed", 2),
    ("restarts", 1),
    ("measurements taken", 10),
    ("hops held", 1),
    ("neighbours missed", 10),
    ("stragglers", 20),
    ("foreign passes", 2),
    ("views agreed on", 1),
];

impl Tally {
    pub(crate) fn add(&mut self, what: &'static str) {
        *self.counts.entry(what).or_default() += 1;
    }

    pub(crate) fn most(&mut self, of: &'static str, value: u64) {
        let most = self.most.entry(of).or_default();
        *most = value.max(*most);
    }

    /// Adds `other`, the counters of one sequence of operations. The sequence ended with an agreement after `took`.
    pub(crate) fn sequence(&mut self, scenario: &Scenario, other: &Self, took: Duration) {
        let kind = (scenario.kind, scenario.signs());
        for (what, count) in &other.counts {
            *self.counts.entry(what).or_default() += count;
        }
        for (what, value) in &other.most {
            self.most(what, *value);
        }
        *self.sequences.entry(kind).or_default() += 1;
        let longest = self.took_us.entry(kind).or_default();
        *longest = took.as_micros().max(*longest);
    }

    /// Prints the counters. Panics if an expected event is too rare in `sequences` sequences.
    pub(crate) fn assert_coverage(&self, sequences: u32) {
        println!("{sequences} sequences: {:?}", self.counts);
        println!("at most: {:?}", self.most);
        for (kind, took_us) in &self.took_us {
            println!(
                "{:?}, signed: {}: {} sequences, agreed again within {} ms",
                kind.0,
                kind.1,
                self.sequences[kind],
                took_us / 1_000
            );
        }
        for (what, one_in) in EXPECTED {
            let count = self.counts.get(what).copied().unwrap_or(0);
            assert!(count >= u64::from(sequences) / one_in, "{what}: {count}");
        }
        assert!(sequences < 100 || self.sequences.len() == 2 * Kind::ALL.len());
    }
}
