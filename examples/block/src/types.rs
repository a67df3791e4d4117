//! What a block says, and what may be wrong with it.

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::{Duration, Geodetic, Identity, Listen, Measure, Method, Mission, Profile};

/// What the block says, checked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Config {
    /// Who this relay is.
    pub identity: Identity,
    /// What all relays agree on.
    pub mission: Mission,
    /// What this relay brings along.
    pub profile: Profile,
    /// Whether it keeps to that altitude when altitudes are chosen.
    pub hold_altitude: bool,
    /// What the leader has the chain do.
    pub method: Method,
    /// Whether and how the interference is measured.
    pub measure: Option<Measure>,
    /// Whether and how the chain finds its interferer.
    pub listen: Option<Listen>,
    /// Where the ends of the line are on earth. `uav_relay::flight::course` checks whether they make one.
    pub sites: Option<Sites>,
    /// Milliseconds of silence after which a neighbour is asked for a sign of life; 0 for the usual ones.
    pub probe_after_ms: u32,
}

impl Config {
    /// After which silence a neighbour is asked for a sign of life, and after which it counts as lost.
    pub const fn silence(&self) -> [Duration; 2] {
        let ms = match self.probe_after_ms {
            0 => 5_000,
            ms => ms as u64,
        };
        [Duration::from_millis(ms), Duration::from_millis(3 * ms)]
    }
}

/// Where a drone with an autopilot flies.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Sites {
    /// Latitude and longitude of transmitter and receiver, 1e-7 degrees, and the ground's height there, mm.
    pub ends: [[i32; 3]; 2],
    /// The drone's greatest speed, m/s: 0.1 to 20, or 0 for that of an autopilot that is told none.
    pub speed_m_s: f32,
}

impl Sites {
    /// Where they are.
    pub fn on_earth(&self) -> uav_relay::Sites {
        let [tx, rx] = self.ends.map(|[lat_e7, lon_e7, amsl_mm]| Geodetic {
            lat_e7,
            lon_e7,
            amsl_mm,
        });
        uav_relay::Sites { tx, rx }
    }
}

/// What frames are signed with.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Secret {
    /// The network's key, not all 0.
    pub key: [u8; 32],
    /// The least epoch, 1 to 4294967294.
    pub epoch: u32,
}

impl core::fmt::Debug for Secret {
    /// Without the key, which does not belong into logs.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret(..)")
    }
}

/// The channel as the block has it; a [`Channel`] does not keep these numbers.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ChannelNumbers {
    /// Carrier, Hz.
    pub carrier_hz: f64,
    /// Excess loss with line of sight, as a factor.
    pub excess_los: f64,
    /// Excess loss without, as a factor.
    pub excess_nlos: f64,
    /// Weight of line of sight between drone and ground.
    pub los_weight: f64,
}

impl ChannelNumbers {
    /// The channel of these numbers. A weight of exactly 1 or 0 gives [`AirGround::Los`] or [`AirGround::Nlos`] to the bit.
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

/// What is wrong with a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ConfigError {
    /// Nothing has been written: all ones as erased, or all zeros.
    Blank,
    /// It does not begin with [`MAGIC`](super::MAGIC).
    Magic,
    /// It is of another version, or of another length than that version has.
    Version,
    /// The CRC does not match: it was cut short or damaged.
    Crc,
    /// The index is not within 1 to N.
    Index,
    /// The altitude or the power of this relay is out of range.
    Profile,
    /// What says whether the altitude is kept is neither 0 nor 1.
    Hold,
    /// The method is unknown, or chooses altitudes in a field.
    Method,
    /// Rounds or altitudes of adjust are out of range, or not 0 with another method.
    Adjust,
    /// What is said of measuring is out of range, or not 0 without samples.
    Measure,
    /// What is said of listening is out of range, or there is a field.
    Listen,
    /// There is a field, and the interferer is not 0.
    Interferer,
    /// There are more points than a block has room for.
    Points,
    /// What is behind the last point is not 0.
    Unused,
    /// There is a key without an epoch, or the other way round, or the epoch has none after it.
    Secret,
    /// The greatest speed is out of range, or there is one without sites.
    Speed,
    /// There is a key for an autopilot, and no sites.
    AutopilotKey,
    /// The silence after which a neighbour is asked is out of range.
    Silence,
    /// This number of the field is out of range.
    Field(FieldError),
    /// This number of the channel is out of range.
    Channel(ChannelError),
    /// This number of the mission is out of range.
    Mission(MissionError),
}
