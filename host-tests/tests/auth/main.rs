//! Authenticated chains: they settle where others do, and nothing that is not a member's, and new, is ever taken.
//!
//! Random tests draw from the environment variable `SEED` (1 if unset), which each of them prints; `COUNT` is the number of
//! attacks.

mod attack;
mod chain;
mod document;
mod edges;
mod frames;
mod handshakes;
mod kinds;
mod net;
mod offers;
