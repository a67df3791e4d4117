//! Shared parts of the project's development commands.

pub mod stack;
pub mod template;
pub mod toolchain;

/// Names of all fuzz targets, which `cargo ci` runs.
pub const FUZZ_TARGETS: [&str; 6] = ["deframe", "frame", "relay", "chain", "scenario", "mavlink"];
