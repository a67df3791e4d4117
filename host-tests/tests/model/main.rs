//! Model test of the protocol. Random operations on real relays, compared with a plain model of the permitted behaviour.
//!
//! | file | content |
//! | --- | --- |
//! | `operation` | operations on a chain and their distribution |
//! | `scenario` | random missions |
//! | `reference` | best performance of a mission's chain, in f64 |
//! | `wires` | frames in flight and their expected counts |
//! | `ledger` | observed state of one relay, and rules that it may not break |
//! | `chain` | connected relays and the clock, with the rules of neighbours |
//! | `effect` | effect of each operation |
//! | `accepted_frames` | signed frames: accepted once, in the epochs at which they were sent |
//! | `passes` | passes in which a relay may take part |
//! | `recovery` | recovery from any state to one agreement |
//! | `tally` | coverage counters |
//!
//! The environment variables `COUNT` (2 000) and `SEED` (1) select the number of sequences and the random seed. A failure prints
//! both and the shortest sequence that still fails.

use std::cell::RefCell;

use proptest::collection::vec;
use proptest::test_runner::{Config, RngSeed, TestCaseError, TestError, TestRunner};
use uav_relay_oracle::random;

mod accepted_frames;
mod chain;
mod effect;
mod ledger;
mod operation;
mod passes;
mod recovery;
mod reference;
mod scenario;
mod signs;
mod tally;
mod wires;

use chain::World;
use operation::{Operation, operations, seeds};
use scenario::{Scenario, pool};
use tally::Tally;

type Checked<T = ()> = Result<T, TestCaseError>;

const LONGEST: usize = 200;

/// Number of operation sequences that are run with each random mission.
const SEQUENCES_A_MISSION: u32 = 10;

fn count() -> u32 {
    std::env::var("COUNT").map_or(2_000, |text| text.parse().unwrap())
}

/// Runs one sequence of operations, from power-on to the agreement after the last fault.
fn flown(scenario: &Scenario, seed: u32, sequence: &[Operation], tally: &mut Tally) -> Checked {
    let mut world = World::new(scenario, seed)?;
    for operation in sequence {
        world.apply(operation)?;
    }
    let took = world.recover()?;
    tally.sequence(scenario, &world.tally, took);
    Ok(())
}

/// Returns a readable report of a failure: its reason, the mission, and the operations in order.
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
    tally.into_inner().assert_coverage(count());
}
