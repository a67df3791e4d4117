//! Two thousand scenarios in space whose optima are stored, so that a solver can be judged without searching for them again.

use std::io;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Scenario, in_space};

/// How many there are.
pub const COUNT: u32 = 2000;

/// Where the optima are stored.
pub const PATH: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data/joint.csv");

/// The seed that the scenarios are drawn from, each in a stream of its own.
const SEED: u64 = 2021;

/// The scenario of a number below [`COUNT`]: 1 to 100 relays, numbers as relays know them.
pub fn numbered(number: u32) -> Scenario {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(number.into());
    in_space(&mut rng, &(1..=100)).as_relays_know_it()
}

/// The optimum SIR (linear) of each, by number; 0 where no chain is possible.
///
/// # Errors
/// Where the file cannot be read, or a row of it is not a number and an SIR.
pub fn optima() -> io::Result<Vec<f64>> {
    let mut optima = Vec::new();
    for row in csv::Reader::from_path(PATH)?.deserialize() {
        let (number, sir): (usize, f64) = row?;
        if number != optima.len() {
            return Err(io::Error::other(format!("row of number {number}")));
        }
        optima.push(sir);
    }
    Ok(optima)
}
