//! What `cargo ci` and `cargo cost` have in common.

pub mod stack;
pub mod toolchain;
