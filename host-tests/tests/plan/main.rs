//! `cargo plan`: what it prints, and random scenarios against judges that share nothing with the crate.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::cast_possible_truncation,
    missing_docs
)]

mod joint;

mod random;
