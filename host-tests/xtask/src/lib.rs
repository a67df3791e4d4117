//! What the commands of the project have in common.

pub mod number;
pub mod stack;
pub mod template;
pub mod toolchain;

/// The fuzz targets that `cargo ci` runs: all that there are, by name.
pub const FUZZ_TARGETS: [&str; 6] = ["deframe", "frame", "relay", "chain", "scenario", "mavlink"];
