//! Geodetic positions as integers, in the units of MAVLink.

/// Geodetic position: WGS84 latitude and longitude, and height above mean sea level.
///
/// One unit of latitude is 1.1 cm on the ground, one of longitude at most that.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Geodetic {
    /// Latitude, 10⁻⁷ degrees, north above 0: in [-900 000 000, 900 000 000].
    pub lat_e7: i32,
    /// Longitude, 10⁻⁷ degrees, east above 0: in [-1 800 000 000, 1 800 000 000].
    pub lon_e7: i32,
    /// Height above the mean sea level (AMSL), mm.
    pub amsl_mm: i32,
}

impl Geodetic {
    /// Returns the nearest representable position; `None` for a latitude, longitude or height that is not finite or out of range.
    ///
    /// ```
    /// use uav_relay::Geodetic;
    ///
    /// let site = Geodetic::from_degrees(47.40, 8.54, 420.0).expect("a place on earth");
    /// assert_eq!((site.lat_e7, site.amsl_mm), (474_000_000, 420_000));
    /// assert_eq!(Geodetic::from_degrees(91.0, 0.0, 0.0), None);
    /// ```
    pub fn from_degrees(lat_deg: f64, lon_deg: f64, amsl_m: f64) -> Option<Self> {
        let is_on_earth = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0 && amsl_m.abs() <= 1e6;
        is_on_earth.then(|| Self {
            lat_e7: to_integer(lat_deg * 1e7),
            lon_e7: to_integer(lon_deg * 1e7),
            amsl_mm: to_integer(amsl_m * 1e3),
        })
    }

    /// Returns true if latitude and longitude are within their ranges.
    pub const fn is_valid(self) -> bool {
        self.lat_e7.unsigned_abs() <= 900_000_000 && self.lon_e7.unsigned_abs() <= 1_800_000_000
    }
}

/// Rounds to the nearest integer, halves away from zero.
#[expect(
    clippy::cast_possible_truncation,
    reason = "saturates, and callers hand in what fits"
)]
#[inline(never)] // called from several places
pub(crate) fn to_integer(value: f64) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}

#[cfg(test)]
mod tests {
    use super::Geodetic;

    #[test]
    fn degrees_become_the_nearest_units() {
        let point = Geodetic::from_degrees(47.400_000_04, -8.540_000_06, 420.000_4);
        let nearest = Geodetic {
            lat_e7: 474_000_000,
            lon_e7: -85_400_001,
            amsl_mm: 420_000,
        };
        assert_eq!(point, Some(nearest));
    }

    #[test]
    fn what_is_no_point_on_earth_is_none() {
        for (lat, lon, amsl) in [
            (90.1, 0.0, 0.0),
            (0.0, -180.1, 0.0),
            (f64::NAN, 0.0, 0.0),
            (0.0, f64::INFINITY, 0.0),
            (0.0, 0.0, f64::NAN),
        ] {
            assert_eq!(Geodetic::from_degrees(lat, lon, amsl), None);
        }
    }
}
