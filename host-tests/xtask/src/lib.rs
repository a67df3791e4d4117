//! What `cargo ci` and `cargo cost` have in common.

pub mod stack;
pub mod toolchain;

/// The fuzz targets that `cargo ci` runs: all that there are, by name.
pub const FUZZ_TARGETS: [&str; 6] = ["deframe", "frame", "relay", "chain", "scenario", "mavlink"];
