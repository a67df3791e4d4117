//! What is written into a drone once, apart from the image: which relay it is, and what it flies.
//!
//! One block at the start of the last flash sector, [`ADDRESS`], which no image reaches (`memory.x`) and no update touches.
//! `cargo provision` writes it from a scenario. All numbers are little-endian, floats as in IEEE 754:
//!
//! | byte | type | what |
//! | --- | --- | --- |
//! | 0 | 4 bytes | [`MAGIC`], "UAVR" |
//! | 4 | u16 | [`VERSION`] of this table |
//! | 6 | u16 | bytes of the block, [`LEN`] |
//! | 8 | u16 | index: which relay this is, 1 (next to the transmitter) to N |
//! | 10 | u16 | network: frames of any other are ignored |
//! | 12 | u16 | relays N |
//! | 14 | u8 | method: 0 align, 1 joint, 2 adjust |
//! | 15 | u8 | 1 if this relay keeps to its altitude when altitudes are chosen, else 0 |
//! | 16 | f32 | distance, m |
//! | 20 | f32 | least separation, m |
//! | 24 | f32 | power of the transmitter, W |
//! | 28 | f32 | altitude that the relays have in common, m |
//! | 32 | f32 | power that the relays have in common, W |
//! | 36 | f32 | altitude of this relay, m |
//! | 40 | f32 | power of this relay, W |
//! | 44 | f32 | power of the interferer, W; 0 in a field |
//! | 48 | f32 | x of the interferer, m; 0 in a field |
//! | 52 | f32 | y of the interferer, m; 0 in a field |
//! | 56 | f32 | tolerance |
//! | 60 | f64 | carrier, Hz |
//! | 68 | f64 | excess loss with line of sight, as a factor |
//! | 76 | f64 | excess loss without, as a factor |
//! | 84 | f64 | weight of line of sight between drone and ground, 0 to 1 |
//! | 92 | f32 | lowest altitude of the band, m |
//! | 96 | f32 | highest altitude of the band, m |
//! | 100 | f32 | y of the left edge of the room beside the line, m: 0 or less |
//! | 104 | f32 | y of its right edge, m: 0 or more |
//! | 108 | f32 | adjust: how far a relay may go up or down in one turn, m; 0 with another method |
//! | 112 | u16 | adjust: rounds at most, 1 to 65535; 0 with another method |
//! | 114 | u16 | points of the field, 1 to [`MAX_POINTS`]; 0 where there is an interferer |
//! | 116 | f32 | the most interference that may be measured, W; 0 without samples |
//! | 120 | u32 | samples to take at a place; 0 where nothing is measured |
//! | 124 + 8 k | f32 | x of point k of the field, counted from 0, m; 0 behind the last one |
//! | 128 + 8 k | f32 | Upsilon of point k, 1/W; 0 behind the last one |
//! | 252 | u32 | the least epoch that this relay signs with, 1 to 4294967294; 0 without a key |
//! | 256 | 32 bytes | the network's key, by which frames carry a tag; all 0 where there is none |
//! | 288 | u32 | CRC-32C of bytes 0 to 287 |
//!
//! The ranges are those of [`MissionConfig`], [`Channel::new`], [`Profile`], [`Adjust`], [`Measure`] and [`Field`].

use uav_relay::channel::{AirGround, Channel, ChannelError};
use uav_relay::field::FieldError;
use uav_relay::mission::MissionError;
use uav_relay::wire::crc::CRC_32C;
use uav_relay::{
    Adjust, Band, Field, FieldPoint, Identity, Interference, Interferer, Local, Measure, Method,
    Mission, MissionConfig, Profile,
};

/// Where the block begins: the last sector of the flash of an STM32F405.
pub const ADDRESS: u32 = 0x080E_0000;

/// The first bytes of a block.
pub const MAGIC: [u8; 4] = *b"UAVR";

/// The version of the table above.
pub const VERSION: u16 = 4;

/// Bytes of a block.
pub const LEN: usize = 292;

/// Points of a field that a block has room for.
pub const MAX_POINTS: usize = 16;

/// Bytes that the check sequence covers.
const CHECKED: usize = LEN - 4;

/// Where epoch and key begin.
const SECRET: usize = CHECKED - 36;

/// [`LEN`] as the block states it.
const LEN_FIELD: u16 = 292;

/// A block as it is stored.
pub type Block = [u8; LEN];

/// Where the field of a mission is kept.
pub type Room = [FieldPoint; MAX_POINTS];

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

/// Room for a field that is not known yet.
pub const EMPTY: Room = [FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 0.0,
}; MAX_POINTS];

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
    /// There is a field, and the interferer is not 0.
    Interferer,
    /// There are more points than a block has room for.
    Points,
    /// What is behind the last point is not 0.
    Unused,
    /// There is a key without an epoch, or the other way round, or the epoch has none after it.
    Secret,
    /// This number of the field is out of range.
    Field(FieldError),
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

/// Reads a block; whatever its bytes, it is a configuration or an error. A field goes into `room`.
///
/// What it gives a relay takes: nothing is left to be refused.
///
/// # Errors
/// [`ConfigError`] says what is wrong, and of a number which one.
#[inline(never)] // its stack is given back before the relay needs some
pub fn read(block: &Block, room: &'static mut Room) -> Result<Config, ConfigError> {
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
    let [method, hold] = rest.take();
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
    let band = rest.band();
    let lateral = rest.band();
    let method = rest.method(method)?;
    let points = rest.u16();
    let measure = rest.measure()?;
    let interference = rest.interference(points, interferer, room)?;
    let channel = numbers.channel().map_err(ConfigError::Channel)?;
    let mission = Mission::try_new(MissionConfig {
        relays,
        distance_m,
        min_separation_m,
        tx_power_w,
        common,
        band,
        lateral,
        channel,
        interference,
        tolerance,
    })
    .map_err(ConfigError::Mission)?;
    if index < 1 || index > relays {
        return Err(ConfigError::Index);
    }
    if !profile.is_valid() {
        return Err(ConfigError::Profile);
    }
    if hold > 1 {
        return Err(ConfigError::Hold);
    }
    if method != Method::Align && points > 0 {
        return Err(ConfigError::Method);
    }
    Ok(Config {
        identity: Identity { network, index },
        mission,
        profile,
        hold_altitude: hold == 1,
        method,
        measure,
    })
}

/// What the frames of a relay are signed with, by a block that [`read`] has taken.
///
/// # Errors
/// [`ConfigError::Secret`] if there is a key without an epoch, or the other way round.
pub fn secret(block: &Block) -> Result<Option<Secret>, ConfigError> {
    let (_, rest) = block.split_at(SECRET);
    let mut rest = Reader(rest);
    let epoch = rest.u32();
    let key = rest.take();
    match (epoch, key.iter().all(|&byte| byte == 0)) {
        (0, true) => Ok(None),
        (1..=0xFFFF_FFFE, false) => Ok(Some(Secret { key, epoch })),
        _ => Err(ConfigError::Secret),
    }
}

/// Writes the block that says `config` and `secret`; `numbers` are those its channel was made of.
///
/// There is no place in it for a grid in adjust, or for points that are too many: what is read of it is something else then.
#[cfg(not(target_os = "none"))]
pub fn write(config: &Config, numbers: &ChannelNumbers, secret: Option<Secret>) -> Block {
    let mission = config.mission.config();
    let source = config.mission.interferer().copied().unwrap_or(Interferer {
        power_w: 0.0,
        x_m: 0.0,
        y_m: 0.0,
    });
    let points = match &mission.interference {
        Interference::Source(_) => &[][..],
        Interference::Field(field) => field.points(),
    };
    let (method, rounds, explore_m) = match config.method {
        Method::Align => (0, 0, 0.0),
        Method::Joint => (1, 0, 0.0),
        Method::Adjust(adjust) => (2, adjust.rounds, adjust.explore_m),
    };
    let (i_max_w, samples) = config
        .measure
        .map_or((0.0, 0), |measure| (measure.i_max_w, measure.samples));
    let mut bytes = Vec::with_capacity(LEN);
    bytes.extend(MAGIC);
    for number in [
        VERSION,
        LEN_FIELD,
        config.identity.index,
        config.identity.network,
        mission.relays,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend([method, u8::from(config.hold_altitude)]);
    for number in [
        mission.distance_m,
        mission.min_separation_m,
        mission.tx_power_w,
        mission.common.altitude_m,
        mission.common.power_w,
        config.profile.altitude_m,
        config.profile.power_w,
        source.power_w,
        source.x_m,
        source.y_m,
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
    for number in [
        mission.band.least_m,
        mission.band.most_m,
        mission.lateral.least_m,
        mission.lateral.most_m,
        explore_m,
    ] {
        bytes.extend(number.to_le_bytes());
    }
    for number in [rounds, u16::try_from(points.len()).unwrap_or(u16::MAX)] {
        bytes.extend(number.to_le_bytes());
    }
    bytes.extend(i_max_w.to_le_bytes());
    bytes.extend(samples.to_le_bytes());
    for point in points {
        bytes.extend(point.x_m.to_le_bytes());
        bytes.extend(point.upsilon_per_w.to_le_bytes());
    }
    bytes.resize(SECRET, 0);
    if let Some(Secret { key, epoch }) = secret {
        bytes.extend(epoch.to_le_bytes());
        bytes.extend(key);
    }
    bytes.resize(CHECKED, 0);
    let check = crc(&bytes);
    bytes.extend(check.to_le_bytes());
    let mut block = [0; LEN];
    for (place, byte) in block.iter_mut().zip(bytes) {
        *place = byte;
    }
    block
}

fn crc(bytes: &[u8]) -> u32 {
    CRC_32C.checksum(bytes)
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

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
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

    fn band(&mut self) -> Band {
        Band {
            least_m: self.f32(),
            most_m: self.f32(),
        }
    }

    /// The method of this number; what adjust needs is 0 for the others.
    fn method(&mut self, number: u8) -> Result<Method, ConfigError> {
        let explore_m = self.f32();
        let rounds = self.u16();
        let unused = explore_m.to_bits() == 0 && rounds == 0;
        match number {
            0 if unused => Ok(Method::Align),
            1 if unused => Ok(Method::Joint),
            2 if rounds > 0 && (0.0..=1e5).contains(&explore_m) => Ok(Method::Adjust(Adjust {
                rounds,
                explore_m,
                local: Local::Fine,
            })),
            0..=2 => Err(ConfigError::Adjust),
            _ => Err(ConfigError::Method),
        }
    }

    fn measure(&mut self) -> Result<Option<Measure>, ConfigError> {
        let i_max_w = self.f32();
        match self.u32() {
            0 if i_max_w.to_bits() == 0 => Ok(None),
            samples @ 100..=1_000_000 if (1e-30..=1e6).contains(&i_max_w) => {
                Ok(Some(Measure { i_max_w, samples }))
            }
            _ => Err(ConfigError::Measure),
        }
    }

    /// The field of `count` points, or `interferer` if there are none.
    fn interference(
        &mut self,
        count: u16,
        interferer: Interferer,
        room: &'static mut Room,
    ) -> Result<Interference, ConfigError> {
        for place in &mut *room {
            *place = FieldPoint {
                x_m: self.f32(),
                upsilon_per_w: self.f32(),
            };
        }
        let room: &'static Room = room;
        let (points, unused) = room
            .split_at_checked(count.into())
            .ok_or(ConfigError::Points)?;
        let is_zero = |numbers: &[f32]| numbers.iter().all(|number| number.to_bits() == 0);
        if !unused
            .iter()
            .all(|point| is_zero(&[point.x_m, point.upsilon_per_w]))
        {
            return Err(ConfigError::Unused);
        }
        if points.is_empty() {
            return Ok(Interference::Source(interferer));
        }
        let Interferer { power_w, x_m, y_m } = interferer;
        if !is_zero(&[power_w, x_m, y_m]) {
            return Err(ConfigError::Interferer);
        }
        let field = Field::try_new(points).map_err(ConfigError::Field)?;
        Ok(Interference::Field(field))
    }
}
