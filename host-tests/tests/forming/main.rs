//! Chains of two to six relays with reboots and late frames agree again. The tests themselves deliver the frames.

mod hand;
mod late;
mod rebooted;
