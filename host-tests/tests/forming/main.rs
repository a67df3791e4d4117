//! Chains of two to six relays with reboots and late frames, passed by hand: the relays agree again, on the old result if
//! possible.

mod hand;
mod late;
mod rebooted;
