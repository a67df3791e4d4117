//! Line from transmitter to receiver on earth: converts geodetic to mission positions and back.
//!
//! # Derivation
//! Everything is on the WGS84 ellipsoid in earth-centred coordinates, in f64. T and R are the two sites and P is the point, all
//! three at height 0 above the ellipsoid: a height would shift x, by 1.2 m at 10 km for 1 500 m. Let m = (T + R) / 2 be the
//! midpoint of the chord C = |R - T|, u its direction, *up* the ellipsoid's normal at m made perpendicular to u, and r the radius
//! of curvature of the ellipsoid at m in the direction u (Euler: 1/r = cos²α / M + sin²α / N). Then
//!
//! - c = (P - m) · u is P's coordinate along the chord, and x = D / 2 + c (1 + (c/r)² / 6), the longer arc,
//! - y = (P - m) · (u × up), to the right of the line,
//! - D is x at R: twice C / 2 (1 + (C / 2r)² / 6).
//!
//! Inverse: c is the sine's series at x - D / 2, P is m + c u + y (u × up) + z up with the sagitta z = (C²/4 - c² - y²) / 2r, and
//! one step of Bowring's method gives its latitude.
//!
//! # Height
//! h is above the *datum* of the mission, the straight line from the ground at Tx to the ground at Rx:
//! AMSL = tx + (rx - tx) x / D + h. A height above the sea follows the earth's curvature.
//!
//! # Distance of a far point
//! A point too far away for a position still has a distance from the line. Consider the plane through the point and the
//! line's axis of rotation, at the centre of curvature. It meets the line at the foot: φ = atan2((P - m) · u, (P - m) ·
//! up + r), x - D / 2 = r φ, clamped to the two ends. The distance is the chord from the foot to the point, scaled by
//! the ratio of arc to chord of a sphere, at the angle between the two points at the earth's centre.
//!
//! # Accuracy
//! Error compared with geodesics, for points up to 500 m beside the line: at most 1 mm for lines up to 10 km, 5 mm for
//! 100 km (`positions_agree_with_geodesics` in `host-tests/tests/axis`). Round trip: within one unit of [`Geodetic`].
//! Distance of a far point: within 0.2 % anywhere on earth, and 0.002 % up to 1000 km
//! (`distances_agree_with_geodesics`, in the same folder).

use crate::geodetic::{Geodetic, Sites, to_integer};
use crate::place::Placement;

/// Maximum difference between a mission's distance and the length of its line from Tx to Rx, m. Allows for rounding.
const TOLERANCE_M: f64 = 0.05;

/// Reason why the positions of Tx and Rx define no line.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisError {
    /// The latitude or longitude of the transmitter is not on earth.
    Tx(Geodetic),
    /// The latitude or longitude of the receiver is not on earth.
    Rx(Geodetic),
    /// The distance between transmitter and receiver is less than 10 m.
    TooShort {
        /// Straight distance between transmitter and receiver, m.
        distance_m: f64,
    },
    /// The distance between transmitter and receiver is more than 100 km.
    TooLong {
        /// Straight distance between transmitter and receiver, m.
        distance_m: f64,
    },
}

impl core::fmt::Display for AxisError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let site = |f: &mut core::fmt::Formatter<'_>, name, site: &Geodetic| {
            let Geodetic { lat_e7, lon_e7, .. } = site;
            write!(
                f,
                "site {name}: latitude {lat_e7} must be within ±900000000 and longitude {lon_e7} within ±1800000000, in 1e-7 degrees"
            )
        };
        match self {
            Self::Tx(at) => site(f, "tx", at),
            Self::Rx(at) => site(f, "rx", at),
            Self::TooShort { distance_m } => write!(
                f,
                "Tx and Rx are {distance_m:.2} m apart: must be within {SHORTEST_M} to {LONGEST_M} m"
            ),
            Self::TooLong { distance_m } => write!(
                f,
                "Tx and Rx are {distance_m:.0} m apart: must be within {SHORTEST_M} to {LONGEST_M} m"
            ),
        }
    }
}

impl core::error::Error for AxisError {}

/// Line on earth from Tx to Rx. This type converts between geodetic positions and the mission's coordinates.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    sites: Sites,
    middle: Vector,
    /// Unit vector from the middle of the line Tx-Rx toward the receiver.
    along: Vector,
    /// Unit vector to the right at the middle of the line Tx-Rx, as seen from Tx toward Rx.
    right: Vector,
    /// Unit vector upward at the middle of the line Tx-Rx.
    up: Vector,
    /// Half the straight distance from transmitter to receiver, m.
    half_chord_m: f64,
    /// Radius of curvature of the earth's surface in the direction of the line, m.
    radius_m: f64,
    /// Distance from transmitter to receiver along the ground, m.
    distance_m: f64,
    /// Height of the ground above mean sea level at the transmitter and at the receiver, m.
    ends_amsl_m: [f64; 2],
}

impl Axis {
    /// Maximum distance from the line Tx to Rx at which mission coordinates are used, m. This maximum applies in all
    /// directions: sideways, upward, before Tx and beyond Rx.
    pub const AROUND_M: f32 = 5_000.0;

    /// Creates the line from a transmitter at `tx` to a receiver at `rx`, both on the ground.
    ///
    /// Poles and the antimeridian need no special case. Constant work.
    ///
    /// ```
    /// use uav_relay::flight::axis::Axis;
    /// use uav_relay::{Geodetic, Placement};
    ///
    /// let site = |lat, lon, amsl| Geodetic::from_degrees(lat, lon, amsl).expect("a place on earth");
    /// let axis = Axis::try_new(site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0))?;
    /// let place = Placement { x_m: 300.0, y_m: 20.0, altitude_m: 60.0 };
    /// let point = axis.point(place).expect("it is near the line");
    /// let back = axis.place(point).expect("so is that");
    /// assert!((back.x_m - place.x_m).abs() < 0.02 && (back.y_m - place.y_m).abs() < 0.02);
    /// # Ok::<(), uav_relay::flight::axis::AxisError>(())
    /// ```
    ///
    /// # Errors
    /// [`AxisError`] if a latitude or longitude is out of range, or the two positions are too close or too far apart.
    #[inline(never)] // called from several places
    pub fn try_new(tx: Geodetic, rx: Geodetic) -> Result<Self, AxisError> {
        if !tx.is_valid() {
            return Err(AxisError::Tx(tx));
        }
        if !rx.is_valid() {
            return Err(AxisError::Rx(rx));
        }
        let ends = [Vector::on_ellipsoid(tx), Vector::on_ellipsoid(rx)];
        let [t, r] = ends;
        let chord = r.minus(t);
        let length = chord.length();
        if length < SHORTEST_M {
            return Err(AxisError::TooShort { distance_m: length });
        }
        if length > LONGEST_M {
            return Err(AxisError::TooLong { distance_m: length });
        }
        let half_chord_m = length / 2.0;
        let middle = t.plus(r).times(0.5);
        let along = chord.times(1.0 / length);
        let normal = middle.normal();
        let up = normal.minus(along.times(normal.dot(along))).unit();
        let radius_m = radius(normal, along);
        Ok(Self {
            sites: Sites { tx, rx },
            middle,
            along,
            right: along.cross(up),
            up,
            half_chord_m,
            radius_m,
            distance_m: 2.0 * arc(half_chord_m, radius_m),
            ends_amsl_m: [tx, rx].map(|site| f64::from(site.amsl_mm) / 1e3),
        })
    }

    /// Creates the line between the Tx and Rx positions `sites`, see [`try_new`](Self::try_new).
    ///
    /// # Errors
    /// Same as for [`try_new`](Self::try_new).
    #[inline] // a line is returned through the stack
    pub fn between(sites: Sites) -> Result<Self, AxisError> {
        Self::try_new(sites.tx, sites.rx)
    }

    pub(super) const fn sites(&self) -> Sites {
        self.sites
    }

    /// Returns the distance D from transmitter to receiver along the ground, m.
    pub const fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Returns true if `distance_m` is the length of the line from Tx to Rx, except for rounding.
    pub fn is_of(&self, distance_m: f32) -> bool {
        let rounded = f64::from(distance_m) * f64::from(f32::EPSILON);
        (f64::from(distance_m) - self.distance_m).abs() <= TOLERANCE_M + rounded
    }

    /// Converts a geodetic position to mission coordinates.
    ///
    /// `None` if the position is invalid, or farther than [`AROUND_M`](Self::AROUND_M) from the line. Constant work.
    pub fn place(&self, point: Geodetic) -> Option<Placement> {
        if !point.is_valid() {
            return None;
        }
        let from = Vector::on_ellipsoid(point).minus(self.middle);
        let c = from.dot(self.along);
        let x = self.distance_m / 2.0 + arc(c, self.radius_m);
        let h = f64::from(point.amsl_mm) / 1e3 - self.datum_m(x);
        let place = Placement {
            x_m: narrow(x),
            y_m: narrow(from.dot(self.right)),
            altitude_m: narrow(h),
        };
        // A point on the other side of the earth has a small x and y as well, but is too deep.
        let is_near = self.is_around(place)
            && from.dot(self.up).abs() <= self.half_chord_m + f64::from(Self::AROUND_M);
        is_near.then_some(place)
    }

    /// Returns the distance along the ground from a point to the nearest point of the line, m. `None` for an invalid point.
    ///
    /// The distance is defined everywhere on earth, also where [`place`](Self::place) is `None`. Constant work.
    ///
    /// ```
    /// use uav_relay::flight::axis::Axis;
    /// use uav_relay::Geodetic;
    ///
    /// let site = |lat, lon| Geodetic::from_degrees(lat, lon, 420.0).expect("a place on earth");
    /// let axis = Axis::try_new(site(47.40, 8.54), site(47.41, 8.55))?;
    /// // Latitude and longitude of the drone are swapped.
    /// let drone = site(8.545, 47.405);
    /// assert_eq!(axis.place(drone), None);
    /// let away_m = axis.away_m(drone).expect("on earth");
    /// assert!((away_m / 5_654_776.0 - 1.0).abs() < 2e-3, "by GeographicLib");
    /// # Ok::<(), uav_relay::flight::axis::AxisError>(())
    /// ```
    pub fn away_m(&self, point: Geodetic) -> Option<f64> {
        if !point.is_valid() {
            return None;
        }
        let point = Vector::on_ellipsoid(point);
        let from = point.minus(self.middle);
        let half_m = self.distance_m / 2.0;
        let foot = libm::atan2(from.dot(self.along), from.dot(self.up) + self.radius_m);
        // `clamp` would panic on a NaN limit.
        let foot = self.on_line((foot * self.radius_m).max(-half_m).min(half_m), 0.0);
        let chord = point.minus(foot).length();
        // Twice the sine and cosine of half the angle.
        let (a, b) = (point.unit(), foot.unit());
        let (sin, cos) = (a.minus(b).length(), a.plus(b).length());
        let longer = if sin > 0.0 {
            2.0 * libm::atan2(sin, cos) / sin
        } else {
            1.0
        };
        Some(chord * longer)
    }

    /// Converts mission coordinates to a geodetic position.
    ///
    /// `None` if the coordinates are not finite, or farther than [`AROUND_M`](Self::AROUND_M) from the line. Constant
    /// work.
    pub fn point(&self, place: Placement) -> Option<Geodetic> {
        if !self.is_around(place) {
            return None;
        }
        let (x, y) = (f64::from(place.x_m), f64::from(place.y_m));
        let [lat, lon] = self
            .on_line(x - self.distance_m / 2.0, y)
            .latitude_and_longitude();
        let amsl_m = self.datum_m(x) + f64::from(place.altitude_m);
        Some(Geodetic {
            lat_e7: to_integer(lat / UNIT),
            lon_e7: to_integer(lon / UNIT),
            amsl_mm: to_integer(amsl_m * 1e3),
        })
    }

    /// Returns the point `x` m from the line's middle toward Rx and `y` m to the right, at height 0. Right is meant as
    /// seen from Tx toward Rx.
    fn on_line(&self, x: f64, y: f64) -> Vector {
        let c = chord(x, self.radius_m);
        let sagitta =
            (self.half_chord_m * self.half_chord_m - c * c - y * y) / (2.0 * self.radius_m);
        self.middle
            .plus(self.along.times(c))
            .plus(self.right.times(y))
            .plus(self.up.times(sagitta))
    }

    /// Returns the azimuth of the line at `x_m`, radians clockwise from north; meaningless at a pole. Constant work.
    pub fn azimuth_rad(&self, x_m: f32) -> f32 {
        let [north, east] = self.direction(x_m);
        narrow(libm::atan2(east, north))
    }

    /// Returns the angle between the directions of this line and `other`, rad, 0 to π. Constant work. Each direction is
    /// measured at the Tx of its line.
    pub fn turn_rad(&self, other: &Self) -> f32 {
        turned(other.azimuth_rad(0.0) - self.azimuth_rad(0.0)).abs()
    }

    /// Returns the azimuth of the line at `x_m` plus `aside_rad`, radians clockwise from north, -π to π. Constant work.
    pub(super) fn heading_rad(&self, x_m: f32, aside_rad: f32) -> f32 {
        turned(self.azimuth_rad(x_m) + aside_rad)
    }

    /// Converts a velocity along x, y and up at `x_m` to north, east and down; all in m/s. Constant work.
    pub fn to_ned(&self, x_m: f32, velocity_m_s: [f32; 3]) -> [f32; 3] {
        let [x, y, h] = velocity_m_s.map(f64::from);
        let [north, east] = self.direction(x_m);
        let [tx, rx] = self.ends_amsl_m;
        let climb = h + x * (rx - tx) / self.distance_m;
        [x * north - y * east, x * east + y * north, -climb].map(narrow)
    }

    /// Returns the north and east components of a unit vector: the line's horizontal direction at `x_m`.
    fn direction(&self, x_m: f32) -> [f64; 2] {
        // The tangent of the line turns with the earth's curvature, by the angle c / r.
        let c = chord(f64::from(x_m) - self.distance_m / 2.0, self.radius_m);
        let turn = c / self.radius_m;
        let tangent = self.along.minus(self.up.times(turn));
        let normal = self.up.plus(self.along.times(turn)).unit();
        // North is the projection of the earth's axis onto the ground plane. Both vectors are as long as the cosine of
        // the latitude.
        let north = tangent.dot(Vector::POLE.minus(normal.times(normal.z)));
        let east = tangent.dot(Vector::POLE.cross(normal));
        let length = libm::sqrt(north * north + east * east);
        if length > 0.0 {
            [north / length, east / length]
        } else {
            [1.0, 0.0]
        }
    }

    /// Returns true if `place` is finite and at most [`AROUND_M`](Self::AROUND_M) from the line.
    #[inline(never)] // called from several places
    pub(super) fn is_around(&self, place: Placement) -> bool {
        let Placement {
            x_m,
            y_m,
            altitude_m,
        } = place;
        let beyond = narrow(self.distance_m) + Self::AROUND_M;
        (-Self::AROUND_M..=beyond).contains(&x_m)
            && y_m.abs() <= Self::AROUND_M
            && altitude_m.abs() <= Self::AROUND_M
    }

    fn datum_m(&self, x: f64) -> f64 {
        let [tx, rx] = self.ends_amsl_m;
        tx + (rx - tx) * x / self.distance_m
    }
}

#[expect(clippy::cast_possible_truncation, reason = "places are f32")]
const fn narrow(value: f64) -> f32 {
    value as f32
}

/// Returns half the length of an arc, m. `chord` is half the length of the arc's chord, m, and `radius` the radius of
/// the arc, m.
fn arc(chord: f64, radius: f64) -> f64 {
    let q = chord / radius;
    chord * (1.0 + q * q / 6.0)
}

fn chord(arc: f64, radius: f64) -> f64 {
    let q = arc / radius;
    arc * (1.0 - q * q / 6.0)
}

/// Minimum length of a line from Tx to Rx, m. Positions have steps of 1e-7 degrees (1 cm). For a shorter line, such a
/// step would change the line's direction by more than 1 mrad.
#[doc(hidden)] // for the tests of this workspace
pub const SHORTEST_M: f64 = 10.0;

/// Maximum length of a line from Tx to Rx, m. For longer lines the accuracy of the conversions is not tested.
#[doc(hidden)] // for the tests of this workspace
pub const LONGEST_M: f64 = 100_000.0;

/// Semi-major axis of the WGS84 ellipsoid, m.
const A_M: f64 = 6_378_137.0;
/// Squared eccentricity of the WGS84 ellipsoid.
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

    /// Returns the point of the WGS84 ellipsoid at the latitude and longitude of `point`, at height 0.
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

    /// Returns the latitude and longitude of this point, radians. The point must be near the WGS84 ellipsoid, because
    /// the computation takes only a single step of Bowring's method.
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

/// Returns the radius of curvature of the WGS84 ellipsoid at a point, m, in the direction `along`. `normal` is the
/// ellipsoid's normal at this point.
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

/// Factor that converts an angle in units of 10⁻⁷ degrees to radians.
pub(super) const UNIT: f64 = core::f64::consts::PI / 1.8e9;

/// Returns sine and cosine of an angle in units of 10⁻⁷ degrees. The error is at most one unit in the last place of the
/// result.
///
/// The angle is reduced to an eighth of a turn in integers, without an error. Sine and cosine of the remaining angle
/// are computed by fdlibm's series. A general function for f64 would be ten times as large.
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

/// Returns an angle wrapped to the range -π to π, rad. `angle` must be within (-3π, 3π).
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

/// Coefficients of fdlibm's sine series for up to an eighth of a turn, highest power first.
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
