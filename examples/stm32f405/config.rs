//! What is written into a drone once, apart from the image: which relay it is, and what it flies.
//!
//! One block at the start of the last flash sector, [`ADDRESS`], which no image reaches (`memory.x`) and no update touches.
//! `cargo brief` writes it from a scenario. All numbers are little-endian, floats as in IEEE 754:
//!
//! | byte | type | what |
//! | --- | --- | --- |
//! | 0 | 4 bytes | [`MAGIC`], "UAVR" |
//! | 4 | u16 | [`VERSION`] of this table |
//! | 6 | u16 | bytes of the block, [`LEN`] |
//! | 8 | u16 | index: which relay this is, 1 (next to the transmitter) to N |
//! | 10 | u16 | network: frames of any other are ignored |
//! | 12 | u16 | relays N |
//! | 14 | u16 | 0, for a later version |
//! | 16 | f32 | distance, m |
//! | 20 | f32 | least separation, m |
//! | 24 | f32 | power of the transmitter, W |
//! | 28 | f32 | altitude that the relays have in common, m |
//! | 32 | f32 | power that the relays have in common, W |
//! | 36 | f32 | altitude of this relay, m |
//! | 40 | f32 | power of this relay, W |
//! | 44 | f32 | power of the interferer, W |
//! | 48 | f32 | x of the interferer, m |
//! | 52 | f32 | y of the interferer, m |
//! | 56 | f32 | tolerance |
//! | 60 | f64 | carrier, Hz |
//! | 68 | f64 | excess loss with line of sight, as a factor |
//! | 76 | f64 | excess loss without, as a factor |
//! | 84 | f64 | weight of line of sight between drone and ground, 0 to 1 |
//! | 92 | u32 | CRC-32C of bytes 0 to 91 |
//!
//! The ranges are those of [`MissionConfig`], [`Channel::new`] and [`Profile`].

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::mission::MissionError;
use uav_relay::wire::crc::Crc32c;
use uav_relay::{Identity, Interferer, Mission, MissionConfig, Profile};

/// Where the block begins: the last sector of the flash of an STM32F405.
pub const ADDRESS: u32 = 0x080E_0000;

/// The first bytes of a block.
pub const MAGIC: [u8; 4] = *b"UAVR";

/// The version of the table above.
pub const VERSION: u16 = 1;

/// Bytes of a block.
pub const LEN: usize = 96;

/// Bytes that the check sequence covers.
const CHECKED: usize = LEN - 4;

/// [`LEN`] as the block states it.
const LEN_FIELD: u16 = 96;

/// A block as it is stored.
pub type Block = [u8; LEN];

/// What the block says, checked.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Config {
    /// Who this relay is.
    pub identity: Identity,
    /// What all relays agree on.
    pub mission: Mission,
    /// What this relay brings along.
    pub profile: Profile,
}

/// What is wrong with a block.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ConfigError {
    /// Nothing has been written: all ones as erased, or all zeros.
    Blank,
    /// It does not begin with [`MAGIC`].
    Magic,
    /// It is of another version, or of another length than that version has.
    Version,
    /// The CRC does not match: it was cut short or damaged.
    Crc,
    /// A byte that must be 0 is not.
    Reserved,
    /// The index is not within 1 to N.
    Index,
    /// The altitude or the power of this relay is out of range.
    Profile,
    /// This number of the channel is out of range.
    Channel(ChannelError),
    /// This number of the mission is out of range.
    Mission(MissionError),
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

/// Reads a block; whatever its bytes, it is a configuration or an error.
///
/// # Errors
/// [`ConfigError`] says what is wrong, and of a number which one.
#[inline(never)] // its stack is given back before the relay needs some
pub fn read(block: &Block) -> Result<Config, ConfigError> {
    if block.iter().all(|&byte| byte == 0xFF) || block.iter().all(|&byte| byte == 0) {
        return Err(ConfigError::Blank);
    }
    let mut rest = Reader(block);
    if rest.take() != MAGIC {
        return Err(ConfigError::Magic);
    }
    if rest.u16() != VERSION || rest.u16() != LEN_FIELD {
        return Err(ConfigError::Version);
    }
    let (checked, check) = block.split_at(CHECKED);
    if crc(checked).to_le_bytes() != *check {
        return Err(ConfigError::Crc);
    }
    let index = rest.u16();
    let network = rest.u16();
    let relays = rest.u16();
    if rest.u16() != 0 {
        return Err(ConfigError::Reserved);
    }
    let distance_m = rest.f32();
    let min_separation_m = rest.f32();
    let tx_power_w = rest.f32();
    let common = rest.profile();
    let profile = rest.profile();
    let interferer = Interferer {
        power_w: rest.f32(),
        x_m: rest.f32(),
        y_m: rest.f32(),
    };
    let tolerance = rest.f32();
    let numbers = ChannelNumbers {
        carrier_hz: rest.f64(),
        excess_los: rest.f64(),
        excess_nlos: rest.f64(),
        los_weight: rest.f64(),
    };
    let channel = numbers.channel().map_err(ConfigError::Channel)?;
    let mission = Mission::try_new(MissionConfig {
        relays,
        distance_m,
        min_separation_m,
        tx_power_w,
        common,
        channel,
        interferer,
        tolerance,
    })
    .map_err(ConfigError::Mission)?;
    if index < 1 || index > relays {
        return Err(ConfigError::Index);
    }
    if !profile.is_valid() {
        return Err(ConfigError::Profile);
    }
    Ok(Config {
        identity: Identity { network, index },
        mission,
        profile,
    })
}

/// Writes the block that says `config`; `numbers` are those its channel was made of.
#[cfg(not(target_os = "none"))]
pub fn write(config: &Config, numbers: &ChannelNumbers) -> Block {
    let mission = config.mission.config();
    let mut bytes = Vec::with_capacity(LEN);
    bytes.extend(MAGIC);
    for number in [
        VERSION,
        LEN_FIELD,
        config.identity.index,
        config.identity.network,
        mission.relays,
        0,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [
        mission.distance_m,
        mission.min_separation_m,
        mission.tx_power_w,
        mission.common.altitude_m,
        mission.common.power_w,
        config.profile.altitude_m,
        config.profile.power_w,
        mission.interferer.power_w,
        mission.interferer.x_m,
        mission.interferer.y_m,
        mission.tolerance,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [
        numbers.carrier_hz,
        numbers.excess_los,
        numbers.excess_nlos,
        numbers.los_weight,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    let check = crc(&bytes);
    bytes.extend(check.to_le_bytes());
    let mut block = [0; LEN];
    for (place, byte) in block.iter_mut().zip(bytes) {
        *place = byte;
    }
    block
}

fn crc(bytes: &[u8]) -> u32 {
    let mut crc = Crc32c::new();
    crc.update(bytes);
    crc.finish()
}

/// What has not been read yet. Past the end there are zeros, which the table never asks for.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let Some((bytes, rest)) = self.0.split_first_chunk::<N>() else {
            return [0; N];
        };
        self.0 = rest;
        *bytes
    }

    fn u16(&mut self) -> u16 {
        u16::from_le_bytes(self.take())
    }

    fn f32(&mut self) -> f32 {
        f32::from_le_bytes(self.take())
    }

    fn f64(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    fn profile(&mut self) -> Profile {
        Profile {
            altitude_m: self.f32(),
            power_w: self.f32(),
        }
    }
}
