//! Line on earth along which a mission is flown, and the drone's speed limit.

use super::autopilot::carrot::Pace;
use super::axis::{Axis, AxisError};
use crate::geodetic::Sites;
use crate::mission::Mission;

/// Course of a drone: the line on earth from Tx to Rx, along which it flies, and its speed limit.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Course {
    /// Line on earth from transmitter to receiver.
    pub axis: Axis,
    /// Speed limit and acceleration of the drone.
    pub pace: Pace,
}

/// Reason why the positions of Tx and Rx do not fit the mission, or define no line.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum CourseError {
    /// The positions of the transmitter and the receiver do not define a line.
    Axis(AxisError),
    /// The distance between Tx and Rx along the ground, m, differs from the mission's distance.
    Distance(f64),
}

impl Course {
    /// Returns the course of a drone that flies `mission`: its line on earth and its speed limit.
    ///
    /// `sites` are the positions of Tx and Rx. `speed_m_s` is the speed limit, m/s: 0.1 to 20, or 0 for that of
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
    /// // The sites are 1 344 m apart, but the mission's distance is 1 000 m.
    /// assert!(matches!(Course::try_new(sites, 5.0, &MISSION), Err(CourseError::Distance(_))));
    /// ```
    ///
    /// # Errors
    /// [`CourseError`] if Tx and Rx define no line, or a line whose length differs from the mission's distance.
    #[inline(never)] // frees its stack before the relay needs some
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
                "Tx and Rx are {along_m} m apart: the mission's distance must be the same"
            ),
        }
    }
}

impl core::error::Error for CourseError {}
