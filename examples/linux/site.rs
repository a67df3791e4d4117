//! Options of the positions of transmitter and receiver on earth.

use std::fmt;

use clap::Args;
use uav_relay::flight::axis::Axis;
use uav_relay::{Geodetic, Sites};

/// Options for the positions of the transmitter and the receiver on earth.
#[derive(Args, Debug)]
pub struct SiteOptions {
    /// Position of the transmitter. Latitude and longitude, degrees (WGS84), and ground height above the mean sea
    /// level, m
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_rx", allow_hyphen_values = true, value_parser = site)]
    site_tx: Option<Geodetic>,
    /// Position of the receiver
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    site_rx: Option<Geodetic>,
}

impl SiteOptions {
    /// Returns the positions of transmitter and receiver; `None` if the options were not given.
    pub fn sites(&self) -> Option<Sites> {
        let (Some(tx), Some(rx)) = (self.site_tx, self.site_rx) else {
            return None;
        };
        Some(Sites { tx, rx })
    }

    /// Returns the Tx and Rx positions, if given. Checks that the distance between them is `distance_m`, m.
    ///
    /// # Errors
    /// One line that names the option and the right distance.
    pub fn of(&self, distance_m: f32) -> Result<Option<Sites>, String> {
        let Some(sites) = self.sites() else {
            return Ok(None);
        };
        let axis = Axis::between(sites).map_err(|error| format!("--site-rx: {error}"))?;
        if axis.is_of(distance_m) {
            return Ok(Some(sites));
        }
        Err(format!(
            "--distance {distance_m}: must be {:.3} m, the distance between --site-tx and --site-rx",
            axis.distance_m()
        ))
    }
}

/// Tx and Rx positions, displayed as `between TX and RX`, each position as on the command line.
#[derive(Clone, Copy, Debug)]
pub struct Between(pub Sites);

impl fmt::Display for Between {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Sites { tx, rx } = self.0;
        write!(f, "between {} and {}", degrees(tx), degrees(rx))
    }
}

/// Returns a position with latitude and longitude swapped. Their wrong order is a frequent mistake.
#[must_use]
pub fn swapped(site: Geodetic) -> Geodetic {
    Geodetic {
        lat_e7: site.lon_e7,
        lon_e7: site.lat_e7,
        ..site
    }
}

/// Formats a position as on the command line: latitude and longitude (degrees), height (m).
pub fn degrees(at: Geodetic) -> String {
    let part = |number: i32, unit: f64| f64::from(number) / unit;
    let (lat, lon) = (part(at.lat_e7, 1e7), part(at.lon_e7, 1e7));
    format!("{lat:.7},{lon:.7},{:.3}", part(at.amsl_mm, 1e3))
}

/// Parses a position: latitude and longitude (degrees), and height above the mean sea level (m).
///
/// # Errors
/// The expected form.
pub fn site(text: &str) -> Result<Geodetic, String> {
    let form = "must be LAT,LON,AMSL: LAT within -90 to 90 degrees, LON within -180 to 180 degrees, AMSL within -1000 to 10000 m";
    let numbers: Option<Vec<f64>> = text
        .split(',')
        .map(|part| part.trim().parse().ok())
        .collect();
    match numbers.as_deref() {
        Some(&[lat, lon, amsl]) if (-1e3..=1e4).contains(&amsl) => {
            Geodetic::from_degrees(lat, lon, amsl).ok_or_else(|| form.to_owned())
        }
        _ => Err(form.to_owned()),
    }
}
