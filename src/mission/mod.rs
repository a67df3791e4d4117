//! The mission: everything the relays agree on before flight, validated once.
//!
//! | file | one idea |
//! | --- | --- |
//! | `config`, `parts` | its parameters as plain numbers |
//! | `error` | which of them was refused |
//! | `validated` | a mission whose parameters have been checked |
//! | `believed`, `unknown` | what the relays have found instead of its interference; nothing at all |
//! | `gains` | what transmit powers are worth on its hops |
//! | `steps` | the least steps between its relays |

mod believed;
mod config;
mod error;
mod gains;
mod parts;
mod steps;
#[cfg(test)]
pub(crate) mod tests;
mod unknown;
mod validated;

pub use config::{MAX_RELAYS, MissionConfig};
pub use error::MissionError;
pub use parts::{Band, Heading, Interference, Interferer, Profile};
pub use validated::Mission;
