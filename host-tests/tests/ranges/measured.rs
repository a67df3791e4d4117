//! Measured powers at drones' positions. For any inputs the chain agrees, also after the sensors recover.

use chacha20::ChaCha8Rng;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use rayon::prelude::*;
use uav_relay::{
    Duration, Ground, Instant, Interference, Listen, MAX_FRAME, Mission, MissionConfig, Placement,
    Sample, Settings, Side, Wiring,
};

use crate::draw::{mission, scaled, settings, signed};
use crate::each;
use crate::line::{check, has_agreed, line};

/// Draws a measured power, W: any float, but mostly in the accepted range.
fn power_w(rng: &mut ChaCha8Rng) -> f32 {
    match rng.random_range(0..8) {
        0 => f32::from_bits(rng.random()),
        1 => [
            0.0,
            f32::INFINITY,
            f32::NAN,
            f32::MAX,
            -1.0,
            f32::MIN_POSITIVE,
        ][rng.random_range(0..6)],
        2 => scaled(rng, 1e-30, 1e-32, 1e-28),
        3 => scaled(rng, 1e-26, 1e-30, 1e-20),
        4 => scaled(rng, 1e6, 1e-3, 1e8),
        _ => scaled(rng, 1e-9, 1e-30, 1e6),
    }
}

/// Draws a position over the whole range that `handle_sample` may receive.
fn place(rng: &mut ChaCha8Rng, distance_m: f32) -> Placement {
    let far = [distance_m, 1e7, 1e9][rng.random_range(0..3)].max(2e-3);
    make::placement(
        signed(rng, 0.5 * distance_m, far),
        signed(rng, 0.0, far),
        signed(rng, 20.0, far),
    )
}

/// Gives all relays random interference measurements for 60 s, and then measurements of 1e-9 W. The measurements
/// include those at Tx and Rx. The chain must agree in the end.
fn fly(seed: u64, mission: Mission, settings: Settings) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let Some(mut line) = line(mission, Instant::ZERO, |_| settings) else {
        return;
    };
    let distance_m = mission.config().distance_m;
    let own: Vec<(f32, Placement)> = (0..mission.relays() + 2)
        .map(|_| (power_w(&mut rng), place(&mut rng, distance_m)))
        .collect();
    let changing = rng.random_ratio(1, 4);
    for second in 1..=90 {
        for at in 0..line.relays.len() {
            let (mut power, mut place_of) = own[at];
            if changing {
                (power, place_of) = (power_w(&mut rng), place(&mut rng, distance_m));
            }
            let mut ends = [own[own.len() - 1].0, own[own.len() - 2].0];
            if second > 60 {
                power = 1e-9;
                ends = [1e-9; 2];
                place_of = line.relays[at].setpoint().unwrap_or_default();
            }
            let now = line.now;
            let relay = &mut line.relays[at];
            relay.handle_sample(
                now,
                Sample::Heard {
                    at: place_of,
                    power_w: power,
                },
            );
            relay.handle_sample(now, Sample::Interference { power_w: power });
            relay.handle_sample(now, Sample::FirstHop { sir: power });
            if at == 0 {
                relay.handle_sample(now, Sample::Transmitter { power_w: ends[0] });
            }
            relay.handle_sample(now, Sample::Receiver { power_w: ends[1] });
        }
        line.run_for(Duration::from_millis(1_000));
        check(&line);
    }
    // A new estimate may be in transit just then.
    for _ in 0..80 {
        line.run_for(Duration::from_millis(370));
        check(&line);
        if has_agreed(&line) {
            return;
        }
    }
    let phases: Vec<_> = line.relays.iter().map(uav_relay::Relay::phase).collect();
    assert!(
        has_agreed(&line),
        "seed {seed}: {phases:?}, {own:?}, {mission:?}"
    );
}

fn paper(relays: u16) -> Mission {
    let config = host_tests::fixtures::paper(relays);
    Mission::try_new(MissionConfig {
        interference: Interference::Unknown,
        ..config
    })
    .unwrap()
}

fn listening() -> Settings {
    Settings {
        listen: Some(Listen::default()),
        ..Settings::default()
    }
}

#[test]
fn any_measured_power_and_position_in_the_papers_chain() {
    each(2_000, |seed| {
        fly(seed, paper(1 + (seed % 6) as u16), listening());
    });
}

#[test]
fn any_measured_power_and_position_in_any_mission() {
    each(2_000, |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(!seed);
        let Some(mission) = mission(&mut rng, 4) else {
            return;
        };
        let settings = settings(&mut rng, &mission);
        let settings = Settings {
            listen: mission
                .field()
                .is_none()
                .then(|| settings.listen.unwrap_or_default()),
            hop_time: Duration::from_millis(30),
            probe_after: Duration::from_millis(5_000),
            dead_after: Duration::from_millis(15_000),
            ..settings
        };
        fly(seed, mission, settings);
    });
}

/// Checks that relays that measure one power everywhere agree, for powers from 1e-30 W to 1e6 W.
///
/// The square of such a power may overflow or underflow an f32.
#[test]
fn one_power_everywhere_over_the_accepted_range() {
    let decades: Vec<i32> = (-300..=60).collect();
    decades.into_par_iter().for_each(|tenths| {
        let power_w = 10_f32.powf(0.1 * tenths as f32);
        let mut line = line(paper(5), Instant::ZERO, |_| listening()).unwrap();
        for _ in 0..60 {
            for at in 0..line.relays.len() {
                let now = line.now;
                if let Some(place) = line.relays[at].setpoint() {
                    line.relays[at].handle_sample(now, Sample::Heard { at: place, power_w });
                }
            }
            line.run_for(Duration::from_millis(1_000));
            check(&line);
        }
        assert!(has_agreed(&line), "{power_w} W");
    });
}

/// Checks that a ground station accepts a measurement from 1e-30 W to 1e6 W, and no other number.
#[test]
fn a_ground_station_accepts_exactly_its_range() {
    let auth = make::auth([7; 32], 1);
    let limits = [
        0.0,
        1e-30,
        1e6,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::INFINITY,
        f32::NAN,
    ];
    let near = limits
        .into_iter()
        .flat_map(|limit| [limit, limit.next_down(), limit.next_up(), -limit]);
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let any: Vec<f32> = (0..100_000).map(|_| f32::from_bits(rng.random())).collect();
    for wiring in [Wiring::Pair, Wiring::Shared] {
        let mut ground = Ground::new(&paper(4), Side::Downstream, 7, wiring, auth);
        for power_w in near.clone().chain(any.iter().copied()) {
            let is_level = (1e-30..=1e6).contains(&power_w);
            assert_eq!(ground.measured(power_w), is_level, "{power_w:e}");
            let mut frame = [0; MAX_FRAME];
            let sent = (0..20).take_while(|_| ground.poll_transmit(&mut frame).is_some());
            assert!(sent.count() <= 8, "{power_w:e}");
        }
    }
}
