//! Content of a block, and its errors.

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::{
    ChannelLoad, Duration, Geodetic, Identity, Listen, Measure, Method, Mission, Profile, Settings,
    Wiring,
};

use super::BAUD;

/// Default silence of a neighbour, ms, after which a heartbeat is requested. It applies if the block's value is 0.
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
    /// True if the relay keeps its configured altitude when the method chooses altitudes.
    pub hold_altitude: bool,
    /// Placement method that the leader of the chain runs.
    pub method: Method,
    /// Settings for measuring the interference at the relay, if the block gives its distribution along x. `None` for
    /// no measurement.
    pub measure: Option<Measure>,
    /// Settings for estimating an unknown interferer from measurements; `None` if it is not estimated.
    pub listen: Option<Listen>,
    /// Surveyed positions of Tx and Rx, and speed limit of the drone; `None` without an autopilot.
    /// `uav_relay::flight::course` checks that the positions form a valid line.
    pub sites: Option<Sites>,
    /// Silence of a neighbour after which a heartbeat is requested from it, ms; 0 for the default, 5 s.
    pub probe_after_ms: u32,
}

impl Config {
    /// Returns the relay's settings for this configuration. The caller has to add the signing key and the guard
    /// (collision avoidance).
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

/// Surveyed positions of transmitter and receiver, and speed limit of a drone with an autopilot.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sites {
    /// Positions of transmitter and receiver: latitude and longitude, 1e-7 degrees, and ground height, mm.
    pub ends: [[i32; 3]; 2],
    /// Maximum speed of the drone, m/s: 0.1 to 20, or 0 for the default, 5 m/s.
    pub speed_m_s: f32,
}

impl Sites {
    /// Returns the positions of transmitter and receiver in the library's type.
    pub fn on_earth(&self) -> uav_relay::Sites {
        let [tx, rx] = self.ends.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        uav_relay::Sites { tx, rx }
    }
}

/// Signing key of the network, and the smallest epoch that the relay may sign with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Secret {
    /// Signing key of the network, not all 0.
    pub key: [u8; 32],
    /// Smallest epoch that the relay may sign with, 1 to 4294967294. The epoch is a number that rises at every start.
    pub epoch: u32,
}

impl core::fmt::Debug for Secret {
    /// Prints `Secret(..)` instead of the key, which does not belong in logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// Channel parameters as stored in a configuration block. A [`Channel`] does not keep these numbers.
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
    /// Returns the channel with these parameters. A weight of exactly 1 or 0 gives bit-identical [`AirGround::Los`]
    /// or [`AirGround::Nlos`].
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

/// Fault because of which a configuration block is rejected.
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
    /// The flag for keeping this relay's altitude is neither 0 nor 1.
    Hold,
    /// The placement method is unknown. Or it is not align although the block gives the interference as a distribution
    /// along x.
    Method,
    /// The parameters of the method adjust are out of range, or not 0 with another method.
    Adjust,
    /// The settings for measuring the interference are out of range. Or they give a maximum power but no number of
    /// samples.
    Measure,
    /// The settings for estimating an unknown interferer are out of range. Or they are given although the block has the
    /// interference as a distribution along x.
    Listen,
    /// The block combines three things that exclude each other. They are the joint method, an unknown interferer, and
    /// traffic from receiver to transmitter.
    Reverse,
    /// The block requests fitted slots, but lacks the joint method or a known interferer. Fitted slots are time slots
    /// as long as each hop needs.
    Fitted,
    /// The block has both an interferer and the interference as a distribution along x.
    Interferer,
    /// The interference's distribution along x has more points than a block can have.
    Points,
    /// Bytes after the last point of the interference's distribution along x are not 0.
    Unused,
    /// The block has a signing key without an epoch, an epoch without a key, or the epoch 4294967295.
    Secret,
    /// The maximum speed is out of range, or given without the positions of transmitter and receiver.
    Speed,
    /// The block has a signing key for the autopilot, but no autopilot: it lacks the Tx and Rx positions.
    AutopilotKey,
    /// The silence of a neighbour after which a heartbeat is requested exceeds its maximum.
    Silence,
    /// A parameter of the interference's distribution along x is out of range.
    Field(FieldError),
    /// A parameter of the channel is out of range.
    Channel(ChannelError),
    /// A parameter of the mission is out of range.
    Mission(MissionError),
}
