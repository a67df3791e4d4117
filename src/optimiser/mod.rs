//! The placement maths that flies: pure functions of the mission, no state beyond what they are handed.
//!
//! | for | files |
//! | --- | --- |
//! | how far one hop reaches for a target SIR | [`spacing`] toward Rx, [`retreat`] toward Tx in a field |
//! | a pass of targets at given altitudes | [`ladder`], [`pass`](mod@pass), [`verdict`]; [`search`] says which come next; [`plan`] runs all of it for a whole chain without a message |
//! | places, sides and altitudes together | [`joint`] |
//! | one relay between its neighbours | [`local`]: Algorithm 2 |
//!
//! The node walks the same functions one hop a relay.

#![cfg_attr(
    not(feature = "internals"),
    allow(
        dead_code,
        unused_imports,
        clippy::trivially_copy_pass_by_ref,
        unreachable_pub,
        reason = "the tests of this workspace use these items through the feature `internals`"
    )
)]

pub mod joint;
pub mod ladder;
pub mod local;
pub mod pass;
pub mod plan;
pub mod retreat;
pub mod search;
pub mod spacing;
pub mod verdict;
pub(crate) mod walk;

/// Up to one number a target: reaches, slacks or the targets themselves.
pub type PerTarget = heapless::Vec<f32, { ladder::TARGETS }>;
