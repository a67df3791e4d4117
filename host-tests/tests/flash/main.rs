//! What a drone keeps in its flash: the epoch of its frames, and the missions that were uploaded.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod epoch;
mod uploads;
