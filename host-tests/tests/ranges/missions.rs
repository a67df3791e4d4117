//! Missions and settings: one to four relays at random limits of all ranges.

use chacha20::ChaCha8Rng;
use host_tests::bench::Bench;
use host_tests::make;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Instant, Mission, Settings};

use crate::draw::{mission, own, settings, slow_settings};
use crate::each;
use crate::line::{check, has_agreed, is_infeasible, line};

/// Longest permitted time to an agreement of a random chain.
const PATIENCE: Duration = Duration::from_millis(600_000);

/// Result of a chain with random mission and settings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum ChainResult {
    Refused,
    Agreed,
    Infeasible,
}

/// Creates a chain with random mission and settings. Returns `None` if these are refused.
fn chain(
    rng: &mut ChaCha8Rng,
    settings: fn(&mut ChaCha8Rng, &Mission) -> Settings,
) -> Option<(Bench, Mission, Settings)> {
    let mission = mission(rng, 4)?;
    let common = settings(rng, &mission);
    let guarded = rng.random_ratio(1, 4);
    let each: Vec<_> = (0..mission.relays())
        .map(|_| own(rng, &mission, common, guarded))
        .collect();
    // A clock may start at any time.
    let begin = Instant::from_micros([0, 1, 1 << 32, 1 << 62][rng.random_range(0..4)]);
    let mut line = line(mission, begin, |index| each[usize::from(index) - 1])?;
    if guarded {
        let config = *mission.config();
        let step_m = config.distance_m / f32::from(config.relays + 1);
        for index in 1..=config.relays {
            let at = make::placement(step_m * f32::from(index), 0.0, config.common.altitude_m);
            line.relays[usize::from(index) - 1].handle_position(begin, at, begin);
        }
    }
    Some((line, mission, common))
}

fn fly(seed: u64) -> ChainResult {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let Some((mut line, mission, common)) = chain(&mut rng, settings) else {
        return ChainResult::Refused;
    };
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
        ChainResult::Infeasible
    } else {
        ChainResult::Agreed
    }
}

#[test]
fn any_mission_ends_in_positions_or_infeasible() {
    let came = each(2_000, fly);
    let of = |what| came.iter().filter(|came| **came == what).count();
    println!(
        "{} agreed, {} have no places, {} refused",
        of(ChainResult::Agreed),
        of(ChainResult::Infeasible),
        of(ChainResult::Refused)
    );
    assert!(of(ChainResult::Agreed) > came.len() / 4);
}

/// Checks that every reported number is finite with settings that make an agreement arbitrarily slow.
///
/// Such settings are any fixed step between target SIRs, a long `hop_time`, and any `dead_after`.
#[test]
fn every_slow_setting_gives_finite_numbers() {
    let came = each(200, |seed| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let Some((mut line, ..)) = chain(&mut rng, slow_settings) else {
            return false;
        };
        for _ in 0..30 {
            line.run_for(Duration::from_millis(1_000));
            check(&line);
        }
        true
    });
    let flown = came.iter().filter(|flown| **flown).count();
    println!("{flown} of {} accepted", came.len());
    assert!(flown > came.len() / 4);
}
