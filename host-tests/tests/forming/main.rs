//! Chains of two to six relays with reboots and late frames, passed by hand: they agree again.

mod hand;
mod late;
mod rebooted;
