//! Writer of a block.

use uav_relay::{Interference, Interferer, Method};
use zerocopy::little_endian::{F32, F64, I32, U64};
use zerocopy::{FromZeros as _, IntoBytes as _};

use super::layout::Layout;
use super::{Block, CHECKED, ChannelNumbers, Config, LEN_FIELD, MAGIC, Secret, VERSION, crc};

/// Returns the configuration block of `config`, `secret` and the autopilot's key. `numbers` are the channel
/// parameters.
///
/// Two kinds of configuration do not read back unchanged: `adjust` with a grid search becomes `adjust` with the fine
/// search, and a block with more than `MAX_POINTS` interference points is rejected.
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
    let (common, own) = (mission.common, config.profile);
    let mut block = Layout {
        magic: MAGIC,
        version: VERSION.into(),
        length: LEN_FIELD.into(),
        index: config.identity.index.into(),
        network: config.identity.network.into(),
        relays: mission.relays.into(),
        method,
        hold_altitude: config.hold_altitude.into(),
        distance_m: mission.distance_m.into(),
        min_separation_m: mission.min_separation_m.into(),
        tx_power_w: mission.tx_power_w.into(),
        common: [common.altitude_m, common.power_w].map(F32::new),
        own: [own.altitude_m, own.power_w].map(F32::new),
        interferer: [source.power_w, source.x_m, source.y_m].map(F32::new),
        tolerance: mission.tolerance.into(),
        channel: [
            numbers.carrier_hz,
            numbers.excess_los,
            numbers.excess_nlos,
            numbers.los_weight,
        ]
        .map(F64::new),
        band: [mission.band.least_m, mission.band.most_m].map(F32::new),
        lateral: [mission.lateral.least_m, mission.lateral.most_m].map(F32::new),
        explore_m: explore_m.into(),
        rounds: rounds.into(),
        points: u16::try_from(points.len()).unwrap_or(u16::MAX).into(),
        noise_w: mission.noise_w.into(),
        reverse: mission.reverse.into(),
        rx_power_w: mission.rx_power_w.into(),
        fitted_gap: mission.fitted_gap.into(),
        autopilot_key: autopilot_key.unwrap_or_default(),
        probe_after_ms: config.probe_after_ms.into(),
        flying: config.flying.into(),
        spare: u16::from(config.spare).into(),
        ..Layout::new_zeroed()
    };
    for (place, point) in block.field.iter_mut().zip(points) {
        *place = [point.x_m, point.upsilon_per_w].map(F32::new);
    }
    if let Some(measure) = config.measure {
        (block.i_max_w, block.samples) = (measure.i_max_w.into(), measure.samples.into());
    }
    if let Some(Secret { key, epoch }) = secret {
        (block.key, block.epoch) = (key, epoch.into());
    }
    if let Some(sites) = config.sites {
        block.ends = sites.ends.map(|site| site.map(I32::new));
        block.speed_m_s = sites.speed_m_s.into();
    }
    if let Some(listen) = config.listen {
        block.listen_us = [listen.every, listen.half_life].map(|span| U64::new(span.as_micros()));
        block.relative_error = listen.relative_error.into();
    }
    let (checked, _) = block.as_bytes().split_at(CHECKED);
    block.crc = crc(checked).into();
    zerocopy::transmute!(block)
}
