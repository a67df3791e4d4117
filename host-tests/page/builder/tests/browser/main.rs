//! The page in a headless Chromium, opened as a file. User input moves the chain, and its numbers equal `cargo chain --json`.
//!
//! | file | content |
//! | --- | --- |
//! | `chromium` | a browser, over its own protocol |
//! | `opened` | the page in it, user actions, and comparison with the command |
//! | `hand` | mouse, finger and keyboard input, and error messages |
//! | `played` | playing a run |
//! | `ways` | both directions of every hop |
//! | `recorded` | the page of a recorded flight |
//! | `screen` | the screen of a flight, `cargo chain --fly --web` |
//! | `layout` | wide and narrow, light and dark, accessibility, and response times |
#![cfg(test)]

mod chromium;
mod hand;
mod layout;
mod opened;
mod played;
mod recorded;
mod screen;
mod ways;
