//! The line on earth that the sites of a block make, and how fast the drone flies along it.

use uav_relay::flight::autopilot::carrot::Pace;
use uav_relay::flight::axis::{Axis, AxisError};
use uav_relay::{Geodetic, Mission};

use super::config::Sites;

/// What an autopilot is told along.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Course {
    /// The line from transmitter to receiver.
    pub axis: Axis,
    /// How fast the drone flies at most.
    pub pace: Pace,
}

/// What is wrong with the sites of a block.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum CourseError {
    /// They make no line.
    Axis(AxisError),
    /// They are this far apart along the ground, m, and the mission's distance is another.
    Distance(f64),
}

/// The sites of a block.
pub fn ends(sites: &Sites) -> uav_relay::Sites {
    let [tx, rx] = sites.ends.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
        lat_e7,
        lon_e7,
        amsl_mm,
    });
    uav_relay::Sites { tx, rx }
}

/// The course of a drone that flies `mission`, by sites that have been read.
///
/// # Errors
/// [`CourseError`] where the sites make no line, or not the mission's.
#[inline(never)] // its stack is given back before the relay needs some
pub fn course(sites: &Sites, mission: &Mission) -> Result<Course, CourseError> {
    let axis = Axis::between(ends(sites)).map_err(CourseError::Axis)?;
    if !axis.is_of(mission.config().distance_m) {
        return Err(CourseError::Distance(axis.distance_m()));
    }
    let default = Pace::default();
    let pace = Pace {
        speed_m_s: if sites.speed_m_s > 0.0 {
            sites.speed_m_s
        } else {
            default.speed_m_s
        },
        ..default
    };
    Ok(Course { axis, pace })
}
