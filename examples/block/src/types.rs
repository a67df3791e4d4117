//! Content of a block, and its errors.

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::{
    ChannelLoad, Duration, Geodetic, Identity, Listen, Measure, Method, Mission, Profile, Settings,
    Wiring,
};

use super::BAUD;

/// Silence until a neighbour is probed where the block has 0, ms.
const USUAL_PROBE_AFTER_MS: u64 = 5_000;

/// Checked content of a block.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Config {
    /// Network and index of this relay.
    pub identity: Identity,
    /// Mission shared by all relays.
    pub mission: Mission,
    /// Altitude and power of this relay.
    pub profile: Profile,
    /// True if the relay keeps that altitude when altitudes are chosen.
    pub hold_altitude: bool,
    /// Method used by the leader.
    pub method: Method,
    /// Measurement of the interference, if enabled.
    pub measure: Option<Measure>,
    /// Sensing of the interferer, if enabled.
    pub listen: Option<Listen>,
    /// Ends of the line on earth. `uav_relay::flight::course` checks that they form a valid line.
    pub sites: Option<Sites>,
    /// Silence until a neighbour is probed, ms; 0 for the default.
    pub probe_after_ms: u32,
}

impl Config {
    /// Returns the settings of the relay, without the key and the guard.
    pub fn settings(&self, wiring: Wiring) -> Settings {
        let common = self.mission.config().common;
        let preset = match wiring {
            Wiring::Pair => Settings::wires(BAUD),
            Wiring::Shared => Settings::radio(BAUD, ChannelLoad::of_radios(self.mission.relays())),
        };
        let probe_after_ms = match self.probe_after_ms {
            0 => USUAL_PROBE_AFTER_MS,
            ms => ms.into(),
        };
        Settings {
            // A profile equal to the common one may change with an upload.
            profile: Some(self.profile).filter(|own| self.hold_altitude || *own != common),
            hold_altitude: self.hold_altitude,
            method: self.method,
            measure: self.measure,
            listen: self.listen,
            sited: self.sites.is_some(),
            ..preset.with_probe_after(Duration::from_millis(probe_after_ms))
        }
    }
}

/// Line and speed of a drone with an autopilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sites {
    /// Sites of transmitter and receiver: latitude and longitude, 1e-7 degrees, and ground height, mm.
    pub ends: [[i32; 3]; 2],
    /// Maximum speed of the drone, m/s: 0.1 to 20, or 0 for the default.
    pub speed_m_s: f32,
}

impl Sites {
    /// Returns the sites as geodetic positions.
    pub fn on_earth(&self) -> uav_relay::Sites {
        let [tx, rx] = self.ends.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        uav_relay::Sites { tx, rx }
    }
}

/// Signing key and epoch.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Secret {
    /// Key of the network, not all 0.
    pub key: [u8; 32],
    /// Smallest epoch to sign with after a start, 1 to 4294967294.
    pub epoch: u32,
}

impl core::fmt::Debug for Secret {
    /// Hides the key, which does not belong in logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Channel parameters as stored; a [`Channel`] does not keep these numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChannelNumbers {
    /// Carrier, Hz.
    pub carrier_hz: f64,
    /// Excess loss with line of sight, as a factor.
    pub excess_los: f64,
    /// Excess loss without line of sight, as a factor.
    pub excess_nlos: f64,
    /// Weight of line of sight between drone and ground.
    pub los_weight: f64,
}

impl ChannelNumbers {
    /// Returns the channel. A weight of exactly 1 or 0 gives bit-identical [`AirGround::Los`] or [`AirGround::Nlos`].
    ///
    /// # Errors
    /// [`ChannelError`] names the number that is out of range.
    pub const fn channel(&self) -> Result<Channel, ChannelError> {
        Channel::new(
            self.carrier_hz,
            self.excess_los,
            self.excess_nlos,
            AirGround::Weighted(self.los_weight),
        )
    }
}

/// Fault of a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ConfigError {
    /// Blank block: all ones as erased, or all zeros.
    Blank,
    /// Wrong first bytes, not [`MAGIC`](super::MAGIC).
    Magic,
    /// Wrong version, or wrong length for that version.
    Version,
    /// Wrong CRC: the block was cut short or damaged.
    Crc,
    /// Index not within 1 to N.
    Index,
    /// Altitude or power of this relay out of range.
    Profile,
    /// Altitude flag neither 0 nor 1.
    Hold,
    /// Unknown method, or one other than align with a field.
    Method,
    /// Parameters of adjust out of range, or not 0 with another method.
    Adjust,
    /// Measurement settings out of range, or not 0 without samples.
    Measure,
    /// Sensing settings out of range, or together with a field.
    Listen,
    /// A way back together with the joint method.
    Reverse,
    /// Interferer is not 0 in a block with a field.
    Interferer,
    /// The number of points exceeds a block's capacity.
    Points,
    /// Non-zero bytes behind the last point.
    Unused,
    /// Key without an epoch, epoch without a key, or the last possible epoch.
    Secret,
    /// Maximum speed out of range, or given without sites.
    Speed,
    /// Autopilot key without sites.
    AutopilotKey,
    /// Silence until a neighbour is probed out of range.
    Silence,
    /// Parameter of the field out of range.
    Field(FieldError),
    /// Parameter of the channel out of range.
    Channel(ChannelError),
    /// Parameter of the mission out of range.
    Mission(MissionError),
}
