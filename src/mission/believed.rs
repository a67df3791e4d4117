//! A mission with another idea of its interference: what the relays have found, or nothing at all.

use super::error::MissionError;
use super::parts::{Interference, Interferer};
use super::validated::Mission;
use crate::power_ratio::PowerRatio;
use crate::sensing::belief::{Belief, Spread};

/// A hop half as long as the others.
const HALF_AS_LONG: f64 = 0.25;

impl Mission {
    /// The interferer, where it is known and not one that stands for none.
    pub const fn known_source(&self) -> Option<Interferer> {
        match self.config.interference {
            Interference::Source(interferer) => Some(interferer),
            _ => None,
        }
    }

    /// The same mission, whose interference is `own` or what is believed instead.
    ///
    /// # Errors
    /// [`MissionError`] where what is believed is out of range.
    pub(crate) fn believing(
        &self,
        own: Interference,
        belief: &Belief,
    ) -> Result<Self, MissionError> {
        let (interference, spread, receiver_w) = match *belief {
            Belief::Mission => (own, Spread::Even, 0.0),
            Belief::Unknown(spread) => (Interference::Unknown, spread, 0.0),
            Belief::Source { source, receiver_w } => {
                (Interference::Source(source), Spread::Even, receiver_w)
            }
        };
        let config = super::MissionConfig {
            interference,
            ..self.config
        };
        let mut mission = Self::try_new(config)?;
        if receiver_w > 0.0 {
            let eta = config.channel.eta();
            let heard = f64::from(receiver_w) + f64::from(config.noise_w);
            mission.receiver_gain_per_w = 1.0 / (eta * heard);
        }
        match spread {
            Spread::Even => {}
            Spread::TowardTx => {
                mission.tx_gain = PowerRatio::new(mission.tx_gain.wide() * HALF_AS_LONG);
            }
            Spread::TowardRx => mission.receiver_gain_per_w *= HALF_AS_LONG,
        }
        Ok(mission)
    }
}
