//! Geodetic positions as integers, in the units of MAVLink.
//!
//! [`Sites`] are the positions of transmitter and receiver on earth. A [`LineError`] is the reason why a relay rejects
//! a mission.

/// Geodetic position: WGS84 latitude and longitude, and height above mean sea level.
///
/// A step of 1 in `lat_e7` is 1.1 cm on the ground, a step of 1 in `lon_e7` at most 1.1 cm.
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
    /// Returns the position nearest to these values; `None` if a value is not finite or out of range.
    ///
    /// Latitude and longitude are in degrees. The height above mean sea level is in m, -1e6 to 1e6.
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

/// Rounds `value` to the nearest integer, halves away from zero.
#[expect(
    clippy::cast_possible_truncation,
    reason = "saturates, and callers hand in what fits"
)]
#[inline(never)] // called from several places
pub(crate) fn to_integer(value: f64) -> i32 {
    (value + if value < 0.0 { -0.5 } else { 0.5 }) as i32
}

/// Surveyed positions of the transmitter Tx and the receiver Rx on the ground.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sites {
    /// Position of the transmitter Tx on earth.
    pub tx: Geodetic,
    /// Position of the receiver Rx on earth.
    pub rx: Geodetic,
}

/// Length of the encoded [`Sites`], bytes.
pub(crate) const SITES_LENGTH: usize = 24;

impl Sites {
    /// Encodes latitude, longitude and height of the transmitter, then those of the receiver. Each of the six numbers
    /// takes four little-endian bytes.
    pub(crate) fn to_bytes(self) -> [u8; SITES_LENGTH] {
        let Self { tx, rx } = self;
        let numbers = [
            tx.lat_e7, tx.lon_e7, tx.amsl_mm, rx.lat_e7, rx.lon_e7, rx.amsl_mm,
        ];
        let mut bytes = [0; SITES_LENGTH];
        for (place, number) in bytes.chunks_exact_mut(4).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    pub(crate) fn from_bytes(bytes: [u8; SITES_LENGTH]) -> Self {
        let mut numbers = [0; SITES_LENGTH / 4];
        for (number, place) in numbers.iter_mut().zip(bytes.as_chunks().0) {
            *number = i32::from_le_bytes(*place);
        }
        let [tx_lat, tx_lon, tx_amsl, rx_lat, rx_lon, rx_amsl] = numbers;
        let site = |lat_e7, lon_e7, amsl_mm| Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        };
        Self {
            tx: site(tx_lat, tx_lon, tx_amsl),
            rx: site(rx_lat, rx_lon, rx_amsl),
        }
    }

    pub(crate) const fn are_valid(self) -> bool {
        self.tx.is_valid() && self.rx.is_valid()
    }
}

/// Reason why a relay rejects an uploaded mission: its Tx and Rx positions, its slots, or the geofence.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum LineError {
    /// The mission's distance differs from the distance between Tx and Rx on earth. The positions of Tx and Rx are
    /// those in the mission, or else the relay's configured ones (`Settings::sited`).
    Distance,
    /// The mission's Tx and Rx positions are less than 10 m or more than 100 km apart.
    Sites,
    /// The mission's range of altitudes is not inside the relay's own geofence. See
    /// [`GuardConfig::geofence`](crate::guard::config::GuardConfig).
    Altitude,
    /// The mission's range of lateral offsets is not inside the relay's own geofence.
    Lateral,
    /// The mission's distance from transmitter to receiver exceeds the relay's own geofence.
    Length,
    /// The mission has fitted time slots (`fitted_gap` above 0), which this relay's settings do not allow. A fitted
    /// slot is as long as its hop needs.
    ///
    /// Fitted slots need the method `Joint`, no `Settings::listen`, and a known interferer.
    Slots,
}

error_texts!(LineError {
    Distance => "the mission's distance must be equal to the distance between its sites (positions of Tx and Rx on earth); a mission without sites uses the sites loaded before flight",
    Sites => "Tx and Rx must have valid coordinates, and be 10 m to 100 km apart",
    Altitude => "the mission's altitudes must be within this relay's geofence",
    Lateral => "the mission's lateral range must be within this relay's geofence",
    Length => "the mission's distance must be at most the greatest x of this relay's geofence, or the distance of the mission loaded before flight",
    Slots => "the mission's fitted_gap above 0 (time slots fitted to the hops) needs the method joint and a known interferer, and listen must be None",
});
