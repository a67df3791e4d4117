//! `cargo plan`: what it prints, and random scenarios against judges that share nothing with the crate.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    missing_docs
)]

#[path = "plan/command.rs"]
mod command;
#[path = "plan/joint.rs"]
mod joint_plans;
#[path = "plan/random.rs"]
mod random_scenarios;
