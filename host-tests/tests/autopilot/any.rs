//! Fuzz test of the link: targets are finite, near the line, and sent only in states that permit them.

use chacha20::ChaCha8Rng;
use host_tests::make;
use mavlink::dialects::common::MavLandedState;
use rand::{RngExt, SeedableRng};

use super::vehicle::Mode;
use super::*;

const RUNS: u64 = 300;

/// Draws a coordinate of a position, m: also infinities, NaN and numbers that are far too large.
fn number(rng: &mut ChaCha8Rng) -> f32 {
    match rng.random_range(0..8) {
        0 => f32::NAN,
        1 => f32::INFINITY,
        2 => -1e9,
        3 => 1e30,
        _ => rng.random_range(-100.0..1500.0),
    }
}

#[test]
fn every_target_sent_is_finite_and_near() {
    let mut sent = 0;
    for seed in 0..RUNS {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let kind = [Kind::Px4, Kind::ArduCopter][rng.random_range(0..2)];
        let mut vehicle = Vehicle::new(kind);
        for _ in 0..200 {
            match rng.random_range(0..10) {
                0 => vehicle.armed = rng.random(),
                1 => {
                    use MavLandedState as L;
                    let states = [
                        L::MAV_LANDED_STATE_UNDEFINED,
                        L::MAV_LANDED_STATE_ON_GROUND,
                        L::MAV_LANDED_STATE_IN_AIR,
                        L::MAV_LANDED_STATE_TAKEOFF,
                        L::MAV_LANDED_STATE_LANDING,
                    ];
                    vehicle.landed = states[rng.random_range(0..5)];
                }
                2 => {
                    vehicle.mode =
                        [Mode::Position, Mode::Hold, Mode::Companion][rng.random_range(0..3)];
                }
                3 => vehicle.mute = rng.random_bool(0.2),
                4 => vehicle.position_every_ms = [200, 1_000, u64::MAX][rng.random_range(0..3)],
                5 => {
                    let [x_m, y_m, altitude_m] = [0; 3].map(|_| number(&mut rng));
                    vehicle.setpoint = rng
                        .random_bool(0.8)
                        .then_some(make::placement(x_m, y_m, altitude_m));
                }
                6 => vehicle.reboot(),
                7 => {
                    let noise: Vec<u8> = (0..300).map(|_| rng.random()).collect();
                    vehicle.link.handle_bytes(vehicle.now, &noise);
                }
                8 => vehicle.armed = true,
                _ => vehicle.landed = MavLandedState::MAV_LANDED_STATE_IN_AIR,
            }
            let before = vehicle.received.len();
            for _ in 0..25 {
                let told = vehicle.targets().len();
                vehicle.step();
                if vehicle.targets().len() > told {
                    let state = vehicle.link.state();
                    let may = matches!(state, State::Engaged | State::Blind)
                        || state == State::Standby && kind == Kind::Px4;
                    assert!(may, "{state:?}, seed {seed}");
                }
            }
            for (_, said) in &vehicle.received[before..] {
                let LinkMessage::Target(target) = said else {
                    continue;
                };
                sent += 1;
                let numbers = [target.alt_m].into_iter().chain(target.velocity_m_s);
                assert!(
                    numbers.clone().all(f32::is_finite),
                    "{target:?}, seed {seed}"
                );
                let place = target.place();
                assert!(
                    (-5_001.0..=6_400.0).contains(&place.x_m),
                    "{place:?}, seed {seed}"
                );
                assert!(place.y_m.abs() <= 5_001.0 && place.altitude_m.abs() <= 5_001.0);
            }
        }
    }
    println!("{sent} targets in {RUNS} runs");
    assert!(sent > 5_000, "{sent}");
}
