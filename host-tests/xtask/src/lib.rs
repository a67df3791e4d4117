//! Shared parts of the project's development commands.

pub mod stack;
pub mod template;
pub mod toolchain;
