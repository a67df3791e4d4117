//! The line from transmitter to receiver on earth: a latitude and longitude to a place along it, and back.
//!
//! # Derivation
//! Everything is on the WGS84 ellipsoid in earth-centred coordinates, in f64. T and R are the two sites and P is the point, all three
//! at height 0 above the ellipsoid: a height would shift x, by 1.2 m at 10 km for 1 500 m. With the midpoint m = (T + R) / 2 of the
//! chord C = |R - T|, its direction u, the ellipsoid's normal at m made perpendicular to u (*up*), and the radius of curvature r of the
//! ellipsoid at m in the direction u (Euler: 1/r = cos²α / M + sin²α / N),
//!
//! - c = (P - m) · u is how far along the chord P is, and x = D / 2 + c (1 + (c/r)² / 6): an arc is that much longer than its chord,
//! - y = (P - m) · (u × up), to the right of the line,
//! - D is x at R, twice C / 2 (1 + (C / 2r)² / 6).
//!
//! Back: c is the sine's series at x - D / 2, P is m + c u + y (u × up) + z up with the sagitta z = (C²/4 - c² - y²) / 2r, and one step
//! of Bowring's method gives its latitude.
//!
//! # Height
//! h is above the *datum* of the mission, the straight line from the ground at Tx to the ground at Rx:
//! AMSL = tx + (rx - tx) x / D + h. A height above the sea follows the earth's curve by itself.
//!
//! # Accuracy
//! Against geodesics, for points up to 500 m beside the line: within 1 mm for lines up to 10 km, within 5 mm for 100 km
//! (`places_agree_with_geodesics` in `host-tests/tests/axis`); there and back within one unit of [`Geodetic`].

use super::geodetic::{Geodetic, to_integer};
use crate::place::Placement;

/// WGS84: the semi-axis at the equator, m, and the squared eccentricity.
const A_M: f64 = 6_378_137.0;
const E2: f64 = 6.694_379_990_141_316e-3;

/// Degrees of 10⁻⁷, in radians.
const UNIT: f64 = core::f64::consts::PI / 1.8e9;

/// The shortest line: the units of a latitude turn it by a thousandth.
pub const SHORTEST_M: f64 = 10.0;

/// The longest line whose accuracy is known.
pub const LONGEST_M: f64 = 100_000.0;

/// How far from the line a place may be, and before and behind its ends, m.
pub const AROUND_M: f32 = 5_000.0;

/// How far the mission's distance may be from that of the sites, m: what the units of the sites amount to, and f32.
const TOLERANCE_M: f64 = 0.05;

/// What is wrong with a pair of sites.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum AxisError {
    /// The latitude or longitude of the transmitter is not on earth.
    Tx(Geodetic),
    /// The latitude or longitude of the receiver is not on earth.
    Rx(Geodetic),
    /// The sites are nearer to each other than [`SHORTEST_M`].
    TooShort {
        /// The distance, m.
        distance_m: f64,
    },
    /// The sites are farther from each other than [`LONGEST_M`].
    TooLong {
        /// The distance, m: of the chord.
        distance_m: f64,
    },
}

impl core::fmt::Display for AxisError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let site = |f: &mut core::fmt::Formatter<'_>, name, site: &Geodetic| {
            let Geodetic { lat_e7, lon_e7, .. } = site;
            write!(
                f,
                "site {name}: latitude {lat_e7} and longitude {lon_e7} in 1e-7 degrees: allowed are ±900000000 and ±1800000000"
            )
        };
        match self {
            Self::Tx(at) => site(f, "tx", at),
            Self::Rx(at) => site(f, "rx", at),
            Self::TooShort { distance_m } => write!(
                f,
                "the sites are {distance_m:.2} m apart: allowed are {SHORTEST_M} to {LONGEST_M} m"
            ),
            Self::TooLong { distance_m } => write!(
                f,
                "the sites are {distance_m:.0} m apart: allowed are {SHORTEST_M} to {LONGEST_M} m"
            ),
        }
    }
}

impl core::error::Error for AxisError {}

/// The line from the transmitter's site to the receiver's.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Axis {
    middle: Vector,
    /// Toward the receiver, to the right, and up.
    along: Vector,
    right: Vector,
    up: Vector,
    /// Half the chord, and the radius of curvature, m.
    half_chord_m: f64,
    radius_m: f64,
    distance_m: f64,
    /// AMSL of the ground at either end, m.
    ends_amsl_m: [f64; 2],
}

impl Axis {
    /// The line between two sites on the ground; poles and the antimeridian are places like any other. Constant work.
    ///
    /// # Errors
    /// A latitude or longitude that is not on earth, sites too near to each other or too far apart.
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

    /// The distance D from transmitter to receiver along the ground, m.
    pub const fn distance_m(&self) -> f64 {
        self.distance_m
    }

    /// Whether a mission over `distance_m` metres is one between these sites.
    pub fn is_of(&self, distance_m: f32) -> bool {
        let rounded = f64::from(distance_m) * f64::from(f32::EPSILON);
        (f64::from(distance_m) - self.distance_m).abs() <= TOLERANCE_M + rounded
    }

    /// Where a point on earth is along the line; `None` for one that is not on earth, or farther than [`AROUND_M`] from the line or from
    /// its ends. Constant work.
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
        // What is behind the earth has a small x and y as well: it is too deep.
        let is_near = self.is_around(place)
            && from.dot(self.up).abs() <= self.half_chord_m + f64::from(AROUND_M);
        is_near.then_some(place)
    }

    /// Where a place along the line is on earth; `None` for one that is not finite, or farther than [`AROUND_M`] from the line or from
    /// its ends. Constant work.
    pub fn point(&self, place: Placement) -> Option<Geodetic> {
        if !self.is_around(place) {
            return None;
        }
        let (x, y) = (f64::from(place.x_m), f64::from(place.y_m));
        let c = chord(x - self.distance_m / 2.0, self.radius_m);
        let sagitta =
            (self.half_chord_m * self.half_chord_m - c * c - y * y) / (2.0 * self.radius_m);
        let at = self
            .middle
            .plus(self.along.times(c))
            .plus(self.right.times(y))
            .plus(self.up.times(sagitta));
        let [lat, lon] = at.latitude_and_longitude();
        let amsl_m = self.datum_m(x) + f64::from(place.altitude_m);
        Some(Geodetic {
            lat_e7: to_integer(lat / UNIT),
            lon_e7: to_integer(lon / UNIT),
            amsl_mm: to_integer(amsl_m * 1e3),
        })
    }

    /// The azimuth of the line where it passes `x_m`, radians clockwise from north; of no meaning at a pole. Constant work.
    pub fn azimuth_rad(&self, x_m: f32) -> f32 {
        let [north, east] = self.direction(x_m);
        narrow(libm::atan2(east, north))
    }

    /// A velocity along x, y and h at `x_m` as one toward north, east and down; all in m/s. Constant work.
    pub fn to_ned(&self, x_m: f32, velocity_m_s: [f32; 3]) -> [f32; 3] {
        let [x, y, h] = velocity_m_s.map(f64::from);
        let [north, east] = self.direction(x_m);
        let [tx, rx] = self.ends_amsl_m;
        let climb = h + x * (rx - tx) / self.distance_m;
        [x * north - y * east, x * east + y * north, -climb].map(narrow)
    }

    /// How much of the line's direction where it passes `x_m` is north, and how much east.
    fn direction(&self, x_m: f32) -> [f64; 2] {
        // The tangent turns with the earth: c / r is how far.
        let c = chord(f64::from(x_m) - self.distance_m / 2.0, self.radius_m);
        let turn = c / self.radius_m;
        let tangent = self.along.minus(self.up.times(turn));
        let normal = self.up.plus(self.along.times(turn)).unit();
        // North is what is left of the earth's axis in the ground plane; both are as long as the cosine of the latitude.
        let north = tangent.dot(Vector::POLE.minus(normal.times(normal.z)));
        let east = tangent.dot(Vector::POLE.cross(normal));
        let length = libm::sqrt(north * north + east * east);
        if length > 0.0 {
            [north / length, east / length]
        } else {
            [1.0, 0.0]
        }
    }

    /// Whether a place is finite and near the line. NaN is not.
    pub(super) fn is_around(&self, place: Placement) -> bool {
        let Placement {
            x_m,
            y_m,
            altitude_m,
        } = place;
        let beyond = narrow(self.distance_m) + AROUND_M;
        (-AROUND_M..=beyond).contains(&x_m) && y_m.abs() <= AROUND_M && altitude_m.abs() <= AROUND_M
    }

    /// AMSL of the datum at `x`, m.
    fn datum_m(&self, x: f64) -> f64 {
        let [tx, rx] = self.ends_amsl_m;
        tx + (rx - tx) * x / self.distance_m
    }
}

#[expect(clippy::cast_possible_truncation, reason = "places are f32")]
const fn narrow(value: f64) -> f32 {
    value as f32
}

/// The arc over a half chord, and the half chord under an arc, both from the middle.
fn arc(chord: f64, radius: f64) -> f64 {
    let q = chord / radius;
    chord * (1.0 + q * q / 6.0)
}

fn chord(arc: f64, radius: f64) -> f64 {
    let q = arc / radius;
    arc * (1.0 - q * q / 6.0)
}

/// Sine and cosine of an angle in units of 10⁻⁷ degrees.
///
/// The angle within an eighth of a turn of an axis is exact in integers; the sine and cosine of that are fdlibm's series, within a unit in the
/// last place. A function for any f64 would be ten times as large, for turns that no place on earth makes.
#[inline(never)] // called from several places
fn sine_and_cosine(units: i32) -> [f64; 2] {
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

/// fdlibm's coefficients for up to an eighth of a turn, the highest power first.
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

/// The ellipsoid's radius of curvature where its normal is `normal`, in the direction `along`.
fn radius(normal: Vector, along: Vector) -> f64 {
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

/// Earth-centred, earth-fixed: m, or a direction.
#[derive(Clone, Copy, PartialEq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

impl Vector {
    const POLE: Self = Self {
        x: 0.0,
        y: 0.0,
        z: 1.0,
    };

    /// The point of that latitude and longitude at height 0.
    fn on_ellipsoid(point: Geodetic) -> Self {
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
    fn normal(self) -> Self {
        Self {
            z: self.z / (1.0 - E2),
            ..self
        }
        .unit()
    }

    /// Of a point near the ellipsoid, by one step of Bowring's method; radians.
    fn latitude_and_longitude(self) -> [f64; 2] {
        let p = libm::sqrt(self.x * self.x + self.y * self.y);
        // b / a; the latter is what the parametric latitude's tangent is p / z over.
        let flat = libm::sqrt(1.0 - E2);
        let length = libm::sqrt(self.z * self.z + flat * p * flat * p);
        let (sin, cos) = (self.z / length, flat * p / length);
        let z = self.z + E2 / (1.0 - E2) * flat * A_M * sin * sin * sin;
        let lat = libm::atan2(z, p - E2 * A_M * cos * cos * cos);
        [lat, libm::atan2(self.y, self.x)]
    }

    fn plus(self, other: Self) -> Self {
        Self {
            x: self.x + other.x,
            y: self.y + other.y,
            z: self.z + other.z,
        }
    }

    fn times(self, factor: f64) -> Self {
        Self {
            x: self.x * factor,
            y: self.y * factor,
            z: self.z * factor,
        }
    }

    fn minus(self, other: Self) -> Self {
        self.plus(other.times(-1.0))
    }

    fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    fn length(self) -> f64 {
        libm::sqrt(self.dot(self))
    }

    fn unit(self) -> Self {
        self.times(1.0 / self.length())
    }
}

#[cfg(test)]
mod tests {
    use super::{Axis, AxisError, LONGEST_M};
    use crate::flight::geodetic::Geodetic;
    use crate::place::Placement;

    #[test]
    fn sine_and_cosine_are_those_of_libm() {
        let mut units = i32::MIN;
        for step in 0_i32..20_000 {
            for units in [units, (step - 10_000) * 180_000] {
                let [sin, cos] = super::sine_and_cosine(units);
                // The angle as an f64 is off by more than the series is.
                let (expected_sin, expected_cos) = libm::sincos(f64::from(units) * super::UNIT);
                assert!((sin - expected_sin).abs() < 1e-15, "{units}");
                assert!((cos - expected_cos).abs() < 1e-15, "{units}");
            }
            units = units.wrapping_add(214_733);
        }
    }

    fn site(lat_deg: f64, lon_deg: f64, amsl_m: f64) -> Geodetic {
        Geodetic::from_degrees(lat_deg, lon_deg, amsl_m).expect("on earth")
    }

    fn near(a: f32, b: f64, within: f64) {
        assert!((f64::from(a) - b).abs() <= within, "{a} is not {b}");
    }

    #[test]
    fn the_sites_are_the_ends_of_the_line() {
        let (tx, rx) = (site(47.40, 8.54, 420.0), site(47.41, 8.55, 431.0));
        let axis = Axis::try_new(tx, rx).expect("a line");
        let d = axis.distance_m();
        for (site, x) in [(tx, 0.0), (rx, d)] {
            let place = axis.place(site).expect("near");
            near(place.x_m, x, 1e-4);
            near(place.y_m, 0.0, 1e-4);
            near(place.altitude_m, 0.0, 1e-3);
        }
    }

    #[test]
    fn y_is_to_the_right() {
        // Eastward: the right is the south.
        let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.4, 8.55, 0.0)).expect("a line");
        let south = axis.place(site(47.399, 8.545, 0.0)).expect("near");
        near(south.y_m, 111.2, 0.1);
        let point = axis.point(Placement {
            y_m: 100.0,
            ..Placement::on_line(300.0, 20.0)
        });
        assert!(point.expect("near").lat_e7 < 474_000_000);
    }

    #[test]
    fn height_is_above_the_line_from_ground_to_ground() {
        let axis =
            Axis::try_new(site(0.0, 179.99, 100.0), site(0.0, -179.99, 300.0)).expect("a line");
        let middle = Placement::on_line(1_113.195, 20.0);
        let point = axis.point(middle).expect("near");
        assert_eq!(point.lat_e7, 0);
        assert_eq!(
            point.lon_e7.unsigned_abs(),
            1_800_000_000,
            "the antimeridian"
        );
        assert_eq!(point.amsl_mm, 220_000);
    }

    #[test]
    fn a_line_over_the_pole_is_a_line() {
        let (tx, rx) = (site(89.99, 0.0, 0.0), site(89.99, 180.0, 0.0));
        let axis = Axis::try_new(tx, rx).expect("a line");
        let pole = axis.place(site(90.0, 12.0, 5.0)).expect("near");
        near(pole.x_m, axis.distance_m() / 2.0, 1e-3);
        near(pole.y_m, 0.0, 1e-3);
        let back = axis.point(pole).expect("near");
        assert!(back.lat_e7 >= 899_999_999, "{back:?}");
    }

    #[test]
    fn what_is_wrong_with_a_pair_of_sites_is_said() {
        let here = site(47.4, 8.54, 0.0);
        let off = Geodetic {
            lat_e7: 900_000_001,
            ..here
        };
        assert_eq!(Axis::try_new(off, here), Err(AxisError::Tx(off)));
        assert_eq!(Axis::try_new(here, off), Err(AxisError::Rx(off)));
        assert_eq!(
            Axis::try_new(here, here),
            Err(AxisError::TooShort { distance_m: 0.0 })
        );
        let far = Axis::try_new(here, site(47.4, 9.9, 0.0));
        assert!(
            matches!(far, Err(AxisError::TooLong { distance_m }) if distance_m > LONGEST_M),
            "{far:?}"
        );
    }

    #[test]
    fn nothing_far_from_the_line_or_not_finite_has_a_point() {
        let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.41, 8.55, 0.0)).expect("a line");
        for (x_m, y_m, altitude_m) in [
            (f32::NAN, 0.0, 20.0),
            (0.0, f32::NAN, 20.0),
            (0.0, 0.0, f32::INFINITY),
            (-5_001.0, 0.0, 20.0),
            (0.0, 5_001.0, 20.0),
        ] {
            let place = Placement {
                x_m,
                y_m,
                altitude_m,
            };
            assert_eq!(axis.point(place), None, "{place:?}");
        }
        assert_eq!(
            axis.place(site(0.0, 0.0, 0.0)),
            None,
            "what has no fix says 0, 0"
        );
        assert_eq!(
            axis.place(site(-47.405, -171.455, 0.0)),
            None,
            "behind the earth"
        );
    }

    #[test]
    fn the_azimuth_turns_along_the_line() {
        let axis = Axis::try_new(site(60.0, 10.0, 0.0), site(60.0, 11.0, 0.0)).expect("a line");
        #[expect(clippy::cast_possible_truncation, reason = "missions are f32")]
        let d = axis.distance_m() as f32;
        // Eastward in the middle; meridians converge by 0.866 degrees from one end to the other.
        for (x, degrees) in [(0.0, 89.567), (d / 2.0, 90.0), (d, 90.433)] {
            let azimuth = axis.azimuth_rad(x).to_degrees();
            near(azimuth, degrees, 2e-3);
        }
    }

    #[test]
    fn velocities_turn_with_the_line() {
        // Toward the south-east, 100 m up in all.
        let axis = Axis::try_new(site(0.01, 10.0, 0.0), site(0.0, 10.01, 100.0)).expect("a line");
        let [north, east, down] = axis.to_ned(800.0, [10.0, 0.0, 1.0]);
        near(north, -7.05, 0.05);
        near(east, 7.09, 0.05);
        near(down, -1.0 - 10.0 * 100.0 / axis.distance_m(), 1e-3);
        let [north, east, down] = axis.to_ned(800.0, [0.0, 10.0, 0.0]);
        near(north, -7.09, 0.05);
        near(east, -7.05, 0.05);
        near(down, 0.0, 1e-6);
    }

    #[test]
    fn a_mission_over_another_distance_is_another() {
        let axis = Axis::try_new(site(47.4, 8.54, 0.0), site(47.41, 8.55, 0.0)).expect("a line");
        #[expect(clippy::cast_possible_truncation, reason = "missions are f32")]
        let d = axis.distance_m() as f32;
        assert!(axis.is_of(d) && axis.is_of(d + 0.04));
        assert!(!axis.is_of(d + 0.1) && !axis.is_of(f32::NAN));
    }
}
