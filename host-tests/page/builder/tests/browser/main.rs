//! The page in a headless Chromium, opened as a file: what a hand does moves the chain, and its numbers are those of `cargo chain --json`.
//!
//! | file | what it asks |
//! | --- | --- |
//! | `chromium` | a browser, over its own protocol |
//! | `opened` | the page in it, and what a user does there |
//! | `numbers` | are its numbers those of the command? |
//! | `hand` | mouse, finger, keyboard |
//! | `wrong` | what is said where something is wrong |
//! | `played` | a run from its beginning to its end |
//! | `speed` | is it there at once, and does it follow? |
//! | `layout` | wide and narrow, light and dark, and for who cannot see it |
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    missing_docs
)]

mod chromium;
mod hand;
mod layout;
mod numbers;
mod opened;
mod played;
mod speed;
mod wrong;
