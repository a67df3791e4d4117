//! Authenticated chains: they settle where others do, and nothing that is not a member's, and new, is ever taken.
//!
//! Random tests draw from the environment variable `SEED` (1 if unset), which each of them prints; `COUNT` is the number of
//! attacks.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::indexing_slicing,
    clippy::float_cmp,
    missing_docs
)]

#[path = "auth/attack.rs"]
mod attack;
#[path = "auth/chain.rs"]
mod chain;
#[path = "auth/document.rs"]
mod document;
#[path = "auth/edges.rs"]
mod edges;
#[path = "auth/frames.rs"]
mod frames;
#[path = "auth/hellos.rs"]
mod hellos;
#[path = "auth/kinds.rs"]
mod kinds;
#[path = "auth/net.rs"]
mod net;
#[path = "auth/offers.rs"]
mod offers;
