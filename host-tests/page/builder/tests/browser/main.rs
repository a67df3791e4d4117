//! The page in a headless Chromium, opened as a file. User input moves the chain, and its numbers equal `cargo chain --json`.
//!
//! | file | content |
//! | --- | --- |
//! | `chromium` | a browser, over its own protocol |
//! | `opened` | the page in it, and user actions |
//! | `numbers` | comparison with the command |
//! | `hand` | mouse, finger and keyboard input |
//! | `wrong` | error messages |
//! | `played` | playing a run |
//! | `speed` | loading and response times |
//! | `layout` | wide and narrow, light and dark, and accessibility |
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
