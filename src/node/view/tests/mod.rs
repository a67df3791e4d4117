//! What one relay does with proposals and decisions.

mod decisions;
mod leaders;
mod proposals;
mod relay;
