//! Targets on random bytes and on mutated inputs of the corpus.

use chacha20::ChaCha8Rng;
use rand::{Rng, RngExt, SeedableRng};
use uav_relay_fuzz::TARGETS;

use super::corpus;

/// Number of random inputs of each kind for each fuzz target.
const INPUTS: usize = 1000;

const LONGEST: usize = 300;

fn rng() -> ChaCha8Rng {
    let seed = std::env::var("SEED").map_or(1, |seed| seed.parse().unwrap());
    println!("SEED={seed}");
    ChaCha8Rng::seed_from_u64(seed)
}

/// Runs a fuzz target on inputs from `draw`. Panics with the first input on which it fails.
fn explore(target: fn(&[u8]), mut draw: impl FnMut() -> Vec<u8>) {
    for _ in 0..INPUTS {
        let input = draw();
        let passes = std::panic::catch_unwind(|| target(&input)).is_ok();
        assert!(passes, "{input:?} fails, see above");
    }
}

fn bytes(rng: &mut impl Rng) -> Vec<u8> {
    let len = rng.random_range(0..=LONGEST);
    let mut bytes = vec![0; len];
    rng.fill_bytes(&mut bytes);
    bytes
}

/// Returns a corpus input with one to four changes. A change alters, removes or doubles a byte, or appends the end of another input.
fn changed(rng: &mut impl Rng, inputs: &[(String, Vec<u8>)]) -> Vec<u8> {
    let pick = |rng: &mut dyn Rng| inputs[rng.random_range(0..inputs.len())].1.clone();
    let mut input = pick(rng);
    for _ in 0..rng.random_range(1..=4) {
        let at = rng.random_range(0..=input.len());
        match rng.random_range(0..4) {
            0 => input.insert(at, rng.random()),
            1 => {
                let other = pick(rng);
                input.truncate(at);
                input.extend(&other[at.min(other.len())..]);
            }
            2 if at < input.len() => drop(input.remove(at)),
            _ if at < input.len() => input[at] = rng.random(),
            _ => {}
        }
    }
    input
}

#[test]
#[cfg_attr(miri, ignore = "takes too long there")]
fn random_bytes_pass() {
    for (name, target) in TARGETS {
        let mut rng = rng();
        println!("{name}");
        explore(target, || bytes(&mut rng));
    }
}

#[test]
#[cfg_attr(miri, ignore = "takes too long there")]
fn changed_inputs_pass() {
    for (name, target) in TARGETS {
        let (mut rng, inputs) = (rng(), corpus(name));
        println!("{name}");
        explore(target, || changed(&mut rng, &inputs));
    }
}
