//! Fuzz targets without a fuzzer: every input of the corpora, and thousands of random ones.
//!
//! The targets in `host-tests/fuzz/harness` run the same functions under libFuzzer. Random tests print their `SEED` (1 if unset).
#![cfg(test)]
#![allow(clippy::float_cmp)]

use std::fs;
use std::path::PathBuf;

use uav_relay_fuzz::heap::Counting;

mod heap;
mod random;
mod reach;
mod replay;
mod seeds;
mod tools;

/// Heap that counts its allocations, because the crate under test must make none.
#[global_allocator]
static HEAP: Counting = Counting;

fn folder(target: &str) -> PathBuf {
    let fuzz = concat!(env!("CARGO_MANIFEST_DIR"), "/corpus");
    PathBuf::from(fuzz).join(target)
}

/// Returns the corpus of a fuzz target: file names and inputs, in order.
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
