//! What is written into a drone once, apart from the image: which relay it is, and what it flies.
//!
//! One block in a sector of the flash of its own, which no image reaches and no update touches: of an STM32F405 at [`ADDRESS`].
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
//! | 44 | f32 | power of the interferer, W; 0 in a field, and where the relays listen and are told of none |
//! | 48 | f32 | x of the interferer, m; 0 then |
//! | 52 | f32 | y of the interferer, m; 0 then |
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
//! | 114 | u16 | points of the field, 1 to [`MAX_POINTS`]; 0 where there is none |
//! | 116 | f32 | the most interference that may be measured, W; 0 without samples |
//! | 120 | u32 | samples to take at a place; 0 where nothing is measured |
//! | 124 + 8 k | f32 | x of point k of the field, counted from 0, m; 0 behind the last one |
//! | 128 + 8 k | f32 | Upsilon of point k, 1/W; 0 behind the last one |
//! | 252 | u32 | the least epoch that this relay signs with, 1 to 4294967294; 0 without a key |
//! | 256 | 32 bytes | the network's key, by which frames carry a tag; all 0 where there is none |
//! | 288 | i32 | latitude of the transmitter, 1e-7 degrees; this and the next five are 0 where the drone has no autopilot to tell |
//! | 292 | i32 | its longitude, 1e-7 degrees |
//! | 296 | i32 | height of the ground there above the mean sea level, mm |
//! | 300 | i32 | latitude of the receiver, 1e-7 degrees |
//! | 304 | i32 | its longitude, 1e-7 degrees |
//! | 308 | i32 | height of the ground there above the mean sea level, mm |
//! | 312 | f32 | the drone's greatest speed, m/s: 0.1 to 20; 0 is 5 m/s, and is what stands here without sites |
//! | 316 | 32 bytes | the key that the autopilot signs with; all 0 where it does not, or there are no sites |
//! | 348 | f32 | noise power at every receiver, W: 0 to 1 |
//! | 352 | u64 | how long after an agreement the leader asks what is heard, us; this and the next two are 0 where the relays do not listen |
//! | 360 | u64 | half-life of what was heard, us |
//! | 368 | f32 | relative error of one measurement, 1e-3 to 1 |
//! | 372 | u32 | milliseconds of silence after which a neighbour is asked for a sign of life, to 1200000; three times as many and it counts as lost. 0: 5000 |
//! | 376 | u32 | CRC-32C of bytes 0 to 375 |
//!
//! The ranges are those of [`MissionConfig`], `Channel::new`, `Profile`, `Adjust`, `Measure`, `Listen`, `Field` and, by `course.rs`, `Axis`.
//!
//! | file | one idea |
//! | --- | --- |
//! | `lib.rs` | the table, and how it is read |
//! | `types.rs` | what a block says, and what may be wrong with it |
//! | `reader.rs` | numbers out of bytes |
//! | `write.rs` | the block of what it is to say, on the ground alone |

#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

mod reader;
mod types;
#[cfg(not(target_os = "none"))]
mod write;

use uav_relay::CRC_32C;
use uav_relay::{FieldPoint, Identity, Interferer, Method, Mission, MissionConfig};

use reader::Reader;
pub use types::{ChannelNumbers, Config, ConfigError, Secret, Sites};
#[cfg(not(target_os = "none"))]
pub use write::write;

/// Where the block begins: the last sector of the flash of an STM32F405.
pub const ADDRESS: u32 = 0x080E_0000;

/// Bit/s on every port of the firmware, which no block changes.
pub const BAUD: u32 = 115_200;

/// The first bytes of a block.
pub const MAGIC: [u8; 4] = *b"UAVR";

/// The version of the table above.
pub const VERSION: u16 = 9;

/// Bytes of a block.
pub const LEN: usize = 380;

/// Points of a field that a block has room for.
pub const MAX_POINTS: usize = 16;

/// Bytes that the check sequence covers.
const CHECKED: usize = LEN - 4;

/// Where epoch and key begin.
const SECRET: usize = 252;

/// Where the sites begin.
const SITES: usize = SECRET + 36;

/// Where the autopilot's key begins.
const AUTOPILOT_KEY: usize = SITES + 28;

/// Where the noise is.
const NOISE: usize = AUTOPILOT_KEY + 32;

/// Where what is said of listening begins.
const LISTEN: usize = NOISE + 4;

/// Where the silence is.
const SILENCE: usize = LISTEN + 20;

/// The longest silence before a question, ms.
pub const MOST_PROBE_AFTER_MS: u32 = 1_200_000;

/// [`LEN`] as the block states it.
const LEN_FIELD: u16 = 380;

/// A block as it is stored.
pub type Block = [u8; LEN];

/// Where the field of a mission is kept.
pub type Room = [FieldPoint; MAX_POINTS];

/// Room for a field that is not known yet.
pub const EMPTY: Room = [FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 0.0,
}; MAX_POINTS];

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
    let (_, listen) = block.split_at(LISTEN);
    let listen = Reader(listen).listen()?;
    if listen.is_some() && points > 0 {
        return Err(ConfigError::Listen);
    }
    let interference = rest.interference(points, interferer, listen.is_some(), room)?;
    let (_, sites) = block.split_at(SITES);
    let sites = Reader(sites).sites()?;
    if sites.is_none() && autopilot_key(block).is_some() {
        return Err(ConfigError::AutopilotKey);
    }
    let (_, noise) = block.split_at(NOISE);
    let noise_w = Reader(noise).f32();
    let (_, silence) = block.split_at(SILENCE);
    let probe_after_ms = Reader(silence).u32();
    if probe_after_ms > MOST_PROBE_AFTER_MS {
        return Err(ConfigError::Silence);
    }
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
        noise_w,
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
        listen,
        sites,
        probe_after_ms,
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

/// What the autopilot signs with, by a block that [`read`] has taken.
pub fn autopilot_key(block: &Block) -> Option<[u8; 32]> {
    let (_, rest) = block.split_at(AUTOPILOT_KEY);
    let key = Reader(rest).take();
    key.iter().any(|&byte| byte != 0).then_some(key)
}

fn crc(bytes: &[u8]) -> u32 {
    CRC_32C.checksum(bytes)
}
