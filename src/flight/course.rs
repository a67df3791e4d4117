//! The line on earth that a mission is flown along, and how fast the drone flies along it.

use super::autopilot::carrot::Pace;
use super::axis::{Axis, AxisError};
use crate::mission::Mission;
use crate::sites::Sites;

/// What an autopilot is told along.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Course {
    /// The line from transmitter to receiver.
    pub axis: Axis,
    /// How fast the drone flies at most.
    pub pace: Pace,
}

/// What is wrong with the sites of a mission.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CourseError {
    /// They make no line.
    Axis(AxisError),
    /// They are this far apart along the ground, m, and the mission's distance is another.
    Distance(f64),
}

impl Course {
    /// The course of a drone that flies `mission` between `sites`, at `speed_m_s` at most: 0.1 to 20 m/s, or 0 for that of
    /// [`Pace::default`]. Constant work.
    ///
    /// ```
    /// # mod paper { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/src/docs/paper.rs")); }
    /// # use paper::*;
    /// use uav_relay::flight::course::{Course, CourseError};
    /// use uav_relay::{Geodetic, Sites};
    ///
    /// let site = |lat, lon, amsl| Geodetic::from_degrees(lat, lon, amsl).expect("a place on earth");
    /// let sites = Sites { tx: site(47.40, 8.54, 420.0), rx: site(47.41, 8.55, 431.0) };
    /// // They are 1 344 m apart, and this mission is over 1 000.
    /// assert!(matches!(Course::try_new(sites, 5.0, &MISSION), Err(CourseError::Distance(_))));
    /// ```
    ///
    /// # Errors
    /// [`CourseError`] where the sites make no line, or not the mission's.
    #[inline(never)] // its stack is given back before the relay needs some
    pub fn try_new(sites: Sites, speed_m_s: f32, mission: &Mission) -> Result<Self, CourseError> {
        let axis = Axis::between(sites).map_err(CourseError::Axis)?;
        if !axis.is_of(mission.config().distance_m) {
            return Err(CourseError::Distance(axis.distance_m()));
        }
        let pace = Pace::of_speed(speed_m_s);
        Ok(Self { axis, pace })
    }
}

impl core::fmt::Display for CourseError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::Axis(error) => error.fmt(f),
            Self::Distance(along_m) => write!(
                f,
                "the sites are {along_m} m apart, the mission's distance is another"
            ),
        }
    }
}

impl core::error::Error for CourseError {}
