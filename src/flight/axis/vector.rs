//! Vectors in earth-centred coordinates and the ellipsoid. Angles are in 1e-7 degrees; lines have a minimum and a maximum length.

use crate::geodetic::Geodetic;

/// Minimum length of a line, at which one unit of latitude turns it by a thousandth.
#[cfg_attr(
    not(feature = "internals"),
    allow(unreachable_pub, reason = "public with the feature `internals`")
)]
pub const SHORTEST_M: f64 = 10.0;

/// Maximum length of a line for which the accuracy is known.
#[cfg_attr(
    not(feature = "internals"),
    allow(unreachable_pub, reason = "public with the feature `internals`")
)]
pub const LONGEST_M: f64 = 100_000.0;

/// WGS84: semi-major axis, m, and squared eccentricity.
const A_M: f64 = 6_378_137.0;
const E2: f64 = 6.694_379_990_141_316e-3;

/// Earth-centred, earth-fixed vector: a position in m, or a direction.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Vector {
    x: f64,
    y: f64,
    pub(super) z: f64,
}

impl Vector {
    pub(super) const POLE: Self = Self {
        x: 0.0,
        y: 0.0,
        z: 1.0,
    };

    /// Returns the point with that latitude and longitude at height 0.
    pub(super) fn on_ellipsoid(point: Geodetic) -> Self {
        let [sin_lat, cos_lat] = sine_and_cosine(point.lat_e7);
        let [sin_lon, cos_lon] = sine_and_cosine(point.lon_e7);
        let prime = A_M / libm::sqrt(1.0 - E2 * sin_lat * sin_lat);
        Self {
            x: prime * cos_lat * cos_lon,
            y: prime * cos_lat * sin_lon,
            z: prime * (1.0 - E2) * sin_lat,
        }
    }

    pub(super) fn normal(self) -> Self {
        Self {
            z: self.z / (1.0 - E2),
            ..self
        }
        .unit()
    }

    /// Returns latitude and longitude of a point near the ellipsoid, by one step of Bowring's method. Radians.
    pub(super) fn latitude_and_longitude(self) -> [f64; 2] {
        let p = libm::sqrt(self.x * self.x + self.y * self.y);
        // b / a. The tangent of the parametric latitude is z / (p b / a).
        let flat = libm::sqrt(1.0 - E2);
        let length = libm::sqrt(self.z * self.z + flat * p * flat * p);
        let (sin, cos) = (self.z / length, flat * p / length);
        let z = self.z + E2 / (1.0 - E2) * flat * A_M * sin * sin * sin;
        let lat = libm::atan2(z, p - E2 * A_M * cos * cos * cos);
        [lat, libm::atan2(self.y, self.x)]
    }

    #[inline(never)] // called from many places, and an f64 operation is a call
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }

    #[inline(never)] // as `plus`
    pub(super) fn times(self, factor: f64) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    #[inline(never)] // as `plus`
    pub(super) fn minus(self, other: Self) -> Self {
        self.plus(other.times(-1.0))
    }

    pub(super) fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    pub(super) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    pub(super) fn length(self) -> f64 {
        libm::sqrt(self.dot(self))
    }

    pub(super) fn unit(self) -> Self {
        self.times(1.0 / self.length())
    }
}

/// Returns the ellipsoid's radius of curvature, m. It is taken where the normal is `normal`, in the direction `along`.
pub(super) fn radius(normal: Vector, along: Vector) -> f64 {
    let sin2 = normal.z * normal.z;
    let cos2 = 1.0 - sin2;
    let w2 = 1.0 - E2 * sin2;
    let prime = A_M / libm::sqrt(w2);
    let meridian = prime * (1.0 - E2) / w2;
    // At a pole both radii are equal.
    let north2 = if cos2 > 1e-12 {
        (along.z * along.z / cos2).min(1.0)
    } else {
        1.0
    };
    1.0 / (north2 / meridian + (1.0 - north2) / prime)
}

/// Radians in 10⁻⁷ degrees.
pub(super) const UNIT: f64 = core::f64::consts::PI / 1.8e9;

/// Returns sine and cosine of an angle in units of 10⁻⁷ degrees. The angle is reduced to an eighth of a turn exactly, in
/// integers; sine and cosine of the remainder are fdlibm's series, within a unit in the last place. A function for any f64 would
/// be ten times as large, for angles that no position has.
#[inline(never)] // called from several places
pub(super) fn sine_and_cosine(units: i32) -> [f64; 2] {
    const EIGHTH: i32 = 450_000_000;
    let eighths = units / EIGHTH;
    let quarters = eighths / 2 + eighths % 2;
    let x = f64::from(units - quarters * 2 * EIGHTH) * UNIT;
    let z = x * x;
    let series = |terms: [f64; 6]| terms.into_iter().fold(0.0, |sum, term| sum * z + term);
    let sin = x + x * z * series(SINE);
    let cos = 1.0 - z / 2.0 + z * z * series(COSINE);
    match quarters & 3 {
        0 => [sin, cos],
        1 => [cos, -sin],
        2 => [-sin, -cos],
        _ => [-cos, sin],
    }
}

/// Wraps an angle within (-3π, 3π) to -π to π.
pub(super) fn turned(angle: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    if angle > PI {
        angle - TAU
    } else if angle < -PI {
        angle + TAU
    } else {
        angle
    }
}

/// Coefficients of fdlibm's series for up to an eighth of a turn, highest power first.
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -1.666_666_666_666_663_2e-1,
];
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    4.166_666_666_666_66e-2,
];

#[cfg(test)]
mod angle_tests {
    use super::{UNIT, sine_and_cosine};

    #[test]
    fn sine_and_cosine_are_those_of_libm() {
        let mut units = i32::MIN;
        for step in 0_i32..20_000 {
            for units in [units, (step - 10_000) * 180_000] {
                let [sin, cos] = sine_and_cosine(units);
                // The conversion of the angle to f64 has a larger error than the series.
                let (expected_sin, expected_cos) = libm::sincos(f64::from(units) * UNIT);
                assert!((sin - expected_sin).abs() < 1e-15, "{units}");
                assert!((cos - expected_cos).abs() < 1e-15, "{units}");
            }
            units = units.wrapping_add(214_733);
        }
    }
}
