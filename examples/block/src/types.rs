//! Content of a block, and its errors.

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::{
    ChannelLoad, Duration, Geodetic, Identity, Listen, Measure, Method, Mission, Profile, Settings,
    Wiring,
};

use super::BAUD;

/// Default of `probe_after_ms`, ms. It applies if the block has the value 0.
const DEFAULT_PROBE_AFTER_MS: u64 = 5_000;

/// Settings of one relay, decoded from its configuration block and checked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Config {
    /// Network number and index of this relay.
    pub identity: Identity,
    /// Mission shared by all relays.
    pub mission: Mission,
    /// Altitude and transmit power of this relay.
    pub profile: Profile,
    /// True if the relay keeps its configured altitude with a method that chooses altitudes.
    pub hold_altitude: bool,
    /// Placement method.
    pub method: Method,
    /// Settings for measuring the interference; `None` for no measurement.
    pub measure: Option<Measure>,
    /// Settings for estimating an unknown interferer from measurements; `None` without such an estimation.
    pub listen: Option<Listen>,
    /// Tx and Rx positions, and the drone's speed limit; `None` without an autopilot. `uav_relay::flight::course`
    /// checks these values.
    pub sites: Option<Sites>,
    /// Silence after which a neighbour is asked for a heartbeat, ms; 0 for the default, 5 s.
    pub probe_after_ms: u32,
    /// Number of relays that the leader keeps in the chain; 0 for a fleet without spares. For an image with the feature
    /// `departures`: `Settings::flying`.
    pub flying: u16,
    /// True if this relay waits outside of the chain as a spare at its start: `Relay::wait_as_spare`.
    pub spare: bool,
}

impl Config {
    /// Returns the relay's settings, without signing key, guard (collision avoidance) and [`Self::flying`].
    pub fn settings(&self, wiring: Wiring) -> Settings {
        let common = self.mission.config().common;
        let preset = match wiring {
            Wiring::Pair => Settings::wires(BAUD),
            Wiring::Shared => Settings::radio(BAUD, ChannelLoad::of_radios(self.mission.relays())),
        };
        let probe_after_ms = match self.probe_after_ms {
            0 => DEFAULT_PROBE_AFTER_MS,
            ms => ms.into(),
        };
        Settings {
            // An upload may change the profile of a relay that has the mission's common profile.
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

/// Tx and Rx positions, and the speed limit of a drone with an autopilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sites {
    /// Tx and Rx: latitude and longitude, 1e-7 degrees, and ground height, mm.
    pub ends: [[i32; 3]; 2],
    /// Maximum speed of the drone, m/s: 0.1 to 20, or 0 for the default, 5 m/s.
    pub speed_m_s: f32,
}

impl Sites {
    /// Returns the positions in the library's type.
    pub fn on_earth(&self) -> uav_relay::Sites {
        let [tx, rx] = self.ends.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        uav_relay::Sites { tx, rx }
    }
}

/// Signing key of the network, and the smallest epoch that the relay may use.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Secret {
    /// Signing key of the network, not all 0.
    pub key: [u8; 32],
    /// Smallest permitted epoch, 1 to 4294967294. The relay raises its epoch at every start.
    pub epoch: u32,
}

impl core::fmt::Debug for Secret {
    /// Prints `Secret(..)`, so that the key is not logged.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Channel parameters as stored in a configuration block.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChannelNumbers {
    /// Carrier frequency of the radio channel, Hz.
    pub carrier_hz: f64,
    /// Excess loss with line of sight, as a factor.
    pub excess_los: f64,
    /// Excess loss without line of sight, as a factor.
    pub excess_nlos: f64,
    /// Weight of the path loss with line of sight between drone and ground, 0 to 1.
    pub los_weight: f64,
}

impl ChannelNumbers {
    /// Returns the channel. A weight of exactly 1 gives [`AirGround::Los`], a weight of exactly 0 [`AirGround::Nlos`],
    /// both bit-identical.
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

/// Reason why a configuration block is rejected.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ConfigError {
    /// The configuration block is blank: all bits one, as after an erase, or all zero.
    Blank,
    /// The first bytes are wrong: the block does not begin with [`MAGIC`](super::MAGIC).
    Magic,
    /// The format version of the block is unknown, or its length is wrong for that version.
    Version,
    /// The CRC is wrong: the block was cut short or damaged.
    Crc,
    /// The index of the relay is not within 1 to the number of relays.
    Index,
    /// The altitude or power of this relay is out of range.
    Profile,
    /// The altitude flag is neither 0 nor 1.
    Hold,
    /// The placement method is unknown, or it is not `align` although the block has interference points.
    Method,
    /// The parameters of the method adjust are out of range, or not 0 although the method is not adjust.
    Adjust,
    /// The measurement settings are out of range, or they have a maximum power but no number of samples.
    Measure,
    /// The settings for estimating an interferer are out of range, or combined with interference points.
    Listen,
    /// The block combines the joint method, an unknown interferer, and traffic both from Tx to Rx and back.
    Reverse,
    /// Fitted slots (as long as each hop needs) require the joint method and a known interferer.
    Fitted,
    /// The block has both an interferer and interference points.
    Interferer,
    /// The block's number of interference points exceeds [`MAX_POINTS`](super::MAX_POINTS).
    Points,
    /// Bytes after the last interference point are not 0.
    Unused,
    /// The block has a signing key without an epoch, an epoch without a key, or the epoch 4294967295.
    Secret,
    /// The maximum speed is out of range, or the positions of transmitter and receiver are missing.
    Speed,
    /// The block has an autopilot key, but no Tx and Rx positions, without which there is no autopilot.
    AutopilotKey,
    /// `probe_after_ms` exceeds its maximum.
    Silence,
    /// The mark of a spare is neither 0 nor 1.
    Spare,
    /// An interference point is out of range.
    Field(FieldError),
    /// A parameter of the channel is out of range.
    Channel(ChannelError),
    /// A parameter of the mission is out of range.
    Mission(MissionError),
}
