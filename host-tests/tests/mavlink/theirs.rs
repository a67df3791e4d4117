//! Autopilot's messages, written by other codecs.

use host_tests::python;
use mavlink::dialects::common::{
    EXTENDED_SYS_STATE_DATA, GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavLandedState, MavMessage,
    MavModeFlag, MavState, RADIO_STATUS_DATA,
};
use mavlink::{MAVLinkV2MessageRaw, MavHeader};
use serde_json::json;
use uav_relay::flight::mavlink::incoming::Incoming;

use super::*;

/// Number of test messages of each kind.
const EACH: usize = 200;

fn bytes(rng: &mut ChaCha8Rng) -> [u8; 4] {
    [0; 4].map(|_| rng.random())
}

/// Returns messages for pymavlink to encode, each with the value that this crate must decode from it. Enum values are
/// arbitrary.
#[expect(clippy::too_many_lines, reason = "a table")]
pub(super) fn written() -> Vec<(String, Option<Incoming>)> {
    let mut rng = rng(2);
    let mut all = Vec::new();
    for _ in 0..EACH {
        let [kind, autopilot, base_mode, status] = bytes(&mut rng);
        let custom_mode: u32 = rng.random();
        all.push((
            json!({"name": "HEARTBEAT", "type": kind, "autopilot": autopilot, "base_mode": base_mode,
                "custom_mode": custom_mode, "system_status": status, "mavlink_version": 3}),
            Some(Incoming::Heartbeat {
                kind,
                autopilot,
                base_mode,
                custom_mode,
                status,
            }),
        ));
        let [lat_e7, lon_e7, amsl_mm]: [i32; 3] = [0; 3].map(|_| rng.random());
        let velocity_cm_s: [i16; 3] = [0; 3].map(|_| rng.random());
        let boot_ms: u32 = rng.random();
        let [vx, vy, vz] = velocity_cm_s;
        all.push((
            json!({"name": "GLOBAL_POSITION_INT", "time_boot_ms": boot_ms, "lat": lat_e7, "lon": lon_e7, "alt": amsl_mm,
                "relative_alt": 5, "vx": vx, "vy": vy, "vz": vz, "hdg": 9000}),
            Some(Incoming::GlobalPosition {
                boot_ms,
                lat_e7,
                lon_e7,
                amsl_mm,
                velocity_cm_s,
            }),
        ));
        let [answered, asked]: [u64; 2] = [0; 2].map(|_| rng.random_range(0..1 << 62));
        all.push((
            json!({"name": "TIMESYNC", "tc1": answered, "ts1": asked}),
            Some(Incoming::TimeSync { answered, asked }),
        ));
        let is_breached: bool = rng.random();
        all.push((
            json!({"name": "FENCE_STATUS", "breach_status": u8::from(is_breached), "breach_count": 5, "breach_type": 2,
                "breach_time": 77}),
            Some(Incoming::FenceStatus { is_breached }),
        ));
        let [vtol, landed_state, rssi, noise] = bytes(&mut rng);
        all.push((
            json!({"name": "EXTENDED_SYS_STATE", "vtol_state": vtol, "landed_state": landed_state}),
            Some(Incoming::ExtendedSysState { landed_state }),
        ));
        all.push((
            json!({"name": "RADIO_STATUS", "rssi": rssi, "remrssi": 1, "txbuf": 2, "noise": noise, "remnoise": 3,
                "rxerrors": 4, "fixed": 5}),
            Some(Incoming::RadioStatus { rssi, noise }),
        ));
        let (type_mask, command): (u16, u16) = (rng.random(), rng.random());
        let [frame, result, ..] = bytes(&mut rng);
        let altitude_m = rng.random_range(-500.0_f32..9000.0);
        let target = json!({"time_boot_ms": boot_ms, "vx": 1.0, "vy": 2.0, "vz": 3.0, "afx": 4.0, "afy": 5.0, "afz": 6.0,
            "yaw": 7.0, "yaw_rate": 8.0, "type_mask": type_mask, "coordinate_frame": frame});
        let mut global = target.clone();
        global["name"] = "POSITION_TARGET_GLOBAL_INT".into();
        global["lat_int"] = lat_e7.into();
        global["lon_int"] = lon_e7.into();
        global["alt"] = altitude_m.into();
        all.push((
            global,
            Some(Incoming::PositionTargetGlobal {
                lat_e7,
                lon_e7,
                altitude_m,
                type_mask,
                frame,
            }),
        ));
        let mut local = target;
        local["name"] = "POSITION_TARGET_LOCAL_NED".into();
        for axis in ["x", "y", "z"] {
            local[axis] = 1.0.into();
        }
        all.push((local, Some(Incoming::PositionTargetLocal { type_mask })));
        all.push((
            json!({"name": "COMMAND_ACK", "command": command, "result": result}),
            Some(Incoming::CommandAck { command, result }),
        ));
        let parameters: [f32; 7] = [0; 7].map(|_| f32::from(rng.random::<i16>()) / 8.0);
        let [system, component, confirmation, _] = bytes(&mut rng);
        let mut order = json!({"name": "COMMAND_LONG", "command": 31_010, "target_system": system,
            "target_component": component, "confirmation": confirmation});
        for (number, parameter) in (1..).zip(parameters) {
            order[format!("param{number}")] = parameter.into();
        }
        all.push((
            order,
            Some(Incoming::CommandLong {
                command: 31_010,
                parameters,
                to: Address { system, component },
                is_repeated: confirmation > 0,
            }),
        ));
        // Messages without meaning for a companion are ignored.
        all.push((
            json!({"name": "SYSTEM_TIME", "time_unix_usec": 1, "time_boot_ms": boot_ms}),
            None,
        ));
    }
    let lines = all.into_iter();
    lines
        .map(|(json, read)| (json.to_string() + "\n", read))
        .collect()
}

#[test]
fn every_field_that_pymavlink_writes_is_read() {
    let written = written();
    let input: String = written.iter().map(|(line, _)| line.as_str()).collect();
    let frames = python::output(peer(), &["write"], &input);
    assert_eq!(frames.lines().count(), written.len());
    for ((line, expected), frame) in written.iter().zip(frames.lines()) {
        let read = parse(&mut Parser::new(), &unhex(frame));
        let messages: Vec<_> = read.iter().filter_map(|read| read.message).collect();
        assert_eq!(messages, Vec::from_iter(*expected), "{line}");
        assert!(
            read.iter()
                .all(|read| (read.from.system, read.from.component) == (3, 1))
        );
    }
}

/// Encodes a message as a frame with the `mavlink` crate.
pub(super) fn by_the_crate(message: &MavMessage, sequence: u8) -> Vec<u8> {
    let header = MavHeader {
        system_id: 3,
        component_id: 1,
        sequence,
    };
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.serialize_message(header, message);
    raw.raw_bytes().to_vec()
}

/// Draws a random message of an autopilot. Returns the message, and the values that this crate must read from the message.
pub(super) fn random_message(rng: &mut ChaCha8Rng) -> (MavMessage, Incoming) {
    match rng.random_range(0..4) {
        0 => {
            let custom_mode: u32 = rng.random();
            let said = HEARTBEAT_DATA {
                custom_mode,
                mavtype: mavlink::dialects::common::MavType::MAV_TYPE_QUADROTOR,
                autopilot: mavlink::dialects::common::MavAutopilot::MAV_AUTOPILOT_PX4,
                base_mode: MavModeFlag::from_bits_truncate(rng.random()),
                system_status: MavState::MAV_STATE_ACTIVE,
                mavlink_version: 3,
            };
            let read = Incoming::Heartbeat {
                kind: 2,
                autopilot: 12,
                base_mode: said.base_mode.bits(),
                custom_mode,
                status: 4,
            };
            (MavMessage::HEARTBEAT(said), read)
        }
        1 => {
            let [lat, lon, alt]: [i32; 3] = [0; 3].map(|_| rng.random());
            let [vx, vy, vz]: [i16; 3] = [0; 3].map(|_| rng.random());
            let said = GLOBAL_POSITION_INT_DATA {
                time_boot_ms: rng.random(),
                lat,
                lon,
                alt,
                vx,
                vy,
                vz,
                ..GLOBAL_POSITION_INT_DATA::DEFAULT
            };
            let read = Incoming::GlobalPosition {
                boot_ms: said.time_boot_ms,
                lat_e7: lat,
                lon_e7: lon,
                amsl_mm: alt,
                velocity_cm_s: [vx, vy, vz],
            };
            (MavMessage::GLOBAL_POSITION_INT(said), read)
        }
        2 => {
            let said = EXTENDED_SYS_STATE_DATA {
                landed_state: MavLandedState::MAV_LANDED_STATE_IN_AIR,
                ..EXTENDED_SYS_STATE_DATA::DEFAULT
            };
            let read = Incoming::ExtendedSysState { landed_state: 2 };
            (MavMessage::EXTENDED_SYS_STATE(said), read)
        }
        _ => {
            let said = RADIO_STATUS_DATA {
                rssi: rng.random(),
                noise: rng.random(),
                ..RADIO_STATUS_DATA::DEFAULT
            };
            let read = Incoming::RadioStatus {
                rssi: said.rssi,
                noise: said.noise,
            };
            (MavMessage::RADIO_STATUS(said), read)
        }
    }
}
