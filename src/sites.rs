//! Geodetic positions of transmitter and receiver, which define the mission's line on earth.

use crate::geodetic::Geodetic;

/// Ground positions of both ends of the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sites {
    /// Position of the transmitter.
    pub tx: Geodetic,
    /// Position of the receiver.
    pub rx: Geodetic,
}

/// Length of the encoded sites, bytes.
pub(crate) const LENGTH: usize = 24;

impl Sites {
    /// Encodes latitude, longitude and height of the transmitter, then of the receiver, as four little-endian bytes each.
    pub(crate) fn to_bytes(self) -> [u8; LENGTH] {
        let Self { tx, rx } = self;
        let numbers = [
            tx.lat_e7, tx.lon_e7, tx.amsl_mm, rx.lat_e7, rx.lon_e7, rx.amsl_mm,
        ];
        let mut bytes = [0; LENGTH];
        for (place, number) in bytes.chunks_exact_mut(4).zip(numbers) {
            place.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }

    #[cfg(feature = "upload")]
    pub(crate) fn from_bytes(bytes: [u8; LENGTH]) -> Self {
        let mut numbers = [0; LENGTH / 4];
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

    #[cfg(feature = "upload")]
    pub(crate) const fn are_valid(self) -> bool {
        self.tx.is_valid() && self.rx.is_valid()
    }
}
