//! Where the transmitter and the receiver are on earth, as options give it.

use clap::Args;
use uav_relay::flight::axis::Axis;
use uav_relay::flight::geodetic::Geodetic;

/// The two ends of the line.
#[derive(Args, Debug)]
pub(crate) struct SiteOptions {
    /// Where the transmitter is: latitude and longitude, degrees (WGS84), and the ground's height above the mean sea level, m
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_rx", allow_hyphen_values = true, value_parser = site)]
    site_tx: Option<Geodetic>,
    /// Where the receiver is
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    site_rx: Option<Geodetic>,
}

impl SiteOptions {
    /// The line between the two, if they were given, for a mission over `distance_m` metres.
    ///
    /// # Errors
    /// One line that says what is wrong.
    pub(crate) fn axis(&self, distance_m: f32) -> Result<Option<Axis>, String> {
        let (Some(tx), Some(rx)) = (self.site_tx, self.site_rx) else {
            return Ok(None);
        };
        let axis = Axis::try_new(tx, rx).map_err(|error| format!("--site-rx: {error}"))?;
        if axis.is_of(distance_m) {
            return Ok(Some(axis));
        }
        Err(format!(
            "--distance {distance_m}: must be {:.3} m, as --site-tx and --site-rx have it",
            axis.distance_m()
        ))
    }
}

/// Latitude, longitude, height.
fn site(text: &str) -> Result<Geodetic, String> {
    let form = "must be LAT,LON,AMSL: degrees within -90 to 90 and -180 to 180, and metres within -1000 to 10000";
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
