//! Points and directions in earth-centred coordinates, and the ellipsoid through them.

use super::angle::sine_and_cosine;
use crate::geodetic::Geodetic;

/// WGS84: the semi-axis at the equator, m, and the squared eccentricity.
const A_M: f64 = 6_378_137.0;
const E2: f64 = 6.694_379_990_141_316e-3;

/// Earth-centred, earth-fixed: m, or a direction.
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

    /// The point of that latitude and longitude at height 0.
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

    /// The normal of the ellipsoid through this point.
    pub(super) fn normal(self) -> Self {
        Self {
            z: self.z / (1.0 - E2),
            ..self
        }
        .unit()
    }

    /// Of a point near the ellipsoid, by one step of Bowring's method; radians.
    pub(super) fn latitude_and_longitude(self) -> [f64; 2] {
        let p = libm::sqrt(self.x * self.x + self.y * self.y);
        // b / a; the latter is what the parametric latitude's tangent is p / z over.
        let flat = libm::sqrt(1.0 - E2);
        let length = libm::sqrt(self.z * self.z + flat * p * flat * p);
        let (sin, cos) = (self.z / length, flat * p / length);
        let z = self.z + E2 / (1.0 - E2) * flat * A_M * sin * sin * sin;
        let lat = libm::atan2(z, p - E2 * A_M * cos * cos * cos);
        [lat, libm::atan2(self.y, self.x)]
    }

    #[inline(never)] // called from many places, and what it calls is no instruction
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

/// The ellipsoid's radius of curvature where its normal is `normal`, in the direction `along`.
pub(super) fn radius(normal: Vector, along: Vector) -> f64 {
    let sin2 = normal.z * normal.z;
    let cos2 = 1.0 - sin2;
    let w2 = 1.0 - E2 * sin2;
    let prime = A_M / libm::sqrt(w2);
    let meridian = prime * (1.0 - E2) / w2;
    // At a pole both are the same.
    let north2 = if cos2 > 1e-12 {
        (along.z * along.z / cos2).min(1.0)
    } else {
        1.0
    };
    1.0 / (north2 / meridian + (1.0 - north2) / prime)
}
