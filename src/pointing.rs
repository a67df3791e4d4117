//! Antenna pointing: azimuth, elevation and distance from a relay to another position.
//!
//! Angles use micromath's fast `atan2`. Its error is at most 0.162 degrees, while an antenna beam is ten degrees wide.
//! Distances use libm's square root, because micromath's has an error of 6 %. The test
//! `bearings_are_within_the_stated_error_all_around` in `host-tests/tests/accuracy/` asserts the errors.

use micromath::F32;

use crate::mission::Mission;
use crate::place::Placement;

/// Direction and distance of a position relative to a relay.
///
/// Frame: x toward the receiver, y to the right for an observer who looks along x, h up. So the frame is left-handed,
/// as in the paper, and azimuth grows clockwise. The direction that the two angles give has an error of at most 0.23
/// degrees.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bearing {
    /// Angle in the ground plane from x toward y, rad, within -pi to pi. The angle is 0 for a position straight above
    /// or below the relay.
    pub azimuth_rad: f32,
    /// Elevation: angle of the direction above the horizon, rad, within -pi/2 to pi/2.
    pub elevation_rad: f32,
    /// Distance to the position in a straight line, m, above 0; relative error below 3e-7.
    pub distance_m: f32,
}

impl Bearing {
    /// Returns the bearing of a position `ahead_m` along x, `aside_m` along y, `climb_m` up from a relay.
    ///
    /// `None` if the distance is zero or overflows, or if a value is not finite.
    ///
    /// Work: two square roots, two approximated arc tangents and a few divisions.
    pub fn new(ahead_m: f32, aside_m: f32, climb_m: f32) -> Option<Self> {
        if ![ahead_m, aside_m, climb_m].into_iter().all(f32::is_finite) {
            return None;
        }
        let ground_m = length(ahead_m, aside_m);
        let distance_m = length(ground_m, climb_m);
        (distance_m > 0.0 && distance_m.is_finite()).then(|| Self {
            azimuth_rad: angle(aside_m, ahead_m),
            elevation_rad: angle(climb_m, ground_m),
            distance_m,
        })
    }

    /// Returns the bearing of `to` seen from `from`; `None` if the two positions are equal.
    ///
    /// The ground stations are placements too, at altitude 0.
    ///
    /// ```
    /// use uav_relay::Placement;
    /// use uav_relay::pointing::Bearing;
    ///
    /// let (here, there) = (Placement::on_line(300.0, 20.0), Placement::on_line(400.0, 20.0));
    /// let bearing = Bearing::between(here, there).expect("two places");
    /// assert!(bearing.azimuth_rad.abs() < 1e-3, "along the line");
    /// assert!((bearing.distance_m - 100.0).abs() < 0.1);
    /// ```
    pub fn between(from: Placement, to: Placement) -> Option<Self> {
        Self::new(
            to.x_m - from.x_m,
            to.y_m - from.y_m,
            to.altitude_m - from.altitude_m,
        )
    }

    /// Returns azimuth, elevation and distance of the mission's interferer as seen from `from`.
    ///
    /// The interferer is on the ground. A directional antenna can steer a null toward it.
    ///
    /// The result is `None` if the relay is at the interferer's position, or the interference has no position.
    pub fn to_interferer(from: Placement, mission: &Mission) -> Option<Self> {
        let interferer = mission.interferer()?;
        Self::new(
            interferer.x_m - from.x_m,
            interferer.y_m - from.y_m,
            -from.altitude_m,
        )
    }
}

/// Returns sqrt(a^2 + b^2), without overflow or underflow of the squares.
fn length(a: f32, b: f32) -> f32 {
    let large = a.abs().max(b.abs());
    if large > 0.0 {
        let ratio = a.abs().min(b.abs()) / large;
        large * libm::sqrtf(1.0 + ratio * ratio)
    } else {
        0.0
    }
}

/// Returns the angle whose tangent is `opposite` / `adjacent`, rad. The two signs give the quadrant. 0 if both
/// arguments are 0.
fn angle(opposite: f32, adjacent: f32) -> f32 {
    let large = opposite.abs().max(adjacent.abs());
    if large > 0.0 {
        // The approximation squares both, which would give 0 / 0 for small values.
        F32(opposite / large).atan2(F32(adjacent / large)).0
    } else {
        0.0
    }
}
