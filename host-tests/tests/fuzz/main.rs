//! The fuzz targets without a fuzzer: every input that one has found worth keeping, and some thousands of random ones.
//!
//! The same functions run in `host-tests/fuzz` under libFuzzer. Random tests draw from the environment variable `SEED` (1
//! if unset), which each of them prints.

use std::fs;
use std::path::PathBuf;

use uav_relay_fuzz::heap::Counting;

mod heap;
mod random;
mod reach;
mod replay;
mod seeds;
mod tools;

/// Counts what the crate asks of the heap: nothing.
#[global_allocator]
static HEAP: Counting = Counting;

/// The folder of the inputs of a target.
fn folder(target: &str) -> PathBuf {
    let fuzz = concat!(env!("CARGO_MANIFEST_DIR"), "/fuzz/corpus");
    PathBuf::from(fuzz).join(target)
}

/// The inputs of a target with the names of their files, in the order of those.
fn corpus(target: &str) -> Vec<(String, Vec<u8>)> {
    let mut inputs: Vec<_> = fs::read_dir(folder(target))
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            (path.display().to_string(), fs::read(&path).unwrap())
        })
        .collect();
    inputs.sort();
    inputs
}
