//! Options for missions that the ground uploads in flight.

use crate::command::{Failure, number};
use crate::simulator::setup::UploadSpec;
use clap::{Args, ValueEnum};
use uav_relay::flight::axis::Axis;
use uav_relay::mission::MissionError;
use uav_relay::{
    Band, Geodetic, Instant, Interference, Interferer, Mission, MissionConfig, Profile, Side,
    Sites, Upload, UploadError,
};
use uav_relay_scenario::number::narrow;

use super::time::instant;

/// Command-line options for missions that a ground station uploads during the run.
#[derive(Args, Debug)]
pub struct Uploads {
    /// Upload the scenario's mission with changed values, at second S of virtual time. Keys as in a scenario file: x_m, y_m
    /// and power_w of the interferer, altitude_m, altitude_min_m, altitude_max_m, lateral_min_m, lateral_max_m, min_separation_m,
    /// distance_m, tx_w, uav_w, rx_w; reverse and noise_w, 0 to 1; fitted_gap, 0 or 1 to 1000; and tolerance. If the scenario has
    /// sites, tx_lat_deg, tx_lon_deg and tx_amsl_m move Tx, and rx_lat_deg and so on Rx; the distance follows. Repeatable: the
    /// first upload is version 1 of the mission
    #[arg(long, value_name = "S[:KEY=VALUE,..]", value_parser = planned)]
    upload: Vec<Planned>,
    /// End of the chain from which the missions are uploaded; default tx
    #[arg(long, value_name = "END", value_enum)]
    upload_from: Option<End>,
    /// Discard uploads at a reboot: a rebooted relay starts with the scenario's mission
    #[arg(long)]
    no_store: bool,
    /// End of the chain whose ground station requests the relays' reports. `cargo replay` shows a --capture only with them
    #[arg(
        long,
        value_name = "END",
        value_enum,
        requires = "fly",
        conflicts_with = "no_auth"
    )]
    watch: Option<End>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
enum End {
    /// Transmitter
    Tx,
    /// Receiver
    Rx,
}

impl End {
    const fn side(self) -> Side {
        match self {
            Self::Tx => Side::Upstream,
            Self::Rx => Side::Downstream,
        }
    }
}

#[derive(Clone, PartialEq, Debug)]
struct Planned {
    text: String,
    at: Instant,
    changes: Vec<(Key, f64)>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Key {
    X,
    Y,
    Power,
    Altitude,
    Floor,
    Ceiling,
    Left,
    Right,
    Separation,
    Distance,
    TxPower,
    UavPower,
    Noise,
    Reverse,
    RxPower,
    FittedGap,
    Tolerance,
    TxLatitude,
    TxLongitude,
    TxHeight,
    RxLatitude,
    RxLongitude,
    RxHeight,
}

/// Parameters that `--upload` can change: name in the option, kind, smallest and largest value.
///
/// Most names are keys of scenario files; `tx_lat_deg` and similar ones are the geographic positions of Tx and Rx.
const KEYS: [(&str, Key, f64, f64); 23] = [
    ("x_m", Key::X, -1e7, 1e7),
    ("y_m", Key::Y, -1e7, 1e7),
    ("power_w", Key::Power, 1e-6, 1e9),
    ("altitude_m", Key::Altitude, 0.1, 1e5),
    ("altitude_min_m", Key::Floor, 0.1, 1e5),
    ("altitude_max_m", Key::Ceiling, 0.1, 1e5),
    ("lateral_min_m", Key::Left, -1e5, 0.0),
    ("lateral_max_m", Key::Right, 0.0, 1e5),
    ("min_separation_m", Key::Separation, 0.0, 1e5),
    ("distance_m", Key::Distance, 1.0, 1e6),
    ("tx_w", Key::TxPower, 1e-6, 1e6),
    ("uav_w", Key::UavPower, 1e-6, 1e6),
    ("noise_w", Key::Noise, 0.0, 1.0),
    ("reverse", Key::Reverse, 0.0, 1.0),
    ("rx_w", Key::RxPower, 1e-6, 1e6),
    ("fitted_gap", Key::FittedGap, 0.0, 1e3),
    ("tolerance", Key::Tolerance, 1e-6, 0.1),
    ("tx_lat_deg", Key::TxLatitude, -90.0, 90.0),
    ("tx_lon_deg", Key::TxLongitude, -180.0, 180.0),
    ("tx_amsl_m", Key::TxHeight, -1e3, 1e4),
    ("rx_lat_deg", Key::RxLatitude, -90.0, 90.0),
    ("rx_lon_deg", Key::RxLongitude, -180.0, 180.0),
    ("rx_amsl_m", Key::RxHeight, -1e3, 1e4),
];

impl Uploads {
    /// Returns true if the options request at least one upload of a mission.
    pub fn are_planned(&self) -> bool {
        !self.upload.is_empty()
    }

    /// Returns true if a relay still has an uploaded mission after a reboot. False with `--no-store`.
    pub fn are_stored(&self) -> bool {
        !self.no_store
    }

    /// Returns the end of the chain whose ground station requests reports, and the time when it begins. `None` if no
    /// ground station requests reports.
    pub fn watches(&self) -> Option<(Side, Instant)> {
        self.watch
            .map(|end| (end.side(), Instant::from_millis(1_000)))
    }

    /// Rejects upload options without `--upload`, and `--no-store` if no relay reboots (`boots` is false).
    pub fn agree(&self, boots: bool) -> Result<(), Failure> {
        let given = match (self.upload_from, self.no_store) {
            (Some(End::Tx), _) => "--upload-from tx",
            (Some(End::Rx), _) => "--upload-from rx",
            (None, true) => "--no-store",
            (None, false) => return Ok(()),
        };
        if !self.are_planned() {
            let line = format!("{given}: has no effect without --upload");
            return Err(Failure::input(line));
        }
        if self.no_store && !boots {
            let line = "--no-store: has no effect, because no relay reboots (--boot)";
            return Err(Failure::input(line));
        }
        Ok(())
    }

    /// Returns each `--upload` option as text, for error messages, and the start of the upload.
    pub fn begins(&self) -> impl Iterator<Item = (String, Instant)> {
        let name = |one: &Planned| (format!("--upload {}", one.text), one.at);
        self.upload.iter().map(name)
    }

    /// Returns the start time of each upload of a mission.
    pub fn times(&self) -> impl Iterator<Item = Instant> {
        self.upload.iter().map(|one| one.at)
    }

    /// Returns the uploads in order of time, with versions from 1.
    ///
    /// `base` is the mission that the relays have at the start. `sites` are the geographic positions of Tx and Rx,
    /// `None` if the scenario has none.
    pub fn of(&self, base: &Mission, sites: Option<Sites>) -> Result<Vec<UploadSpec>, Failure> {
        let end = self.upload_from.unwrap_or(End::Tx).side();
        let mut planned: Vec<&Planned> = self.upload.iter().collect();
        planned.sort_by_key(|one| one.at);
        let specs = (1_u16..).zip(planned).map(|(version, one)| {
            let refused = |why: &dyn std::fmt::Display| {
                Failure::input(format!("--upload {}: {why}", one.text))
            };
            let moved = one.moved(sites).map_err(|why| refused(&why))?;
            let mut config = one.changed(base.config()).map_err(|why| refused(&why))?;
            if let Some(sites) = moved
                && !one.changes.iter().any(|(key, _)| *key == Key::Distance)
            {
                let axis = Axis::between(sites).map_err(|why| refused(&why))?;
                config.distance_m = narrow(axis.distance_m());
            }
            let mut upload = Upload::new(base, version, config)
                .map_err(|why| refused(&in_keys(why, &config)))?;
            if let Some(sites) = moved {
                upload = upload.with_sites(sites).map_err(|why| refused(&why))?;
            }
            Ok(UploadSpec {
                end,
                at: one.at,
                upload,
            })
        });
        specs.collect()
    }
}

impl Planned {
    /// Returns the new geographic positions of Tx and Rx; `None` if the upload changes neither position.
    ///
    /// `sites` are the positions in the scenario, `None` if the scenario has no `[site]`.
    fn moved(&self, sites: Option<Sites>) -> Result<Option<Sites>, &'static str> {
        let of = |key| {
            let mut changes = self.changes.iter();
            changes.find(|(of, _)| *of == key).map(|(_, value)| *value)
        };
        let new = [
            [Key::TxLatitude, Key::TxLongitude, Key::TxHeight],
            [Key::RxLatitude, Key::RxLongitude, Key::RxHeight],
        ]
        .map(|keys| keys.map(of));
        if new.as_flattened().iter().all(Option::is_none) {
            return Ok(None);
        }
        let sites = sites.ok_or("the latitude, longitude and height of Tx or Rx can be changed only if the scenario has a [site]")?;
        let to = |at: Geodetic, [lat, lon, amsl]: [Option<f64>; 3]| {
            Geodetic::from_degrees(
                lat.unwrap_or(f64::from(at.lat_e7) / 1e7),
                lon.unwrap_or(f64::from(at.lon_e7) / 1e7),
                amsl.unwrap_or(f64::from(at.amsl_mm) / 1e3),
            )
            .unwrap_or(at)
        };
        let [tx, rx] = new;
        Ok(Some(Sites {
            tx: to(sites.tx, tx),
            rx: to(sites.rx, rx),
        }))
    }

    /// Returns the parameters of the uploaded mission: `base` with the values that `--upload` changes.
    fn changed(&self, base: &MissionConfig) -> Result<MissionConfig, &'static str> {
        let Interference::Source(at) = base.interference else {
            return Err("a [field] cannot be uploaded");
        };
        let to = |key, old| {
            let mut changes = self.changes.iter();
            changes
                .find(|(of, _)| *of == key)
                .map_or(old, |(_, value)| narrow(*value))
        };
        let common = Profile {
            altitude_m: to(Key::Altitude, base.common.altitude_m),
            power_w: to(Key::UavPower, base.common.power_w),
        };
        // A single altitude is the common one, even if that changes.
        let band = if base.band.is_single() {
            Band::at(common.altitude_m)
        } else {
            base.band
        };
        Ok(MissionConfig {
            distance_m: to(Key::Distance, base.distance_m),
            min_separation_m: to(Key::Separation, base.min_separation_m),
            tx_power_w: to(Key::TxPower, base.tx_power_w),
            common,
            band: Band {
                least_m: to(Key::Floor, band.least_m),
                most_m: to(Key::Ceiling, band.most_m),
            },
            lateral: Band {
                least_m: to(Key::Left, base.lateral.least_m),
                most_m: to(Key::Right, base.lateral.most_m),
            },
            interference: Interference::Source(Interferer {
                power_w: to(Key::Power, at.power_w),
                x_m: to(Key::X, at.x_m),
                y_m: to(Key::Y, at.y_m),
            }),
            noise_w: to(Key::Noise, base.noise_w),
            reverse: to(Key::Reverse, base.reverse),
            rx_power_w: to(Key::RxPower, base.rx_power_w),
            fitted_gap: to(Key::FittedGap, base.fitted_gap),
            tolerance: to(Key::Tolerance, base.tolerance),
            ..*base
        })
    }
}

/// Returns the reason why an upload with the parameters `config` is rejected. Parameters have their names in `--upload`.
fn in_keys(why: UploadError, config: &MissionConfig) -> String {
    match why {
        UploadError::Mission(MissionError::Band) => format!(
            "altitude_min_m {} must be at most, and altitude_max_m {} at least altitude_m {}",
            config.band.least_m, config.band.most_m, config.common.altitude_m
        ),
        UploadError::Mission(MissionError::TooManyForDistance) => format!(
            "{} relays that stay {} m apart (min_separation_m) do not fit into {} m (distance_m)",
            config.relays, config.min_separation_m, config.distance_m
        ),
        why => why.to_string(),
    }
}

fn planned(text: &str) -> Result<Planned, String> {
    let form = "must be S or S:KEY=VALUE,..: S is the start of the upload, 0 to 1e6 s, and each KEY a parameter of the mission that it changes";
    let (at, changes) = match text.split_once(':') {
        Some((at, changes)) => (at, Some(changes)),
        None => (text, None),
    };
    let at = instant(at).ok_or(form)?;
    let mut known: Vec<(Key, f64)> = Vec::new();
    for change in changes.into_iter().flat_map(|changes| changes.split(',')) {
        let (name, value) = change.split_once('=').ok_or(form)?;
        let Some((_, key, least, most)) = KEYS.into_iter().find(|(of, ..)| *of == name) else {
            let names: Vec<&str> = KEYS.into_iter().map(|(name, ..)| name).collect();
            return Err(format!(
                "{name} is not a known key; allowed: {}",
                names.join(", ")
            ));
        };
        if known.iter().any(|(of, _)| *of == key) {
            return Err(format!("{name} must be given once"));
        }
        let value = number(value, least, most).map_err(|range| format!("{name} {range}"))?;
        known.push((key, value));
    }
    Ok(Planned {
        text: text.to_owned(),
        at,
        changes: known,
    })
}
