//! Companion's messages, read by another codec. The vehicles of `--test autopilot` read them by a third one.

use host_tests::make;
use host_tests::python;
use serde_json::Value;
use uav_relay::flight::mavlink::outgoing::{Outgoing, severity};

use super::*;

/// Number of test messages of each kind.
const EACH: usize = 200;

fn messages() -> Vec<Outgoing<'static>> {
    let mut rng = rng(1);
    let mut all = vec![Outgoing::Heartbeat];
    for _ in 0..EACH {
        all.push(Outgoing::SetMessageInterval {
            id: rng.random_range(0..1000),
            interval_us: rng.random_range(0..10_000_000),
        });
        all.push(Outgoing::CommandAck {
            command: 31_010,
            result: rng.random_range(0..10),
            to: Address {
                system: rng.random(),
                component: rng.random(),
            },
        });
        all.push(Outgoing::SetPosition {
            boot_ms: rng.random(),
            at: make::geodetic(
                rng.random_range(-900_000_000..=900_000_000),
                rng.random_range(-1_800_000_000..=1_800_000_000),
                rng.random_range(-500_000..9_000_000),
            ),
            velocity_m_s: rng
                .random_bool(0.5)
                .then(|| [0; 3].map(|_| rng.random_range(-20.0..20.0))),
            yaw_rad: rng.random_bool(0.5).then(|| rng.random_range(-3.2..3.2)),
        });
        all.push(Outgoing::TimeSync {
            asked: rng.random_range(0..1 << 62),
        });
        all.push(Outgoing::NamedValue {
            boot_ms: rng.random(),
            name: ["sir", "x", "exactlyten", "more than ten"][rng.random_range(0..4)],
            value: rng.random_range(-1e6..1e6),
        });
        all.push(Outgoing::StatusText {
            severity: [severity::WARNING, severity::INFO][rng.random_range(0..2)],
            text: [
                "relay: in its place",
                "",
                "fifty bytes are as many as fit, and this is longer than that",
            ][rng.random_range(0..3)],
        });
    }
    all
}

pub(super) fn framed() -> Vec<(Outgoing<'static>, u8, Vec<u8>)> {
    let numbered = messages().into_iter().zip((0..=u8::MAX).cycle());
    numbered
        .map(|(message, number)| {
            let bytes = message.encode(COMPANION, AUTOPILOT, number);
            (message, number, bytes.to_vec())
        })
        .collect()
}

/// Returns the first `most` bytes of a text; a shorter text is returned whole.
fn cut(text: &str, most: usize) -> &str {
    &text[..text.len().min(most)]
}

fn mask(velocity: bool, yaw: bool) -> u16 {
    match (velocity, yaw) {
        (false, false) => 0x0DF8,
        (false, true) => 0x09F8,
        (true, false) => 0x0DC0,
        (true, true) => 0x09C0,
    }
}

#[expect(clippy::too_many_lines, reason = "every field of every message")]
#[test]
fn pymavlink_reads_every_field_of_our_messages() {
    let framed = framed();
    let input: String = framed
        .iter()
        .map(|(_, _, bytes)| hex(bytes) + "\n")
        .collect();
    let said = python::output(peer(), &["read"], &input);
    assert_eq!(said.lines().count(), framed.len());
    for ((message, number, _), line) in framed.iter().zip(said.lines()) {
        let fields: Value = serde_json::from_str(line).unwrap();
        let integer = |name: &str| {
            fields[name]
                .as_i64()
                .unwrap_or_else(|| panic!("{name}: {line}"))
        };
        let float = |name: &str| fields[name].as_f64().unwrap() as f32;
        assert_eq!(integer("system"), 7);
        assert_eq!(integer("component"), 191);
        assert_eq!(integer("sequence"), i64::from(*number));
        let kind = fields["mavpackettype"].as_str().unwrap();
        match *message {
            Outgoing::Heartbeat => {
                assert_eq!(kind, "HEARTBEAT");
                let said = [
                    "type",
                    "autopilot",
                    "base_mode",
                    "custom_mode",
                    "system_status",
                    "mavlink_version",
                ]
                .map(integer);
                assert_eq!(said, [18, 8, 0, 0, 4, 3]);
            }
            Outgoing::SetMessageInterval { id, interval_us } => {
                assert_eq!(kind, "COMMAND_LONG");
                let said = [
                    "command",
                    "target_system",
                    "target_component",
                    "confirmation",
                ]
                .map(integer);
                assert_eq!(said, [511, 7, 1, 0]);
                let said = [1, 2, 3, 4, 5, 6, 7].map(|i| float(&format!("param{i}")));
                assert_eq!(
                    said,
                    [id as f32, interval_us as f32, 0.0, 0.0, 0.0, 0.0, 0.0]
                );
            }
            Outgoing::CommandAck {
                command,
                result,
                to,
            } => {
                assert_eq!(kind, "COMMAND_ACK");
                let said = [
                    "command",
                    "result",
                    "progress",
                    "result_param2",
                    "target_system",
                    "target_component",
                ]
                .map(integer);
                let [system, component] = [to.system, to.component].map(i64::from);
                assert_eq!(
                    said,
                    [command.into(), result.into(), 0, 0, system, component]
                );
            }
            Outgoing::SetPosition {
                boot_ms,
                at,
                velocity_m_s,
                yaw_rad,
            } => {
                assert_eq!(kind, "SET_POSITION_TARGET_GLOBAL_INT");
                let said = [
                    "time_boot_ms",
                    "lat_int",
                    "lon_int",
                    "coordinate_frame",
                    "target_system",
                    "target_component",
                ]
                .map(integer);
                let is = [
                    i64::from(boot_ms),
                    at.lat_e7.into(),
                    at.lon_e7.into(),
                    5,
                    7,
                    1,
                ];
                assert_eq!(said, is);
                let mask = mask(velocity_m_s.is_some(), yaw_rad.is_some());
                assert_eq!(integer("type_mask"), i64::from(mask));
                assert!((float("alt") - at.amsl_mm as f32 / 1e3).abs() < 1e-6);
                assert_eq!(
                    ["vx", "vy", "vz"].map(float),
                    velocity_m_s.unwrap_or_default()
                );
                assert_eq!(["afx", "afy", "afz", "yaw_rate"].map(float), [0.0; 4]);
                assert_eq!(float("yaw"), yaw_rad.unwrap_or_default());
            }
            Outgoing::TimeSync { asked } => {
                assert_eq!(kind, "TIMESYNC");
                assert_eq!((integer("tc1"), integer("ts1")), (0, asked.cast_signed()));
            }
            Outgoing::StatusText { severity, text } => {
                assert_eq!(kind, "STATUSTEXT");
                assert_eq!(integer("severity"), i64::from(severity));
                assert_eq!(fields["text"].as_str().unwrap(), cut(text, 50));
            }
            Outgoing::NamedValue {
                boot_ms,
                name,
                value,
            } => {
                assert_eq!(kind, "NAMED_VALUE_FLOAT");
                assert_eq!(integer("time_boot_ms"), i64::from(boot_ms));
                assert_eq!(fields["name"].as_str().unwrap(), cut(name, 10));
                assert_eq!(float("value"), value);
            }
        }
    }
}

/// Checks the noise of a radio in RADIO_STATUS against the formula in the documentation of SiK radios.
#[test]
fn noise_follows_the_documented_formula() {
    for noise in 1..=254_u8 {
        let dbm = f64::from(noise) / 1.9 - 127.0;
        let expected = 10_f64.powf((dbm - 30.0) / 10.0);
        let heard = noise_w(noise).map(f64::from);
        assert!(heard.is_some_and(|heard| (heard / expected - 1.0).abs() < 1e-5));
    }
    assert_eq!((noise_w(0), noise_w(255)), (None, None));
}
