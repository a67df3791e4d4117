//! Positions, control and clocks of guarded relays. Numbers stay finite, and with true inputs the chain agrees.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::GuardConfig;
use uav_relay::{Duration, Instant, Mission, Placement, Settings, Side};

use crate::draw::signed;
use crate::each;
use crate::line::{check, has_agreed, line};

/// Draws a position anywhere, more often near the line.
fn anywhere(rng: &mut ChaCha8Rng) -> Placement {
    let mut metres = || match rng.random_range(0..6) {
        0 => f32::from_bits(rng.random()),
        1 => signed(rng, 1_000.0, 1e7),
        2 => signed(rng, 1_000.0, 6e3),
        _ => rng.random_range(-50.0..1_050.0),
    };
    make::placement(metres(), metres(), metres())
}

fn fly(seed: u64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let relays = rng.random_range(1..=4);
    let mission = Mission::try_new(host_tests::fixtures::paper(relays)).unwrap();
    let settings = Settings {
        guard: Some(GuardConfig {
            lag: Duration::from_micros(10_u64.pow(rng.random_range(0..19))),
            ..GuardConfig::of(&mission, mission.config().common)
        }),
        ..Settings::default()
    };
    let begin = Instant::from_micros([0, 1 << 40, 1 << 62][rng.random_range(0..3)]);
    let mut line = line(mission, begin, |_| settings).unwrap();
    for _ in 0..60 {
        let now = line.now;
        for relay in &mut line.relays {
            // Times of measurement are before, at and after the present.
            let at = match rng.random_range(0..4) {
                0 => Instant::from_micros(rng.random()),
                1 => Instant::ZERO,
                _ => now,
            };
            relay.handle_position(now, anywhere(&mut rng), at);
            match rng.random_range(0..10) {
                0 => relay.handle_control(now, rng.random()),
                1 => relay.clear_lost(now, Side::Upstream),
                2 => relay.restart(now),
                _ => {}
            }
        }
        line.run_for(Duration::from_millis(rng.random_range(1..2_000)));
        check(&line);
    }
    for _ in 0..120 {
        let now = line.now;
        for (index, relay) in (1_u16..).zip(&mut line.relays) {
            relay.handle_control(now, true);
            let at = make::placement(
                1_000.0 * f32::from(index) / f32::from(relays + 1),
                0.0,
                20.0,
            );
            relay.handle_position(now, at, now);
        }
        line.run_for(Duration::from_millis(1_000));
        check(&line);
    }
    let phases: Vec<_> = line.relays.iter().map(uav_relay::Relay::phase).collect();
    assert!(has_agreed(&line), "seed {seed}: {phases:?}");
}

#[test]
fn any_position_time_and_control_of_a_guarded_chain() {
    each(1_000, fly);
}
