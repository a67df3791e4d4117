//! The protocol by sequences of operations: real relays on a hostile chain, against a plain model of what they may do.
//!
//! | file | one idea |
//! | --- | --- |
//! | `operation` | what may happen to a chain, and how it is drawn |
//! | `scenario` | the missions that are flown |
//! | `judge` | what a mission's chain can meet, in f64 |
//! | `wires` | which frames are in flight, and what their bytes must be counted as |
//! | `ledger` | what one relay was told, and what may never happen to it |
//! | `chain` | the relays, connected, and the clock: rules of neighbours checked |
//! | `deed` | what each operation does to a chain |
//! | `seal` | signed frames: taken once, and in the lives they were sent in |
//! | `passes` | which passes a relay may take part in |
//! | `recovery` | from any state to one agreement |
//! | `tally` | what happened at all, and what it took |
//!
//! `COUNT` (2 000) and `SEED` (1) in the environment say how many sequences are drawn, and which. A failure prints both, and
//! the shortest sequence that still fails.

use std::cell::RefCell;

use proptest::collection::vec;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestError, TestRunner};
use uav_relay_oracle::random;

mod chain;
mod deed;
mod judge;
mod ledger;
mod operation;
mod passes;
mod recovery;
mod scenario;
mod seal;
mod signs;
mod tally;
mod wires;

use chain::World;
use operation::{Operation, operations, seeds};
use scenario::{Scenario, pool};
use tally::Tally;

/// What every check of the model comes to.
type Checked<T = ()> = Result<T, TestCaseError>;

/// The most operations of one sequence.
const LONGEST: usize = 200;

/// Sequences for each mission that is drawn.
const SEQUENCES_A_MISSION: u32 = 10;

fn count() -> u32 {
    std::env::var("COUNT").map_or(2_000, |text| text.parse().unwrap())
}

/// One sequence, from switching on to the agreement after the last fault.
fn flown(scenario: &Scenario, seed: u32, sequence: &[Operation], tally: &mut Tally) -> Checked {
    let mut world = World::new(scenario, seed)?;
    for operation in sequence {
        world.apply(operation)?;
    }
    let took = world.recover()?;
    tally.sequence(scenario, &world.tally, took);
    Ok(())
}

/// A failure as a reader wants it: which mission, what was done, in order.
fn described(reason: &str, seed: u64, scenario: &Scenario, sequence: &[Operation]) -> String {
    let listed: Vec<String> = (1..)
        .zip(sequence)
        .map(|(number, operation)| format!("{number:4}. {operation:?}\n"))
        .collect();
    format!(
        "{reason}\nSEED={seed} COUNT={}\n{scenario:?}\n{}",
        count(),
        listed.concat()
    )
}

#[test]
fn no_sequence_of_operations_breaks_a_rule() {
    let seed = random::seed(1);
    let scenarios = pool(seed, (count() / SEQUENCES_A_MISSION).max(48));
    let tally = RefCell::new(Tally::default());
    let mut runner = TestRunner::new(Config {
        cases: count(),
        failure_persistence: None,
        max_shrink_iters: 20_000,
        rng_seed: RngSeed::Fixed(seed),
        ..Config::default()
    });
    let drawn = (0..scenarios.len(), seeds(), vec(operations(), 0..=LONGEST));
    let outcome = runner.run(&drawn, |(at, start, sequence)| {
        flown(&scenarios[at], start, &sequence, &mut tally.borrow_mut())
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(reason, (at, start, sequence))) => panic!(
            "relays started with {start}: {}",
            described(reason.message(), seed, &scenarios[at], &sequence)
        ),
        Err(TestError::Abort(reason)) => panic!("{}", reason.message()),
    }
    tally.into_inner().judge(count());
}
