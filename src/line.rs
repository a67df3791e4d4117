//! Check that a mission fits the line between its sites and a relay's own geofence.

#[cfg(feature = "upload")]
use crate::sites::Sites;

/// Accepts every mission, since a relay without the feature `flight` has no line on earth.
#[cfg(all(feature = "upload", not(feature = "flight")))]
#[expect(clippy::unnecessary_wraps, reason = "as with a line")]
pub(crate) const fn check(_: Sites, _: f32) -> Result<(), LineError> {
    Ok(())
}

/// Checks that a mission over `distance_m` metres fits the distance between `sites`.
#[cfg(all(feature = "upload", feature = "flight"))]
pub(crate) fn check(sites: Sites, distance_m: f32) -> Result<(), LineError> {
    let axis = crate::flight::axis::Axis::between(sites).map_err(|_| LineError::Sites)?;
    if axis.is_of(distance_m) {
        Ok(())
    } else {
        Err(LineError::Distance)
    }
}

/// Reason why a newer mission does not fit its line on earth or the relay's own geofence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LineError {
    /// The mission's distance differs from that between its sites. Or it has no sites, and its distance differs from the
    /// configured one at a relay with `Settings::sited`.
    Distance,
    /// The mission's sites are less than 10 m or more than 100 km apart.
    Sites,
    /// The mission's altitudes exceed the relay's own geofence, [`GuardConfig::fence`](crate::guard::config::GuardConfig).
    Altitude,
    /// The mission's lateral band exceeds the geofence.
    Lateral,
    /// The mission's distance exceeds the geofence, with or without sites of its own.
    Length,
}

impl core::fmt::Display for LineError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Distance => "its distance must be that between its sites; without sites of its own, between those that the relays were loaded with",
            Self::Sites => "its sites must be on earth, 10 m to 100 km apart",
            Self::Altitude => "its altitudes must be within the relay's own geofence",
            Self::Lateral => "its room to the side must be within the relay's own geofence",
            Self::Length => "its distance must be within the relay's own geofence",
        })
    }
}

impl core::error::Error for LineError {}
