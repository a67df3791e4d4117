//! A chain of two to six relays, passed their frames by hand, that loses its memory: a relay or the leader is switched on
//! again in the midst of something, frames come late, and the chain agrees all the same, to what it can keep.

mod hand;
mod late;
mod rebooted;
