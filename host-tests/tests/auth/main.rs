//! Authenticated chains: same positions as plain chains, and only new frames of members are accepted.
//!
//! Random tests use `SEED` (1 if unset), which each prints, and `COUNT`, the number of attacks.

mod attack;
mod chain;
mod document;
mod edges;
mod frames;
mod handshakes;
mod kinds;
mod net;
mod offers;
