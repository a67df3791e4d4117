//! Missions and settings: one to four relays at random limits of all ranges.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Instant, Placement};

use crate::draw::{mission, own, settings};
use crate::each;
use crate::line::{check, has_agreed, is_infeasible, line};

/// Time limit for an agreement, in addition to the chain's hop times and probing periods.
const PATIENCE: Duration = Duration::from_millis(600_000);

/// Result of a chain.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Came {
    Refused,
    Agreed,
    Infeasible,
}

fn fly(seed: u64) -> Came {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let Some(mission) = mission(&mut rng, 4) else {
        return Came::Refused;
    };
    let common = settings(&mut rng, &mission);
    let guarded = rng.random_ratio(1, 4);
    let each: Vec<_> = (0..mission.relays())
        .map(|_| own(&mut rng, &mission, common, guarded))
        .collect();
    // A clock may start at any time.
    let begin = Instant::from_micros([0, 1, 1 << 32, 1 << 62][rng.random_range(0..4)]);
    let Some(mut line) = line(mission, begin, |index| each[usize::from(index) - 1]) else {
        return Came::Refused;
    };
    if guarded {
        let config = *mission.config();
        let step_m = config.distance_m / f32::from(config.relays + 1);
        for index in 1..=config.relays {
            let at = Placement {
                x_m: step_m * f32::from(index),
                y_m: 0.0,
                altitude_m: config.common.altitude_m,
            };
            line.relays[usize::from(index) - 1].handle_position(begin, begin, at);
        }
    }
    for _ in 0..60 {
        line.run_for(Duration::from_micros(PATIENCE.as_micros() / 60));
        check(&line);
        if has_agreed(&line) {
            break;
        }
    }
    let phases: Vec<_> = line.relays.iter().map(uav_relay::Relay::phase).collect();
    assert!(
        has_agreed(&line),
        "seed {seed}: {phases:?}, {mission:?}, {common:?}"
    );
    if is_infeasible(&line) {
        Came::Infeasible
    } else {
        Came::Agreed
    }
}

#[test]
fn every_mission_and_setting_ends_in_places_or_infeasible() {
    let came = each(2_000, fly);
    let of = |what| came.iter().filter(|came| **came == what).count();
    println!(
        "{} agreed, {} have no places, {} refused",
        of(Came::Agreed),
        of(Came::Infeasible),
        of(Came::Refused)
    );
    assert!(of(Came::Agreed) > came.len() / 4);
}
