//! Planning before a flight: number of relays for a link. Not used on board.
//!
//! | purpose | files |
//! | --- | --- |
//! | one relay of a chain, without messages | [`Mission::silent_place`](crate::Mission::silent_place) |
//! | number of relays | [`fleet`]: the minimum for a target, and the maximum SIR of any number |

pub mod fleet;
