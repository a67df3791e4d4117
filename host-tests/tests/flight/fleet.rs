//! Eight drones with autopilots, pilots and all kinds of faults.

use host_tests::make;
use rand::SeedableRng;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::{Interference, MissionConfig, Side, Upload};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::fleet::{FleetSpec, Takeover, somewhere};
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::UploadSpec;

use super::*;

const NOISE_M: f64 = 0.3;

/// Largest standard deviation of gusts, m/s.
const GUST_MPS: f64 = 0.3;

/// Position error configured in the motion guard, m. It covers noise, gusts and overshoot.
const HOVER_M: f64 = 1.5;

/// Permitted shortfall of the distance from the minimum separation, m.
///
/// It is the bias and the hovering error of both drones.
const OFF_M: f64 = 2.0 * (BIAS_M + HOVER_M);

/// Time of the last random event, s.
const EVENTS_S: u64 = 240;

fn during(rng: &mut ChaCha8Rng) -> Instant {
    Instant::from_millis(rng.random_range(10_000..1_000 * EVENTS_S))
}

fn flight(seed: u64) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mission = eight_apart(SEPARATION_M as f32);
    let config = mission.config();
    let mut setup = Setup::on_shared_channel(mission);
    setup.seed = seed;
    setup.deadline = seconds(1_500);
    setup.settings.guard = Some(GuardConfig {
        hover_m: HOVER_M as f32,
        ..GuardConfig::of(&mission, config.common)
    });
    if rng.random_bool(0.8) {
        setup.faults.loss = rng.random_range(0.0..=0.4);
    }
    let axis = somewhere(f64::from(config.distance_m)).unwrap();
    let mut spec = FleetSpec {
        axis,
        start: in_a_row(&mut rng, SEPARATION_M + 2.0),
        takeovers: Vec::new(),
        restarts: Vec::new(),
        gust_mps: rng.random_range(0.0..=GUST_MPS),
        bias_m: BIAS_M,
        noise_m: NOISE_M,
    };
    // At most three are lost, so that more than half remain.
    let mut lost = rng.random_range(0..=3);
    for relay in 1..=8 {
        let from = during(&mut rng);
        match rng.random_range(0..10) {
            0 | 1 if lost > 0 => {
                lost -= 1;
                setup.kills.push((relay, from));
            }
            2 if lost > 0 => {
                lost -= 1;
                spec.takeovers.push(Takeover {
                    relay,
                    from,
                    until: None,
                    to: None,
                });
            }
            3..=5 => {
                let until =
                    from + uav_relay::Duration::from_millis(rng.random_range(2_000..60_000));
                spec.takeovers.push(Takeover {
                    relay,
                    from,
                    until: Some(until),
                    to: None,
                });
            }
            6 => spec.restarts.push((relay, from)),
            _ => {}
        }
    }
    if rng.random_bool(0.4) {
        setup.auth = true;
        let to = MissionConfig {
            interference: Interference::Source(make::interferer(
                80.0,
                rng.random_range(-100.0..1_100.0),
                rng.random_range(50.0..500.0),
            )),
            ..*config
        };
        setup.uploads = vec![UploadSpec {
            end: if rng.random() {
                Side::Upstream
            } else {
                Side::Downstream
            },
            at: during(&mut rng),
            upload: Upload::new(&mission, 1, to).unwrap(),
        }];
    }
    setup.fleet = Some(spec);
    setup
}

/// Returns a flight's first violated rule, if any, least distance of drones, m, and duration, s.
fn judged(seed: u64) -> (Option<String>, f64, f64) {
    let setup = flight(seed);
    let outcome = run(setup.clone()).unwrap();
    let nearest_m = outcome.nearest_lent.map_or(f64::INFINITY, |it| it.apart_m);
    let spec = setup.fleet.unwrap();
    let what = if nearest_m < SEPARATION_M - OFF_M {
        Some(format!("{:?}", outcome.nearest_lent))
    } else if outcome.stray_targets > 0 {
        Some(format!(
            "{} targets that nobody asked for",
            outcome.stray_targets
        ))
    } else if outcome.ending != Ending::Settled {
        // Settled means that each engaged drone is within 1 m of its setpoint.
        Some(format!("{:?}: {:?}", outcome.ending, outcome.fleet))
    } else {
        None
    };
    let what = what.map(|what| {
        format!(
            "SEED={seed}: {what}; kills {:?}, {:?}, restarts {:?}, loss {}",
            setup.kills, spec.takeovers, spec.restarts, setup.faults.loss
        )
    });
    (what, nearest_m, outcome.ended.as_micros() as f64 / 1e6)
}

#[test]
fn drones_keep_apart_whoever_controls_them() {
    let first = uav_relay_oracle::random::seed(1);
    let count = std::env::var("COUNT").ok();
    let count: u64 = count.and_then(|text| text.parse().ok()).unwrap_or(60);
    let begun = std::time::Instant::now();
    let all: Vec<_> = (first..first + count).into_par_iter().map(judged).collect();
    let nearest_m = all.iter().map(|it| it.1).fold(f64::INFINITY, f64::min);
    let mean_s = all.iter().map(|it| it.2).sum::<f64>() / all.len() as f64;
    println!(
        "{count} flights of {mean_s:.0} s on average in {:.0} s: nearest {nearest_m:.2} m",
        begun.elapsed().as_secs_f64()
    );
    let wrong: Vec<String> = all.into_iter().filter_map(|it| it.0).collect();
    assert!(wrong.is_empty(), "{}: {}", wrong.len(), wrong.join("\n"));
}
