//! Planning before a flight: optimal position of one relay, and number of relays for a link. Not used on board.
//!
//! | purpose | files |
//! | --- | --- |
//! | one relay | `single`: Theorems 1 to 3, Algorithm 3 |
//! | one relay of a chain, without messages | [`Mission::silent_place`](crate::Mission::silent_place) |
//! | number of relays | [`fleet`]: the minimum for a target, and the maximum SIR of any number |

pub mod fleet;
#[cfg(not(feature = "internals"))]
mod single;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod single;
