//! Whether a mission can be flown along a line on earth, and within a relay's own geofence.

#[cfg(feature = "upload")]
use crate::sites::Sites;

/// Whether a mission over `distance_m` metres can be flown between these. A relay that was built without the feature `flight` flies along
/// no line on earth, and finds nothing wrong.
#[cfg(all(feature = "upload", not(feature = "flight")))]
#[expect(clippy::unnecessary_wraps, reason = "as with a line")]
pub(crate) const fn check(_: Sites, _: f32) -> Result<(), LineError> {
    Ok(())
}

/// Whether a mission over `distance_m` metres can be flown between these.
#[cfg(all(feature = "upload", feature = "flight"))]
pub(crate) fn check(sites: Sites, distance_m: f32) -> Result<(), LineError> {
    let axis = crate::flight::axis::Axis::between(sites).map_err(|_| LineError::Sites)?;
    if axis.is_of(distance_m) {
        Ok(())
    } else {
        Err(LineError::Distance)
    }
}

/// Why a newer mission cannot be flown along a line on earth, or within the relay's own geofence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum LineError {
    /// Its distance is not that between its sites; or it has none, and its distance is not the one that was loaded, at a relay whose
    /// line was loaded: `Settings::sited`.
    Distance,
    /// Its sites are nearer to each other than 10 m or farther apart than 100 km.
    Sites,
    /// It has altitudes outside of the relay's own geofence, [`GuardConfig::fence`](crate::guard::config::GuardConfig).
    Altitude,
    /// It has room to the side outside of that.
    Lateral,
    /// It is over a distance that reaches out of that, between the sites that the relays were loaded with or without any.
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
