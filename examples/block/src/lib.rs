//! Configuration block of a drone: index, mission and keys. It is written once, separately from the firmware.
//!
//! The block has a flash sector of its own, which firmware updates do not touch: [`ADDRESS`] on an STM32F405. `cargo
//! provision` writes it from a scenario. All numbers are little-endian, floats IEEE 754:
//!
//! | byte | type | content |
//! | --- | --- | --- |
//! | 0 | 4 bytes | [`MAGIC`], "UAVR" |
//! | 4 | u16 | [`VERSION`] of this table |
//! | 6 | u16 | length of the block, [`LEN`], bytes |
//! | 8 | u16 | index of this relay, 1 (next to the transmitter) to N |
//! | 10 | u16 | network number: frames of other networks are ignored |
//! | 12 | u16 | relays N |
//! | 14 | u8 | method: 0 align, 1 joint, 2 adjust |
//! | 15 | u8 | 1 if this relay keeps its altitude when altitudes are chosen, else 0 |
//! | 16 | f32 | distance, m |
//! | 20 | f32 | minimum separation, m |
//! | 24 | f32 | power of the transmitter, W |
//! | 28 | f32 | common altitude of the relays, m |
//! | 32 | f32 | common power of the relays, W |
//! | 36 | f32 | altitude of this relay, m |
//! | 40 | f32 | power of this relay, W |
//! | 44 | f32 | power of the interferer, W; 0 with interference points, or if relays listen without an initial guess |
//! | 48 | f32 | x of the interferer, m; 0 likewise |
//! | 52 | f32 | y of the interferer, m; 0 likewise |
//! | 56 | f32 | tolerance |
//! | 60 | f64 | carrier, Hz |
//! | 68 | f64 | excess loss with line of sight, as a factor |
//! | 76 | f64 | excess loss without line of sight, as a factor |
//! | 84 | f64 | weight of line of sight between drone and ground, 0 to 1 |
//! | 92 | f32 | lowest altitude of the band, m |
//! | 96 | f32 | highest altitude of the band, m |
//! | 100 | f32 | left limit of the lateral range, y in m: 0 or less |
//! | 104 | f32 | right limit of the lateral range, y in m: 0 or more |
//! | 108 | f32 | adjust: largest altitude change of a relay in one move, m; 0 with another method |
//! | 112 | u16 | adjust: maximum number of rounds, 1 to 65535; 0 with another method |
//! | 114 | u16 | points of the interference along x, 1 to [`MAX_POINTS`]; 0 without |
//! | 116 | f32 | largest measurable interference, W; 0 without samples |
//! | 120 | u32 | samples at each position; 0 without measurement |
//! | 124 + 8 k | f32 | x of interference point k, counted from 0, m; 0 after the last point |
//! | 128 + 8 k | f32 | Upsilon of point k, 1/W; 0 after the last point |
//! | 252 | u32 | smallest epoch for signing, 1 to 4294967294; 0 without a key |
//! | 256 | 32 bytes | the network's signing key; all 0 without one |
//! | 288 | i32 | latitude of the transmitter, 1e-7 degrees; this and the next five are 0 without an autopilot |
//! | 292 | i32 | longitude of the transmitter, 1e-7 degrees |
//! | 296 | i32 | height of the ground at the transmitter above the mean sea level, mm |
//! | 300 | i32 | latitude of the receiver, 1e-7 degrees |
//! | 304 | i32 | longitude of the receiver, 1e-7 degrees |
//! | 308 | i32 | height of the ground at the receiver above the mean sea level, mm |
//! | 312 | f32 | maximum speed of the drone, m/s: 0.1 to 20, or 0 for 5 m/s; must be 0 without Tx and Rx positions |
//! | 316 | 32 bytes | the autopilot's MAVLink signing key; all 0 without one, and without Tx and Rx positions |
//! | 348 | f32 | noise power at every receiver, W: 0 to 1 |
//! | 352 | u64 | time from an agreement to the next sensing, us; this and the next two are 0 if relays do not listen |
//! | 360 | u64 | half-life of a measurement's weight, us |
//! | 368 | f32 | relative error of one measurement, 1e-3 to 1 |
//! | 372 | u32 | silence until a neighbour is probed, ms, to 1200000; it is lost after three times this. 0 means 5000 |
//! | 376 | f32 | SIR needed on the way back from Rx to Tx, relative to that on the way there: 0 (one direction) to 1 |
//! | 380 | f32 | power of the receiver on the way back, W; without effect if the number before is 0 |
//! | 384 | f32 | SNR gap of fitted slots, linear: 1 to 1000, with method 1 and without sensing; 0 for equal slots |
//! | 388 | u16 | relays that the leader keeps in the chain, above N / 2 and to N; 0 without spares |
//! | 390 | u16 | 1 if this relay waits outside of the chain as a spare at its start, else 0 |
//! | 392 | u32 | CRC-32C of bytes 0 to 391 |
//!
//! The ranges are those of [`MissionConfig`], `Channel::new`, `Profile`, `Adjust`, `Measure`, `Listen`, `Field` and, by
//! `course.rs`, `Axis`.
//!
//! | file | content |
//! | --- | --- |
//! | `lib.rs` | table, and the check of a block |
//! | `types.rs` | content of a block, and its errors |
//! | `layout.rs` | bytes as a structure, and the checks of its groups |
//! | `write.rs` | writer of a block, on the ground only |

#![cfg_attr(target_os = "none", no_std)]
#![forbid(unsafe_code)]

mod layout;
mod types;
#[cfg(not(target_os = "none"))]
mod write;

use uav_relay::CRC_32C;
use uav_relay::{FieldPoint, Identity, Method, Mission, MissionConfig};

use zerocopy::little_endian::F64;

use layout::{Layout, band, profile};
pub use types::{ChannelNumbers, Config, ConfigError, Secret, Sites};
#[cfg(not(target_os = "none"))]
pub use write::write;

/// Address of the configuration block: the last flash sector of an STM32F405.
pub const ADDRESS: u32 = 0x080E_0000;

/// Bit rate of every port of the firmware, bit/s. It is fixed.
pub const BAUD: u32 = 115_200;

/// First bytes of every configuration block.
pub const MAGIC: [u8; 4] = *b"UAVR";

/// Version of the configuration block's format.
pub const VERSION: u16 = 12;

/// Length of a configuration block, bytes.
pub const LEN: usize = 396;

/// Maximum number of interference points in a configuration block.
pub const MAX_POINTS: usize = 16;

/// Number of bytes that the CRC covers: all except the CRC itself.
const CHECKED: usize = LEN - 4;

/// Maximum of `probe_after_ms`, ms. After a silence of `probe_after_ms`, a neighbour is asked for a heartbeat.
pub const MAX_PROBE_AFTER_MS: u32 = 1_200_000;

/// Value of the block's length field: [`LEN`] as a `u16`.
const LEN_FIELD: u16 = 396;

/// Configuration block as stored in flash.
pub type Block = [u8; LEN];

/// Storage for the interference points of a mission.
pub type FieldStorage = [FieldPoint; MAX_POINTS];

/// Initial content of a [`FieldStorage`].
pub const EMPTY: FieldStorage = [FieldPoint {
    x_m: 0.0,
    upsilon_per_w: 0.0,
}; MAX_POINTS];

/// Reads and checks a configuration block. The interference points, if any, are copied to `storage`.
///
/// The bytes may be arbitrary. A relay accepts every returned configuration, with three exceptions. The relay rejects
/// the joint method for more than 100 relays, a feature that its build lacks, and a number [`Config::flying`] out of
/// range.
///
/// # Errors
/// [`ConfigError`] names the fault, or the number that is out of range.
#[inline(never)] // frees its stack frame before the relay needs the space
pub fn read(block: &Block, storage: &'static mut FieldStorage) -> Result<Config, ConfigError> {
    if block.iter().all(|&byte| byte == 0xFF) || block.iter().all(|&byte| byte == 0) {
        return Err(ConfigError::Blank);
    }
    let raw: &Layout = zerocopy::transmute_ref!(block);
    if raw.magic != MAGIC {
        return Err(ConfigError::Magic);
    }
    if raw.version != VERSION || raw.length != LEN_FIELD {
        return Err(ConfigError::Version);
    }
    let (checked, _) = block.split_at(CHECKED);
    if raw.crc != crc(checked) {
        return Err(ConfigError::Crc);
    }
    let method = raw.method()?;
    let measure = raw.measure()?;
    let listen = raw.listen()?;
    let interference = raw.interference(listen.is_some(), storage)?;
    let sites = raw.sites()?;
    if sites.is_none() && autopilot_key(block).is_some() {
        return Err(ConfigError::AutopilotKey);
    }
    let probe_after_ms = raw.probe_after_ms.get();
    if probe_after_ms > MAX_PROBE_AFTER_MS {
        return Err(ConfigError::Silence);
    }
    let [carrier_hz, excess_los, excess_nlos, los_weight] = raw.channel.map(F64::get);
    let numbers = ChannelNumbers {
        carrier_hz,
        excess_los,
        excess_nlos,
        los_weight,
    };
    let mission = Mission::try_new(MissionConfig {
        relays: raw.relays.get(),
        distance_m: raw.distance_m.get(),
        min_separation_m: raw.min_separation_m.get(),
        tx_power_w: raw.tx_power_w.get(),
        common: profile(raw.common),
        band: band(raw.band),
        lateral: band(raw.lateral),
        channel: numbers.channel().map_err(ConfigError::Channel)?,
        interference,
        noise_w: raw.noise_w.get(),
        reverse: raw.reverse.get(),
        rx_power_w: raw.rx_power_w.get(),
        fitted_gap: raw.fitted_gap.get(),
        tolerance: raw.tolerance.get(),
    })
    .map_err(ConfigError::Mission)?;
    let (index, profile) = (raw.index.get(), profile(raw.own));
    if index < 1 || index > raw.relays.get() {
        return Err(ConfigError::Index);
    }
    if !profile.is_valid() {
        return Err(ConfigError::Profile);
    }
    if raw.hold_altitude > 1 {
        return Err(ConfigError::Hold);
    }
    if raw.spare.get() > 1 {
        return Err(ConfigError::Spare);
    }
    if method != Method::Align && raw.points > 0 {
        return Err(ConfigError::Method);
    }
    let is_listening_joint = method == Method::Joint && listen.is_some();
    if is_listening_joint && mission.config().reverse > 0.0 {
        return Err(ConfigError::Reverse);
    }
    let is_known_joint = method == Method::Joint && listen.is_none();
    if mission.config().fitted_gap > 0.0 && !is_known_joint {
        return Err(ConfigError::Fitted);
    }
    Ok(Config {
        identity: Identity {
            network: raw.network.get(),
            index,
        },
        mission,
        profile,
        hold_altitude: raw.hold_altitude == 1,
        method,
        measure,
        listen,
        sites,
        probe_after_ms,
        flying: raw.flying.get(),
        spare: raw.spare.get() == 1,
    })
}

/// Returns the signing key and epoch of a block that [`read`] has accepted; `None` without a key.
///
/// # Errors
/// [`ConfigError::Secret`] for a key without a valid epoch, or an epoch without a key.
pub fn secret(block: &Block) -> Result<Option<Secret>, ConfigError> {
    let raw: &Layout = zerocopy::transmute_ref!(block);
    let (key, epoch) = (raw.key, raw.epoch.get());
    match (epoch, key.iter().all(|&byte| byte == 0)) {
        (0, true) => Ok(None),
        (1..=0xFFFF_FFFE, false) => Ok(Some(Secret { key, epoch })),
        _ => Err(ConfigError::Secret),
    }
}

/// Returns the autopilot's signing key of a block that [`read`] has accepted; `None` without a key.
pub fn autopilot_key(block: &Block) -> Option<[u8; 32]> {
    let raw: &Layout = zerocopy::transmute_ref!(block);
    let key = raw.autopilot_key;
    key.iter().any(|&byte| byte != 0).then_some(key)
}

fn crc(bytes: &[u8]) -> u32 {
    CRC_32C.checksum(bytes)
}
