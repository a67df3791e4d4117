//! Uploaded mission, which replaces the mission loaded before flight. Also the format in which a relay stores it.
//!
//! An upload has a *version*, which identifies the newest one, and the digest of its *base*, the mission loaded before flight;
//! relays with another base reject it. It keeps the number of relays, because nodes are numbered by it, and it has one
//! interferer, because a field does not fit into a frame.

use super::digest::MissionId;
use super::digest::{between, digest, of};
use crate::geodetic::{LineError, Sites};
use crate::mission::{Interference, Mission, MissionConfig, MissionError};

/// Mission that the operator uploads in flight, with a version. It replaces the mission loaded before flight.
#[cfg(feature = "upload")]
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Upload {
    version: u16,
    base: u16,
    /// Valid parameters of the uploaded mission. It has a single interferer: a mission with an interference field
    /// cannot be uploaded.
    config: MissionConfig,
    /// Positions of Tx and Rx in the uploaded mission; `None` to use the relays' configured positions. The coordinates
    /// are valid, but each relay still checks the positions against its mission and settings.
    sites: Option<Sites>,
}

/// Reason why an uploaded mission is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum UploadError {
    /// The version of the upload is 0, which identifies the mission loaded before flight.
    Version,
    /// The number of relays differs from the number in the mission loaded before flight.
    Relays,
    /// The mission loaded before flight, or the uploaded mission, has an interference field. A field is a known
    /// distribution of the interference along x.
    Field,
    /// A parameter of the new mission is outside its range.
    Mission(MissionError),
    /// The upload is for relays that loaded a different mission before flight than this relay.
    Base,
    /// The uploaded mission, or its positions of Tx and Rx, are rejected: see [`LineError`]. Possible reasons are
    /// invalid positions, a wrong distance between them, the geofence, and the settings.
    Line(LineError),
    /// The relay already has the uploaded mission or a newer mission.
    Old,
    /// Frames are not signed, because `Settings::auth` is not set.
    Unsigned,
    /// The relay has already started: use `Relay::handle_upload`.
    Begun,
}

impl core::fmt::Display for UploadError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Version => "the upload's version must be within 1 to 65535",
            Self::Relays => {
                "an upload must have as many relays as the mission that it replaces"
            }
            Self::Field => {
                "an upload, and the mission that it replaces, must have one interferer and no interference field"
            }
            Self::Mission(error) => return error.fmt(f),
            Self::Base => "the upload is for relays that were loaded with another mission",
            Self::Line(error) => return error.fmt(f),
            Self::Old => "the upload's version must be above the version of the present mission",
            Self::Unsigned => "uploads need signed frames: give the relay a key",
            Self::Begun => "a stored upload must be resumed before the relay starts",
        })
    }
}

impl core::error::Error for UploadError {}

#[cfg(feature = "upload")]
impl Upload {
    /// Creates an upload of `config`, for relays that loaded `base` before flight. `version` is 1 to 65535.
    ///
    /// The path-loss factor eta of links to the ground is clamped between the factors with line of sight (`mu_los`) and
    /// without (`mu_nlos`), because rounding can put eta outside of this range.
    ///
    /// # Errors
    /// [`UploadError`] names the problem.
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

    /// Adds the positions of Tx and Rx to the uploaded mission. From these positions the relays compute the latitudes
    /// and longitudes of their setpoints.
    ///
    /// Without this call, relays use the Tx and Rx positions of their configuration, even if an earlier upload had
    /// different positions.
    ///
    /// # Errors
    /// [`UploadError::Line`] if the positions define no line, or a line whose length is not the mission's distance.
    pub fn with_sites(self, sites: Sites) -> Result<Self, UploadError> {
        let valid = sites.are_valid().then_some(sites);
        let sites = valid.ok_or(UploadError::Line(LineError::Sites))?;
        check_line(sites, self.config.distance_m).map_err(UploadError::Line)?;
        Ok(Self {
            sites: Some(sites),
            ..self
        })
    }

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

    /// Version of the uploaded mission, from 1; the larger version is newer.
    pub const fn version(&self) -> u16 {
        self.version
    }

    /// Digest of the mission that the relays loaded before flight. The upload replaces this mission.
    pub const fn base(&self) -> u16 {
        self.base
    }

    /// Returns the uploaded mission's parameters, which [`Mission::try_new`] accepts.
    pub const fn config(&self) -> &MissionConfig {
        &self.config
    }

    /// Positions of Tx and Rx in the upload. `None` if relays must use the positions of their configuration.
    pub const fn sites(&self) -> Option<Sites> {
        self.sites
    }

    /// Identifier of the uploaded mission: its version and its digest.
    pub fn id(&self) -> MissionId {
        MissionId {
            version: self.version,
            digest: between(of(&self.config), self.sites),
        }
    }
}

/// Mission uploaded by the operator. Without the feature `upload` the type has no values. The compiler therefore drops
/// all code that handles an uploaded mission.
#[cfg(not(feature = "upload"))]
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Upload {}

#[cfg(not(feature = "upload"))]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "as with the feature")]
impl Upload {
    pub(crate) const fn base(&self) -> u16 {
        match *self {}
    }

    pub(crate) const fn config(&self) -> &MissionConfig {
        match *self {}
    }

    pub(crate) const fn sites(&self) -> Option<Sites> {
        match *self {}
    }

    pub(crate) const fn id(&self) -> MissionId {
        match *self {}
    }
}

/// Checks that the distance between `sites`, the positions of Tx and Rx, is `distance_m`. Without the feature
/// `flight` the distance cannot be computed, and all valid positions are accepted.
pub(crate) fn check_line(sites: Sites, distance_m: f32) -> Result<(), LineError> {
    #[cfg(feature = "flight")]
    let fits = crate::flight::axis::Axis::between(sites)
        .map_err(|_| LineError::Sites)?
        .is_of(distance_m);
    #[cfg(not(feature = "flight"))]
    let fits = sites.are_valid() && distance_m > 0.0;
    if fits {
        Ok(())
    } else {
        Err(LineError::Distance)
    }
}
