//! A mission that replaces the one the relays took off with: what an operator sends, and what a relay keeps across a reboot.
//!
//! An upload has a *version*, by which the newest is told, and the digest of its *base*, the mission that was loaded before
//! flight: relays that were loaded with another one refuse it. It keeps the number of relays, because that is what nodes are
//! numbered by, and it is of one interferer: a field does not fit into a frame.

use serde::{Deserialize, Serialize};

use super::body::Pass;
use super::digest::{MissionId, digest, of};
use super::message::Message;
use crate::channel::Channel;
use crate::mission::{
    Band, Interference, Interferer, Mission, MissionConfig, MissionError, Profile,
};

/// Bytes of an upload as it is stored; those of the body of an offer.
pub const LENGTH: usize = 83;

/// A mission with a version.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    version: u16,
    base: u16,
    /// Checked: a mission can be made of it, with one interferer.
    config: MissionConfig,
}

/// Why an upload was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum UploadError {
    /// The version is 0, which is that of the mission loaded before flight.
    Version,
    /// The number of relays is not that of the base.
    Relays,
    /// The base or the new mission is in a field of interference, and not of one interferer.
    Field,
    /// A parameter is outside its range.
    Mission(MissionError),
    /// It is for relays that were loaded with another mission.
    Base,
    /// A mission as new as that is held already.
    Old,
    /// Frames are not signed: `Settings::auth` is not set.
    Unsigned,
    /// The relay has begun already: what is newer is for `Relay::handle_upload`.
    Begun,
}

impl core::fmt::Display for UploadError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Version => "version must be within 1 to 65535",
            Self::Relays => "an upload must keep the number of relays",
            Self::Field => {
                "an upload, and the mission it replaces, must have one interferer and no field"
            }
            Self::Mission(error) => return error.fmt(f),
            Self::Base => "the upload is for relays that were loaded with another mission",
            Self::Old => "version must be above that of the mission held",
            Self::Unsigned => "uploads need signed frames",
            Self::Begun => "the relay has begun: it can only be handed what is newer",
        })
    }
}

impl core::error::Error for UploadError {}

impl Upload {
    /// `config` as version `version`, 1 to 65535, for relays that were loaded with `base`. Where rounding has put eta of its channel
    /// a bit outside of the other two factors, it becomes the nearer of them.
    ///
    /// # Errors
    /// [`UploadError`] names what is wrong.
    pub fn new(base: &Mission, version: u16, config: MissionConfig) -> Result<Self, UploadError> {
        if base.field().is_some() {
            return Err(UploadError::Field);
        }
        if config.relays != base.relays() {
            return Err(UploadError::Relays);
        }
        let channel = config.channel.ordered();
        Self::checked(version, digest(base), MissionConfig { channel, ..config })
    }

    fn checked(version: u16, base: u16, config: MissionConfig) -> Result<Self, UploadError> {
        if version == 0 {
            return Err(UploadError::Version);
        }
        if matches!(config.interference, Interference::Field(_)) {
            return Err(UploadError::Field);
        }
        Mission::try_new(config).map_err(UploadError::Mission)?;
        Ok(Self {
            version,
            base,
            config,
        })
    }

    /// Its number, from 1: the larger one is the newer one.
    pub const fn version(&self) -> u16 {
        self.version
    }

    /// The digest of the mission that it replaces, as that was loaded before flight.
    pub const fn base(&self) -> u16 {
        self.base
    }

    /// Its parameters, in which [`Mission::try_new`] finds nothing wrong.
    pub const fn config(&self) -> &MissionConfig {
        &self.config
    }

    /// By what relays tell which mission they hold.
    pub fn id(&self) -> MissionId {
        MissionId {
            version: self.version,
            digest: of(&self.config),
        }
    }

    /// Writes it as it is to be stored, [`LENGTH`] bytes, into `buffer`; `None` if it does not fit.
    pub fn encode(&self, buffer: &mut [u8]) -> Option<usize> {
        Message::Offer(*self).encode(buffer)
    }

    /// Reads it back; `None` if `bytes` are anything but one upload in range. Whether they were stored whole is for a check
    /// sequence around them to say.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        match Message::decode(bytes) {
            Ok(Message::Offer(upload)) => Some(upload),
            _ => None,
        }
    }
}

/// The wire form: version and base, and the numbers in the order of the digest, the bands last.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(super) struct Terms {
    /// The number is the version, the mission the base.
    pass: Pass,
    relays: [u8; 2],
    numbers: [f32; 9],
    factors: [f64; 3],
    bands: [f32; 4],
}

impl Terms {
    pub(super) fn of(upload: &Upload) -> Self {
        let c = &upload.config;
        let (power_w, x_m, y_m) = match c.interference {
            Interference::Source(at) => (at.power_w, at.x_m, at.y_m),
            Interference::Field(_) => (0.0, 0.0, 0.0),
        };
        Self {
            pass: Pass::new(upload.version, upload.base),
            relays: c.relays.to_le_bytes(),
            numbers: [
                c.distance_m,
                c.min_separation_m,
                c.tx_power_w,
                c.common.altitude_m,
                c.common.power_w,
                power_w,
                x_m,
                y_m,
                c.tolerance,
            ],
            factors: [c.channel.mu_los(), c.channel.mu_nlos(), c.channel.eta()],
            bands: [
                c.band.least_m,
                c.band.most_m,
                c.lateral.least_m,
                c.lateral.most_m,
            ],
        }
    }

    pub(super) fn upload(self) -> Option<Upload> {
        let [mu_los, mu_nlos, eta] = self.factors;
        let [least_m, most_m, left_m, right_m] = self.bands;
        let [
            distance_m,
            min_separation_m,
            tx_power_w,
            altitude_m,
            power_w,
            from_w,
            x_m,
            y_m,
            tolerance,
        ] = self.numbers;
        let config = MissionConfig {
            relays: u16::from_le_bytes(self.relays),
            distance_m,
            min_separation_m,
            tx_power_w,
            common: Profile {
                altitude_m,
                power_w,
            },
            band: Band { least_m, most_m },
            lateral: Band {
                least_m: left_m,
                most_m: right_m,
            },
            channel: Channel::from_factors(mu_los, mu_nlos, eta)?,
            interference: Interference::Source(Interferer {
                power_w: from_w,
                x_m,
                y_m,
            }),
            tolerance,
        };
        Upload::checked(self.pass.number(), self.pass.mission(), config).ok()
    }
}
