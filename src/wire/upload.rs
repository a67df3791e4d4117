//! A mission that replaces the one the relays took off with: what an operator sends, and what a relay keeps across a reboot.
//!
//! An upload has a *version*, by which the newest is told, and the digest of its *base*, the mission that was loaded before
//! flight: relays that were loaded with another one refuse it. It keeps the number of relays, because that is what nodes are
//! numbered by, and it is of one interferer: a field does not fit into a frame.

use super::digest::{MissionId, between, digest, of};
use super::message::UPLOAD;
use crate::line::{self, LineError};
use crate::mission::{Interference, Mission, MissionConfig, MissionError};
use crate::sites::Sites;

/// A mission with a version.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    version: u16,
    base: u16,
    /// Checked: a mission can be made of it, with one interferer.
    config: MissionConfig,
    /// Where it is flown, if not between the sites that the relays were loaded with. On earth; whether they fit the mission is for
    /// every relay to say.
    sites: Option<Sites>,
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
    /// There is no line on earth for it.
    Line(LineError),
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
            Self::Line(error) => return error.fmt(f),
            Self::Old => "version must be above that of the mission held",
            Self::Unsigned => "uploads need signed frames",
            Self::Begun => "the relay has begun: it can only be handed what is newer",
        })
    }
}

impl core::error::Error for UploadError {}

impl Upload {
    /// Bytes of an encoded upload.
    pub const LENGTH: usize = UPLOAD;

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
        let config = MissionConfig { channel, ..config };
        Self::checked(version, digest(base), config, None)
    }

    /// The same, flown between `sites`: relays turn places into latitudes and longitudes along the line between these from then on. An
    /// upload without sites is flown between those that the relays were loaded with, wherever they flew since.
    ///
    /// # Errors
    /// [`UploadError::Line`] where they make no line, or not one as long as the mission's distance.
    pub fn with_sites(self, sites: Sites) -> Result<Self, UploadError> {
        let valid = sites.are_valid().then_some(sites);
        let sites = valid.ok_or(UploadError::Line(LineError::Sites))?;
        line::check(sites, self.config.distance_m).map_err(UploadError::Line)?;
        Ok(Self {
            sites: Some(sites),
            ..self
        })
    }

    /// Of parameters as they are.
    pub(super) fn checked(
        version: u16,
        base: u16,
        config: MissionConfig,
        sites: Option<Sites>,
    ) -> Result<Self, UploadError> {
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
            sites,
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

    /// Between which sites it is flown; `None` for those that the relays were loaded with.
    pub const fn sites(&self) -> Option<Sites> {
        self.sites
    }

    /// By what relays tell which mission they hold.
    pub fn id(&self) -> MissionId {
        MissionId {
            version: self.version,
            digest: between(of(&self.config), self.sites),
        }
    }
}
