//! Eight drones with autopilots that are engaged anywhere in the air and given back anywhere.
//!
//! | quantity | distribution |
//! | --- | --- |
//! | tame | 30 %: in order, 6 m to 30 m from drone to drone along the line, no upload, and pilots who give drones back where they took control |
//! | start | in a third above each other, in a third beside each other, else anywhere; up to 30 m along the line from drone to drone; two in swapped order in 20 % |
//! | separation, stated position error | 10 m; 2 m, of which 0.5 m is a bias, 0.3 m noise, and the rest gusts and overshoot |
//! | pilots | 25 % take control once, fly to anywhere within 60 m of the chain, and give the drone back; 5 % do not give it back |
//! | upload | in 60 % the receiver moves, so that the line turns by up to 80 degrees and is 0.5 to 1.3 times as long |
//! | relays | each with 10 % rebooted, at most one lost for good |
//! | autopilots | each with 10 % switched off and on |
//! | radio | loses up to 40 % |
//!
//! Two engaged drones never come nearer than the separation, or their distance when they were engaged, less twice the stated
//! error.

use host_tests::make;
use rand::SeedableRng;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, MissionConfig, Side, Sites, Upload};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::Point;
use uav_relay_sim::simulator::fleet::{FleetSpec, Takeover, somewhere};
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::UploadSpec;

use super::*;

/// Position error configured in the motion guard, m.
const ERROR_M: f64 = 2.0;
const NOISE_M: f64 = 0.3;

/// Time of the last random event of a flight, s.
const EVENTS_S: u64 = 180;
/// Time at which a flight ends, s.
const ENDS_S: u64 = 420;

fn during(rng: &mut ChaCha8Rng) -> Instant {
    Instant::from_millis(rng.random_range(12_000..1_000 * EVENTS_S))
}

fn starts(rng: &mut ChaCha8Rng, tame: bool) -> Vec<Point> {
    let (y_m, h_m) = match rng.random_range(0..3) {
        0 => (0.0, 60.0),
        1 => (60.0, 0.0),
        _ => (40.0, 40.0),
    };
    let steps_m = [(0.0, 2.0), (0.0, 20.0), (6.0, 30.0)];
    let (least_m, step_m) = steps_m[if tame { 2 } else { rng.random_range(0..3) }];
    let mut x_m = rng.random_range(-20.0..300.0);
    let mut starts: Vec<Point> = (0..8)
        .map(|_| {
            x_m += rng.random_range(least_m..=step_m);
            [
                x_m,
                y_m * rng.random_range(-1.0..=1.0),
                20.0 + h_m * rng.random_range(0.0..=1.0),
            ]
        })
        .collect();
    if !tame && rng.random_bool(0.2) {
        let (one, other) = (rng.random_range(0..8), rng.random_range(0..8));
        starts.swap(one, other);
    }
    starts
}

/// Draws a mission upload that moves Tx or Rx, and so turns the line Tx-Rx by up to 80 degrees.
fn turned(rng: &mut ChaCha8Rng, setup: &Setup, axis: &Axis) -> UploadSpec {
    let config = *setup.mission.config();
    let angle = rng.random_range(-80.0_f64..=80.0).to_radians();
    let length_m = f64::from(config.distance_m) * rng.random_range(0.5..=1.3);
    let at = |x_m: f64, y_m: f64| {
        axis.point(make::placement(x_m as f32, y_m as f32, 0.0))
            .unwrap()
    };
    let sites = Sites {
        tx: at(0.0, 0.0),
        rx: at(length_m * angle.cos(), length_m * angle.sin()),
    };
    let to = MissionConfig {
        distance_m: Axis::between(sites).unwrap().distance_m() as f32,
        ..config
    };
    let upload = Upload::new(&setup.mission, 1, to).unwrap();
    UploadSpec {
        end: if rng.random() {
            Side::Upstream
        } else {
            Side::Downstream
        },
        at: during(rng),
        upload: upload.with_sites(sites).unwrap(),
    }
}

fn flight(seed: u64) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let rng = &mut rng;
    let mission = eight_apart(SEPARATION_M as f32);
    let config = mission.config();
    let mut setup = Setup::on_shared_channel(mission);
    setup.seed = seed;
    setup.settings.sited = true;
    setup.settings.guard = Some(GuardConfig {
        hover_m: ERROR_M as f32,
        ..GuardConfig::of(&mission, config.common)
    });
    setup.faults.loss = rng.random_range(0.0..=0.4);
    let axis = somewhere(f64::from(config.distance_m)).unwrap();
    let tame = rng.random_bool(0.3);
    if !tame && rng.random_bool(0.6) {
        setup.auth = true;
        let upload = turned(rng, &setup, &axis);
        setup.uploads = vec![upload];
    }
    let mut spec = FleetSpec {
        axis,
        start: starts(rng, tame),
        takeovers: Vec::new(),
        restarts: Vec::new(),
        gust_mps: rng.random_range(0.0..=0.3),
        bias_m: BIAS_M,
        noise_m: NOISE_M,
    };
    let mut lost = 1;
    for relay in 1..=8 {
        let from = during(rng);
        match rng.random_range(0..20) {
            0..=5 => {
                let after = Duration::from_millis(rng.random_range(2_000..60_000));
                let to = [
                    rng.random_range(-20.0..=1_000.0),
                    rng.random_range(-60.0..=60.0),
                    rng.random_range(10.0..=80.0),
                ];
                spec.takeovers.push(Takeover {
                    relay,
                    from,
                    until: rng.random_bool(0.8).then(|| from + after),
                    to: (!tame && rng.random_bool(0.7)).then_some(to),
                });
            }
            6 | 7 => {
                setup.kills.push((relay, from));
                let back = from + Duration::from_millis(rng.random_range(200..60_000));
                setup.boots.push((relay, back));
            }
            8 if lost > 0 => {
                lost -= 1;
                setup.kills.push((relay, from));
            }
            9 | 10 => spec.restarts.push((relay, from)),
            _ => {}
        }
    }
    setup.fleet = Some(spec);
    end_at(&mut setup, seconds(ENDS_S));
    setup
}

/// Returns true if all drones must arrive, because their order along the line is certain at all times.
///
/// The order is certain if the starts are farther apart than the position errors, pilots who take over return their
/// drones, silent relays return soon, and no mission is uploaded.
fn is_orderly(setup: &Setup) -> bool {
    let Some(spec) = &setup.fleet else {
        return false;
    };
    let certain_m = 2.0 * ERROR_M + 2.0 * (BIAS_M + NOISE_M);
    let mut pairs = spec.start.windows(2);
    let apart = pairs.all(|pair| pair[1][0] - pair[0][0] > certain_m);
    let mut pilots = spec.takeovers.iter();
    let back = pilots.all(|it| it.to.is_none() && it.until.is_some());
    // A pilot lands a drone whose relay is silent for half a minute.
    let quick = setup.kills.iter().all(|(relay, off)| {
        let mut boots = setup.boots.iter().filter(|(other, _)| other == relay);
        boots.any(|(_, on)| on.since(*off) < Duration::from_millis(25_000))
    });
    apart && back && quick && setup.uploads.is_empty()
}

struct FlightResult {
    what: Option<String>,
    margin_m: f64,
    settled: bool,
    orderly: bool,
}

fn judged(seed: u64) -> FlightResult {
    let setup = flight(seed);
    let outcome = run(setup.clone()).unwrap();
    let margin_m = outcome.margin_m;
    let spec = setup.fleet.clone().unwrap();
    let near = margin_m < -2.0 * ERROR_M;
    let settled = outcome.ending == Ending::Settled;
    let stuck = is_orderly(&setup) && !settled;
    let strays = outcome.stray_targets > 0 || outcome.unsafe_setpoints > 0;
    let what = (near || strays || stuck).then(|| {
        format!(
            "SEED={seed}: stuck {stuck} {margin_m:.2} m, {:?}, {} strays, {} unsafe; kills {:?} boots {:?}, {:?}, restarts {:?}, upload {:?}, loss {:.2}, starts {:.1?}",
            outcome.margin_at,
            outcome.stray_targets,
            outcome.unsafe_setpoints,
            setup.kills,
            setup.boots,
            spec.takeovers,
            spec.restarts,
            setup.uploads.first().map(|it| it.at),
            setup.faults.loss,
            spec.start,
        )
    });
    FlightResult {
        what,
        margin_m,
        settled,
        orderly: is_orderly(&setup),
    }
}

#[test]
fn drones_handed_over_anywhere_keep_their_separation() {
    let first = uav_relay_oracle::random::seed(1);
    let count = number("COUNT", 100);
    let begun = std::time::Instant::now();
    let all: Vec<_> = (first..first + count)
        .into_par_iter()
        .map(|seed| {
            std::panic::catch_unwind(|| judged(seed)).unwrap_or_else(|_| panic!("SEED={seed}"))
        })
        .collect();
    let least_m = all
        .iter()
        .map(|it| it.margin_m)
        .fold(f64::INFINITY, f64::min);
    println!(
        "{count} flights in {:.0} s: at worst {:.2} m short of the separation or of the start, {:.2} m are allowed; {} arrived, {} had to",
        begun.elapsed().as_secs_f64(),
        -least_m,
        2.0 * ERROR_M,
        all.iter().filter(|it| it.settled).count(),
        all.iter().filter(|it| it.orderly).count(),
    );
    let wrong: Vec<String> = all.into_iter().filter_map(|it| it.what).collect();
    assert!(wrong.is_empty(), "{}: {}", wrong.len(), wrong.join("\n"));
}
