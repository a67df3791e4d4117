//! The mission: everything the relays agree on before flight, validated once.
//!
//! | file | one idea |
//! | --- | --- |
//! | `config` | its parameters as plain numbers, and which of them was refused |
//! | `validated` | a mission whose parameters have been checked, and what follows of them |

mod config;
#[cfg(test)]
pub(crate) mod tests;
mod validated;

pub(crate) use config::MAX_RELAYS;
pub use config::MissionConfig;
pub use config::MissionError;
pub use config::{Band, Heading, Interference, Interferer, Profile};
pub use validated::Mission;
