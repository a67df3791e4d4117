//! The mission: everything the relays agree on before flight, validated once.
//!
//! | file | content |
//! | --- | --- |
//! | `config` | the parameters as plain numbers, and the error that names a rejected one |
//! | `validated` | a mission with checked parameters, and quantities derived from them |

mod config;
#[cfg(test)]
pub(crate) mod tests;
mod validated;

pub(crate) use config::MAX_RELAYS;
pub use config::MissionConfig;
pub use config::MissionError;
pub use config::{Band, Heading, Interference, Interferer, Profile};
pub use validated::Mission;
