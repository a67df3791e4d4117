//! Writer of a block.

use uav_relay::{Interference, Interferer, Method};

use super::{
    AUTOPILOT_KEY, Block, ChannelNumbers, Config, LEN, LEN_FIELD, MAGIC, SECRET, SILENCE, SITES,
    Secret, Sites, VERSION, crc,
};

/// Returns the block of `config`, `secret` and the autopilot's key. `numbers` are the parameters of its channel.
///
/// A block can not hold adjust's grid search or more than `MAX_POINTS` points; such a configuration is read back differently.
pub fn write(
    config: &Config,
    numbers: &ChannelNumbers,
    secret: Option<Secret>,
    autopilot_key: Option<[u8; 32]>,
) -> Block {
    let mission = config.mission.config();
    let source = config.mission.known_source().unwrap_or(Interferer {
        power_w: 0.0,
        x_m: 0.0,
        y_m: 0.0,
    });
    let points = match &mission.interference {
        Interference::Source(_) | Interference::Unknown => &[][..],
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
    bytes.resize(SITES, 0);
    if let Some(Sites { ends, speed_m_s }) = config.sites {
        for number in ends.as_flattened() {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(speed_m_s.to_le_bytes());
    }
    bytes.resize(AUTOPILOT_KEY, 0);
    bytes.extend(autopilot_key.unwrap_or_default());
    bytes.extend(mission.noise_w.to_le_bytes());
    if let Some(listen) = config.listen {
        bytes.extend(listen.every.as_micros().to_le_bytes());
        bytes.extend(listen.half_life.as_micros().to_le_bytes());
        bytes.extend(listen.relative_error.to_le_bytes());
    }
    bytes.resize(SILENCE, 0);
    bytes.extend(config.probe_after_ms.to_le_bytes());
    let check = crc(&bytes);
    bytes.extend(check.to_le_bytes());
    let mut block = [0; LEN];
    for (place, byte) in block.iter_mut().zip(bytes) {
        *place = byte;
    }
    block
}
