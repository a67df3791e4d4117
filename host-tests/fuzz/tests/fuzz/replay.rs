//! Replay of the corpora, which must stay small.

use std::fs;

use uav_relay_fuzz::TARGETS;

use super::corpus;

/// Largest permitted number of files, and of bytes, of all fuzz corpora together.
const MOST: (usize, usize) = (200, 200 << 10);

/// Fuzz targets to run under Miri, each with the number of short inputs to run. Miri is about a thousand times slower.
const FOR_MIRI: [(&str, usize); 4] = [("deframe", 4), ("frame", 6), ("relay", 3), ("mavlink", 2)];

const SHORT: usize = 60;

/// Returns the corpus inputs of a target to run: all of them, or only a few under Miri.
fn chosen(target: &str) -> Vec<(String, Vec<u8>)> {
    let mut inputs = corpus(target);
    assert!(!inputs.is_empty(), "{target}");
    if cfg!(miri) {
        let few = FOR_MIRI.iter().find(|(name, _)| *name == target);
        inputs.retain(|(_, bytes)| bytes.len() <= SHORT);
        inputs.truncate(few.map_or(0, |(_, count)| *count));
    }
    inputs
}

#[test]
fn every_input_of_the_corpora_passes() {
    for (name, target) in TARGETS {
        for (path, bytes) in chosen(name) {
            let passes = std::panic::catch_unwind(|| target(&bytes)).is_ok();
            assert!(passes, "{path}: `{name}` fails, see above");
        }
    }
}

#[test]
#[cfg_attr(miri, ignore = "nothing of the crate runs here")]
fn the_corpora_are_small() {
    let inputs: Vec<_> = TARGETS.iter().flat_map(|(name, _)| corpus(name)).collect();
    let bytes: usize = inputs.iter().map(|(_, bytes)| bytes.len()).sum();
    println!("{} inputs, {bytes} bytes", inputs.len());
    assert!(inputs.len() <= MOST.0, "{} files", inputs.len());
    assert!(bytes <= MOST.1, "{bytes} bytes");
}

#[test]
#[cfg_attr(miri, ignore = "nothing of the crate runs here")]
fn all_targets_are_fuzzed() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/harness/fuzz_targets");
    let stem = |entry: std::io::Result<fs::DirEntry>| {
        entry.unwrap().path().file_stem().unwrap().to_owned()
    };
    let mut fuzzed: Vec<_> = fs::read_dir(folder).unwrap().map(stem).collect();
    let mut all = TARGETS.map(|(name, _)| name);
    fuzzed.sort();
    all.sort_unstable();
    assert_eq!(fuzzed, all);
}
