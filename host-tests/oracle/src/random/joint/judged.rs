//! Random scenarios with stored optima, so that a test of a solver need not search for them again.

use std::io;

use chacha20::ChaCha8Rng;
use rand::SeedableRng;

use super::{Scenario, in_space};

/// Number of random scenarios whose optimum is stored.
pub const COUNT: u32 = 2000;

/// File with the stored optima. Its first lines name their origin.
const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/joint.csv");

const SEED: u64 = 2021;

/// Returns the random scenario `number`, below [`COUNT`]. It has 1 to 100 relays, and f32 numbers.
pub fn numbered(number: u32) -> Scenario {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(number.into());
    in_space(&mut rng, &(1..=100)).as_relays_know_it()
}

/// Returns the best SIR (linear) of each stored scenario, in the order of the scenarios' numbers.
///
/// The SIR is 0 if no chain is possible in the scenario.
///
/// # Errors
/// If the file cannot be read, or if a row is not a scenario's number and an SIR.
pub fn optima() -> io::Result<Vec<f64>> {
    let mut optima = Vec::new();
    for row in csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(PATH)?
        .deserialize()
    {
        let (number, sir): (usize, f64) = row?;
        if number != optima.len() {
            let expected = optima.len();
            return Err(io::Error::other(format!(
                "row {number} in place of row {expected}"
            )));
        }
        optima.push(sir);
    }
    Ok(optima)
}
