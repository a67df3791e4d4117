//! The parameters of a mission as plain numbers.

use super::error::MissionError;
use super::parts::{Band, Interference, Profile};
use crate::channel::Channel;

/// The most relays a mission may have; addresses on the wire are 12 bits wide.
pub const MAX_RELAYS: u16 = 1000;

/// Two steps of an f32 just below the distance, as a part of it: relays that all gather at its end still stand apart.
pub(super) const FINEST_STEP: f32 = 1.0 / 4_194_304.0;

/// What rounding may take from a step between two places, as a part of the distance.
pub(super) const ROUNDING: f32 = 2.0 * FINEST_STEP;

/// The parameters of a mission, as plain numbers; [`Mission::try_new`](crate::Mission::try_new) checks them.
///
/// Frame: x runs along the ground from the transmitter (0) to the receiver (`distance_m`), y to its right as seen from above,
/// altitude is height above the ground.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MissionConfig {
    /// Number of relays N, 1 to [`MAX_RELAYS`].
    pub relays: u16,
    /// Distance D from transmitter to receiver, m: 1 to 1e6.
    pub distance_m: f32,
    /// Least distance between two relays, m: 0 to 1e5.
    pub min_separation_m: f32,
    /// Transmit power of the ground transmitter, W: 1e-6 to 1e6.
    pub tx_power_w: f32,
    /// What every relay holds that was given nothing of its own.
    pub common: Profile,
    /// The altitudes that methods which choose altitudes may choose from, within 0.1 to 1e5; `common.altitude_m` is one of them.
    pub band: Band,
    /// The room beside the line that the joint method may use: y within -1e5 to 1e5, 0 among them.
    pub lateral: Band,
    /// Path loss of the three kinds of link.
    pub channel: Channel,
    /// What degrades the hops.
    pub interference: Interference,
    /// Noise power at the input of every receiver, W: 0 to 1, and at most 1e12 times what of the interferer arrives a metre from it. 0 is
    /// the paper's receiver; with any other number what is called SIR is the SINR, signal over interference and noise.
    pub noise_w: f32,
    /// How close to the best SIR is close enough, relative: 1e-6 to 0.1.
    pub tolerance: f32,
}

impl MissionConfig {
    /// Whether that many relays are allowed, and fit.
    pub(super) const fn room(&self) -> Result<(), MissionError> {
        if self.relays < 1 || self.relays > MAX_RELAYS {
            return Err(MissionError::Relays);
        }
        let step = self.min_separation_m + self.distance_m * ROUNDING;
        if (self.relays - 1) as f32 * step > self.distance_m {
            return Err(MissionError::TooManyForDistance);
        }
        Ok(())
    }
}
