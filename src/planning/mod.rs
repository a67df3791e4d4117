//! The placement maths of before a flight: one relay alone, and how many relays a link needs. No message, and nothing that flies.
//!
//! | for | files |
//! | --- | --- |
//! | one relay alone | `single`: Theorems 1 to 3, Algorithm 3 |
//! | one relay of a chain, without a message | [`Mission::silent_place`](crate::Mission::silent_place) |
//! | how many relays | [`fleet`]: the fewest for a target, and the most any number can have |

pub mod fleet;
#[cfg(not(feature = "internals"))]
mod single;
#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod single;
