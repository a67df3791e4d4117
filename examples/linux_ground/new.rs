//! Options of a new mission, which begin with `--new-`.

use core::fmt;

use clap::Args;
use uav_relay::UploadError;
use uav_relay::flight::axis::Axis;
use uav_relay::{
    Band, Geodetic, Interference, Interferer, Mission, MissionConfig, Placement, Profile, Sites,
    Upload,
};
use uav_relay_linux::command::number;
use uav_relay_linux::mission::{
    ALTITUDE_M, DISTANCE_M, LEFT_M, NOISE_W, POWER_W, RIGHT_M, SEPARATION_M, band, interferer,
    mission,
};
use uav_relay_linux::site::{site, swapped};

/// Options of a new mission; values that are not given stay as they are flown.
#[derive(Args, Clone, Debug)]
#[group(id = "new", multiple = true, requires = "version")]
#[expect(clippy::struct_field_names, reason = "as the options are called")]
pub(crate) struct NewOptions {
    /// New position of the transmitter; sets the distance, too. Without it and --new-site-rx the relays stay on their present
    /// line
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    new_site_tx: Option<Geodetic>,
    /// New position of the receiver
    #[arg(long, value_name = "LAT,LON,AMSL", requires = "site_tx", allow_hyphen_values = true, value_parser = site)]
    new_site_rx: Option<Geodetic>,
    /// New distance from transmitter to receiver, m, 1 to 1e6
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = number(DISTANCE_M, "m"))]
    new_distance: Option<f32>,
    /// New altitude of every relay, m, 0.1 to 1e4
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = number(ALTITUDE_M, "m"))]
    new_altitude: Option<f32>,
    /// New range of altitudes to choose from, m, 0.1 to 1e4. Default: the present range, or the new altitude alone if the present
    /// range is a single one
    #[arg(long, value_name = "LEAST,MOST", allow_hyphen_values = true, value_parser = band)]
    new_band: Option<Band>,
    /// New left limit of the relays' positions, facing the receiver, as y in m, -1e5 to 0
    #[arg(long = "new-lateral-min-m", value_name = "M", allow_negative_numbers = true, value_parser = number(LEFT_M, "m"))]
    new_lateral_min: Option<f32>,
    /// New right limit of the relays' positions, facing the receiver, as y in m, 0 to 1e5
    #[arg(long = "new-lateral-max-m", value_name = "M", allow_negative_numbers = true, value_parser = number(RIGHT_M, "m"))]
    new_lateral_max: Option<f32>,
    /// New power of the transmitter, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = number(POWER_W, "W"))]
    new_tx_power: Option<f32>,
    /// New power of every relay, W, 1e-6 to 1e6
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = number(POWER_W, "W"))]
    new_uav_power: Option<f32>,
    /// New interferer: power (W, 1e-6 to 1e9) and position (m, -1e7 to 1e7). The position is along the line to the receiver, and to
    /// the right of it
    #[arg(long, value_name = "P,X,Y", allow_hyphen_values = true, value_parser = interferer)]
    new_interferer: Option<Interferer>,
    /// New noise power at every receiver, W, 0 to 1
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = number(NOISE_W, "W"))]
    new_noise: Option<f32>,
    /// New minimum distance between two relays, m, 0 to 1e5
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = number(SEPARATION_M, "m"))]
    new_min_separation: Option<f32>,
}

/// Minimum distance of two relays along the line Tx to Rx at which their order is certain, m.
///
/// It is twice the companion's default position error.
const ORDER_M: f32 = 2.0;

/// Permitted distance of a new line Tx-Rx from the present line, m, beyond the new line's length.
///
/// A new line farther away is rejected, because the drones' positions could not be converted to its coordinates.
const FAR_M: f64 = 100_000.0;

/// Mission whose values are kept unless a `--new-` option changes them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Basis {
    pub(crate) config: MissionConfig,
    pub(crate) line: Option<Sites>,
    /// Upload that brought this mission to the relays; `None` for the mission loaded before flight.
    pub(crate) upload: Option<Upload>,
}

impl Basis {
    /// Returns the mission loaded before flight as the basis of a new mission.
    ///
    /// `sited` are the Tx and Rx positions of the loaded mission; `None` if they were not given.
    pub(crate) const fn loaded(loaded: &Mission, sited: Option<Sites>) -> Self {
        Self {
            config: *loaded.config(),
            line: sited,
            upload: None,
        }
    }

    /// Returns an uploaded mission as the basis of a new mission. If the upload has no Tx and Rx positions, the basis
    /// has the positions `sited` of the mission loaded before flight.
    pub(crate) fn flown(upload: Upload, sited: Option<Sites>) -> Self {
        Self {
            config: *upload.config(),
            line: upload.sites().or(sited),
            upload: Some(upload),
        }
    }
}

impl NewOptions {
    /// Returns the upload that changes the mission `basis` by these options. `loaded` and `sited` are the mission and
    /// the Tx and Rx positions that were loaded into the relays before flight.
    pub(crate) fn upload(
        &self,
        version: u16,
        loaded: &Mission,
        sited: Option<Sites>,
        basis: &Basis,
    ) -> Result<Upload, String> {
        let own = basis.upload.and_then(|upload| upload.sites());
        let (sites, along_m) = match self.moved(basis.line, &basis.config)? {
            Some((sites, along_m)) => (Some(sites), Some(along_m)),
            None => (own, None),
        };
        let config = self.changed(&basis.config, along_m);
        let kept_m = match own {
            Some(_) => basis.config.distance_m,
            None => loaded.config().distance_m,
        };
        let keeps = along_m.is_none() && (sited.is_some() || own.is_some());
        if keeps && config.distance_m.to_bits() != kept_m.to_bits() {
            return Err(format!(
                "--new-distance {}: must be {kept_m} m, because Tx and Rx stay at their sites; to change the distance, give --new-site-tx or --new-site-rx",
                config.distance_m
            ));
        }
        mission(config, "--new-")?;
        let refused = |error: UploadError| error.to_string();
        let upload = Upload::new(loaded, version, config).map_err(refused)?;
        match sites {
            Some(sites) => upload.with_sites(sites).map_err(refused),
            None => Ok(upload),
        }
    }

    /// Returns the options with the receiver moved to x and y, m, on the line of the mission `basis`. The receiver
    /// keeps its height.
    ///
    /// # Errors
    /// One line if the position is too far from the line, or if y is not 0 although the mission has no Tx and Rx
    /// positions.
    pub(crate) fn with_receiver(
        &self,
        receiver_m: Option<[f32; 2]>,
        basis: &Basis,
    ) -> Result<Self, String> {
        let Some([x_m, y_m]) = receiver_m else {
            return Ok(self.clone());
        };
        let Some(line) = basis.line else {
            if y_m != 0.0 {
                return Err(format!(
                    "receiver at y {y_m} m: must be 0 m, because the mission has no sites (positions of Tx and Rx on earth), so the receiver can only move along the line from Tx to Rx"
                ));
            }
            let distance_m = number(DISTANCE_M, "m")(&x_m.to_string());
            return Ok(Self {
                new_distance: Some(
                    distance_m.map_err(|why| format!("receiver at x {x_m} m: {why}"))?,
                ),
                ..self.clone()
            });
        };
        let at = Placement {
            x_m,
            y_m,
            altitude_m: 0.0,
        };
        let axis = Axis::between(line).ok();
        let site = axis.and_then(|axis| axis.point(at)).ok_or_else(|| {
            format!("receiver at x {x_m} m, y {y_m} m: must be at most {:.0} m from the line from Tx to Rx", Axis::AROUND_M)
        })?;
        Ok(Self {
            new_site_rx: Some(Geodetic {
                amsl_mm: line.rx.amsl_mm,
                ..site
            }),
            ..self.clone()
        })
    }

    /// Returns the new mission's Tx and Rx positions and their distance, m. `None` if Tx and Rx stay where they are.
    fn moved(
        &self,
        line: Option<Sites>,
        config: &MissionConfig,
    ) -> Result<Option<(Sites, f32)>, String> {
        let (tx, rx) = (self.new_site_tx, self.new_site_rx);
        let Some(line) = line.filter(|_| tx.is_some() || rx.is_some()) else {
            return Ok(None);
        };
        let sites = Sites {
            tx: tx.unwrap_or(line.tx),
            rx: rx.unwrap_or(line.rx),
        };
        let name = if rx.is_some() { "rx" } else { "tx" };
        let named = |error: &dyn fmt::Display| format!("--new-site-{name}: {error}");
        let axis = Axis::between(sites).map_err(|error| named(&error))?;
        let before = Axis::between(line).map_err(|error| named(&error))?;
        check_distance(&before, &axis, sites).map_err(|line| named(&line))?;
        let (turn, most) = (before.turn_rad(&axis).to_degrees(), most_turn_deg(config));
        if turn > most {
            return Err(named(&format_args!(
                "turns the line from Tx to Rx by {turn:.1} degrees: must turn it by at most {most:.1}, so that relays {} m apart keep their order along the line",
                config.min_separation_m
            )));
        }
        #[expect(clippy::cast_possible_truncation, reason = "as a mission has it")]
        let along_m = axis.distance_m() as f32;
        match self.new_distance {
            Some(given) if !axis.is_of(given) => Err(format!(
                "--new-distance {given}: must be {along_m:.3} m, the distance between the new sites, or be left out"
            )),
            _ => Ok(Some((sites, along_m))),
        }
    }

    fn changed(&self, basis: &MissionConfig, along_m: Option<f32>) -> MissionConfig {
        let altitude_m = self.new_altitude.unwrap_or(basis.common.altitude_m);
        // A range of a single altitude follows the new altitude.
        let is_alone = basis.band.least_m.to_bits() == basis.band.most_m.to_bits();
        let band = if is_alone {
            Band::at(altitude_m)
        } else {
            basis.band
        };
        MissionConfig {
            distance_m: self.new_distance.or(along_m).unwrap_or(basis.distance_m),
            min_separation_m: self.new_min_separation.unwrap_or(basis.min_separation_m),
            tx_power_w: self.new_tx_power.unwrap_or(basis.tx_power_w),
            common: Profile {
                altitude_m,
                power_w: self.new_uav_power.unwrap_or(basis.common.power_w),
            },
            band: self.new_band.unwrap_or(band),
            lateral: Band {
                least_m: self.new_lateral_min.unwrap_or(basis.lateral.least_m),
                most_m: self.new_lateral_max.unwrap_or(basis.lateral.most_m),
            },
            interference: self
                .new_interferer
                .map_or(basis.interference, Interference::Source),
            noise_w: self.new_noise.unwrap_or(basis.noise_w),
            ..*basis
        }
    }
}

/// Returns an error if the new line Tx to Rx is too far from the present line. The drones' positions could then not
/// be converted to the new line.
fn check_distance(before: &Axis, axis: &Axis, sites: Sites) -> Result<(), String> {
    let away_m = |tx, rx| {
        let ends = [tx, rx].map(|site| before.away_m(site).unwrap_or(f64::INFINITY));
        ends[0].min(ends[1])
    };
    let far_m = away_m(sites.tx, sites.rx);
    // The new or the present line may be the longer one.
    let most_m = axis.distance_m() + FAR_M;
    if far_m <= most_m {
        return Ok(());
    }
    let is_swapped = away_m(swapped(sites.tx), swapped(sites.rx)) <= most_m;
    let hint = if is_swapped {
        ": are latitude and longitude swapped?"
    } else {
        ""
    };
    Err(format!(
        "the new line from Tx to Rx is {:.0} km from that of the present mission: must be at most {:.0} km away{hint}",
        far_m / 1e3,
        most_m / 1e3
    ))
}

/// Returns the maximum angle, degrees, by which a new mission may turn the line Tx to Rx. Up to this angle the relays'
/// order along the line stays the same, with position errors of up to 1 m.
///
/// The maximum angle t solves s cos t - w sin t = a. Here s is the minimum separation, w the width of the lateral
/// range, and a the smaller of `ORDER_M` and s / 2.
fn most_turn_deg(config: &MissionConfig) -> f32 {
    let (separation_m, width_m) = (
        config.min_separation_m,
        config.lateral.most_m - config.lateral.least_m,
    );
    let most_m = separation_m.hypot(width_m);
    if most_m <= 0.0 {
        return 90.0;
    }
    let order_m = ORDER_M.min(0.5 * separation_m);
    let off = (order_m / most_m).acos();
    (off - width_m.atan2(separation_m)).max(0.0).to_degrees()
}
