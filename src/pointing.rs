//! Antenna pointing: azimuth, elevation and distance from a relay to another position.
//!
//! Angles use micromath's `atan2`: a few instructions, with an error of at most 0.162 degrees, where a beam is ten degrees wide.
//! Distances use libm's square root, because micromath's has an error of 6 %. The errors are asserted by
//! `bearings_are_within_the_stated_error_all_around` in this file, and those of the two libraries by
//! `host-tests/tests/accuracy.rs`.

use micromath::F32;

use crate::mission::Mission;
use crate::place::Placement;

/// Maximum computation error of a [`Bearing`]'s azimuth and elevation, rad: 0.17 degrees.
#[cfg(test)]
const MAX_ERROR_RAD: f32 = 0.002_967;

/// Direction and distance of a position relative to a relay.
///
/// Frame: x toward the receiver, y to the side, h up, left-handed as in the paper: seen from above, y points to the right of x,
/// so azimuth grows clockwise. The combined pointing error of both angles is at most 0.23 degrees.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Bearing {
    /// Angle in the ground plane from x toward y, rad, within -pi to pi. The angle is 0 for a position straight above
    /// or below the relay.
    pub azimuth_rad: f32,
    /// Elevation: angle of the direction above the horizon, rad, within -pi/2 to pi/2.
    pub elevation_rad: f32,
    /// Straight distance to the position, m, above 0; relative error below 3e-7.
    pub distance_m: f32,
}

impl Bearing {
    /// Returns the bearing of a position `ahead_m` farther along x, `aside_m` along y, and `climb_m` up.
    ///
    /// `None` for a zero distance, and for values that are not finite or whose distance overflows.
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

    /// Returns the bearing of `to` seen from `from`; `None` if both are equal.
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

/// Returns sqrt(a^2 + b^2), without overflow or underflow of the squares. For that the larger of |a| and |b| is
/// factored out.
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

#[cfg(test)]
mod tests {
    extern crate std;

    use core::f64::consts::PI;

    use super::{Bearing, MAX_ERROR_RAD};
    use crate::mission::Mission;
    use crate::mission::tests::paper;
    use crate::place::Placement;

    /// Returns the errors of [`Bearing::new`] compared with f64. These are the errors of azimuth, elevation and
    /// direction, rad, and the relative error of the distance.
    fn errors(ahead_m: f32, aside_m: f32, climb_m: f32) -> [f64; 4] {
        let bearing = Bearing::new(ahead_m, aside_m, climb_m).unwrap();
        let [x, y, h] = [ahead_m, aside_m, climb_m].map(f64::from);
        let ground = libm::hypot(x, y);
        let distance = libm::hypot(ground, h);
        // A position straight above has no azimuth; the sign of a zero must not produce one.
        let azimuth = if ground > 0.0 { libm::atan2(y, x) } else { 0.0 };
        let elevation = libm::atan2(h, ground);
        let got_azimuth = f64::from(bearing.azimuth_rad);
        let got_elevation = f64::from(bearing.elevation_rad);
        assert!(got_azimuth.abs() <= PI + 1e-6 && got_elevation.abs() <= PI / 2.0 + 1e-6);
        let turn = (got_azimuth - azimuth).abs();
        let turn = turn.min(2.0 * PI - turn);
        let lift = (got_elevation - elevation).abs();
        // Chord between the two unit vectors, equal to the arc for angles this small.
        let unit = |a: f64, e: f64| {
            let (sin_a, cos_a) = libm::sincos(a);
            let (sin_e, cos_e) = libm::sincos(e);
            [cos_e * cos_a, cos_e * sin_a, sin_e]
        };
        let off = unit(azimuth, elevation)
            .into_iter()
            .zip(unit(got_azimuth, got_elevation))
            .map(|(a, b)| (a - b) * (a - b))
            .sum::<f64>();
        [
            turn,
            lift,
            libm::sqrt(off),
            (f64::from(bearing.distance_m) / distance - 1.0).abs(),
        ]
    }

    #[test]
    #[expect(
        clippy::cast_possible_truncation,
        reason = "the numbers under test are f32"
    )]
    fn bearings_are_within_the_stated_error_all_around() {
        let mut worst = [0.0_f64; 4];
        for turn in 0..7_200_u32 {
            let (sin_a, cos_a) = libm::sincos(f64::from(turn) * PI / 3_600.0);
            for lift in 0..=180_u32 {
                let (sin_e, cos_e) = libm::sincos(f64::from(lift) * PI / 180.0 - PI / 2.0);
                for scale in [1e-30, 700.0, 1e7] {
                    let [x, y, h] = [cos_e * cos_a, cos_e * sin_a, sin_e];
                    let found = errors((x * scale) as f32, (y * scale) as f32, (h * scale) as f32);
                    for (worst, found) in worst.iter_mut().zip(found) {
                        *worst = worst.max(found);
                    }
                }
            }
        }
        let [azimuth, elevation, direction, distance] = worst;
        let degrees = 180.0 / PI;
        std::println!(
            "azimuth {:.4}, elevation {:.4}, direction {:.4} degrees; distance {distance:.1e}",
            azimuth * degrees,
            elevation * degrees,
            direction * degrees
        );
        assert!(azimuth.max(elevation) < f64::from(MAX_ERROR_RAD));
        assert!(azimuth.max(elevation) * degrees < 0.17);
        assert!(direction * degrees < 0.23, "both angles together");
        assert!(distance < 3e-7);
        // Pointing error promised to the caller: half a degree.
        assert!(direction * degrees < 0.5);
    }

    #[test]
    fn the_axes_point_where_the_frame_says() {
        let quarter = core::f32::consts::FRAC_PI_2;
        let half = core::f32::consts::PI;
        for (to, azimuth, elevation) in [
            ((1.0, 0.0, 0.0), 0.0, 0.0),
            ((0.0, 1.0, 0.0), quarter, 0.0),
            ((-1.0, 0.0, 0.0), half, 0.0),
            ((0.0, -1.0, 0.0), -quarter, 0.0),
            ((0.0, 0.0, 1.0), 0.0, quarter),
            ((0.0, 0.0, -1.0), 0.0, -quarter),
            ((2.0, 2.0, 0.0), quarter / 2.0, 0.0),
            ((0.0, 3.0, 3.0), quarter, quarter / 2.0),
        ] {
            let bearing = Bearing::new(to.0, to.1, to.2).unwrap();
            assert!(
                (bearing.azimuth_rad - azimuth).abs() < 1e-6,
                "{to:?}: {bearing:?}"
            );
            assert!(
                (bearing.elevation_rad - elevation).abs() < 1e-6,
                "{to:?}: {bearing:?}"
            );
        }
    }

    #[test]
    fn an_invalid_position_has_no_bearing() {
        let nowhere = [
            (0.0, 0.0, 0.0),
            (-0.0, 0.0, -0.0),
            (f32::NAN, 1.0, 1.0),
            (1.0, f32::INFINITY, 1.0),
            (1.0, 1.0, f32::NEG_INFINITY),
            (f32::MAX, f32::MAX, 0.0),
        ];
        for (x, y, h) in nowhere {
            assert_eq!(Bearing::new(x, y, h), None, "{x} {y} {h}");
        }
        let tiny = f32::from_bits(1);
        assert!(Bearing::new(tiny, tiny, tiny).is_some_and(|b| b.azimuth_rad.is_finite()));
    }

    #[test]
    fn bearings_of_neighbours_and_of_the_interferer() {
        let mission = Mission::try_new(paper(1)).unwrap();
        let relay = Placement::on_line(350.0, 20.0);
        let receiver = Placement::on_line(1000.0, 0.0);
        let ahead = Bearing::between(relay, receiver).unwrap();
        assert!(ahead.azimuth_rad.abs() < 1e-6 && ahead.elevation_rad < 0.0);
        assert!((ahead.distance_m - 650.307_6).abs() < 1e-3);
        let behind = Bearing::between(receiver, relay).unwrap();
        assert!((behind.azimuth_rad.abs() - core::f32::consts::PI).abs() < 1e-6);
        assert!(behind.elevation_rad > 0.0);
        assert_eq!(Bearing::between(relay, relay), None);

        // The interferer stands at (500, 400): 150 m ahead and 400 m to the side of y, 20 m below.
        let aside = Bearing::to_interferer(relay, &mission).unwrap();
        assert!((aside.azimuth_rad - 1.212_025_7).abs() < MAX_ERROR_RAD);
        assert!((aside.elevation_rad + 0.046_783_2).abs() < MAX_ERROR_RAD);
        assert!((aside.distance_m - 427.668_1).abs() < 1e-3);
    }
}
