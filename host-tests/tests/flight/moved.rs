//! Eight drones in flight whose receiver moves, by an upload with new sites.

use host_tests::make;
use rand::SeedableRng;
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use uav_relay::flight::axis::Axis;
use uav_relay::{Duration, MissionConfig, Side, Sites, Upload};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::fleet::{FleetSpec, somewhere};
use uav_relay_sim::simulator::outcome::Ending;
use uav_relay_sim::simulator::setup::UploadSpec;

use super::*;

/// Random error of each report of a drone's position, m.
const NOISE_M: f64 = 0.3;
/// Hovering error of a drone that is configured in the motion guard, m.
const HOVER_M: f64 = 1.5;
/// Permitted shortfall of the distance from the minimum separation, m.
///
/// It is the constant error and the hovering error of both drones.
const OFF_M: f64 = 2.0 * (BIAS_M + HOVER_M);

/// Largest displacement of the receiver along the line, m.
const ON_M: f32 = 300.0;
/// Largest displacement of Rx perpendicular to the line, m. The displacement turns the line by about 17 degrees.
const ASIDE_M: f32 = 300.0;

fn flight(seed: u64) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mission = eight_apart(SEPARATION_M as f32);
    let config = *mission.config();
    let mut setup = Setup::on_shared_channel(mission);
    setup.seed = seed;
    setup.deadline = seconds(1_500);
    setup.auth = true;
    setup.settings.sited = true;
    setup.settings.guard = Some(GuardConfig {
        hover_m: HOVER_M as f32,
        ..GuardConfig::of(&mission, config.common)
    });
    setup.faults.loss = rng.random_range(0.0..=0.4);
    let axis = somewhere(f64::from(config.distance_m)).unwrap();
    let at = |x_m, y_m| {
        let place = make::placement(x_m, y_m, 0.0);
        axis.point(place).unwrap()
    };
    // Uploads come on the way, after arrival, or in quick succession.
    let mut begun = rng.random_range(15_000..120_000);
    for version in 1..=rng.random_range(1..=2) {
        let on_m = rng.random_range(-ON_M / 2.0..=ON_M);
        let sites = Sites {
            tx: at(0.0, 0.0),
            rx: at(
                config.distance_m + on_m,
                rng.random_range(-ASIDE_M..=ASIDE_M),
            ),
        };
        let to = MissionConfig {
            distance_m: Axis::between(sites).unwrap().distance_m() as f32,
            ..config
        };
        let upload = Upload::new(&mission, version, to).unwrap();
        setup.uploads.push(UploadSpec {
            end: if rng.random() {
                Side::Upstream
            } else {
                Side::Downstream
            },
            at: Instant::from_millis(begun),
            upload: upload.with_sites(sites).unwrap(),
        });
        begun += rng.random_range(1_000..60_000);
    }
    // One relay reboots at about the time of the upload.
    if rng.random_bool(0.5) {
        let relay = rng.random_range(1..=8);
        let off = setup.uploads[0].at + Duration::from_millis(rng.random_range(0..2_000));
        setup.kills = vec![(relay, off)];
        setup.boots = vec![(relay, off + Duration::from_millis(500))];
    }
    setup.fleet = Some(FleetSpec {
        axis,
        start: in_a_row(&mut rng, SEPARATION_M + 2.0),
        takeovers: Vec::new(),
        restarts: Vec::new(),
        gust_mps: rng.random_range(0.0..=0.3),
        bias_m: BIAS_M,
        noise_m: NOISE_M,
    });
    setup
}

/// Returns the violated rule of a random flight, if any, and the smallest distance of two drones, m.
fn judged(seed: u64) -> (Option<String>, f64) {
    let setup = flight(seed);
    let outcome = run(setup.clone()).unwrap();
    let nearest_m = outcome.nearest_lent.map_or(f64::INFINITY, |it| it.apart_m);
    let last = setup.uploads.last().unwrap().upload;
    let all = outcome.relays.iter().zip(&outcome.fleet);
    let mut off = all.filter(|(relay, (_, lent))| {
        (relay.version, relay.sites) != (last.version(), last.sites()) || !lent
    });
    let what = if nearest_m < SEPARATION_M - OFF_M {
        Some(format!("{:?}", outcome.nearest_lent))
    } else if outcome.stray_targets > 0 || outcome.unsafe_setpoints > 0 {
        Some("targets that nobody asked for, or outside their limits".to_owned())
    } else if outcome.ending != Ending::Settled {
        // Settled means that each drone is within 1 m of its setpoint on earth.
        Some(format!("{:?}: {:?}", outcome.ending, outcome.fleet))
    } else {
        off.next().map(|(relay, _)| format!("{relay:?}"))
    };
    let what = what.map(|what| {
        let begun: Vec<_> = setup.uploads.iter().map(|spec| spec.at).collect();
        format!(
            "SEED={seed}: {what}; {begun:?}, kills {:?}, loss {}",
            setup.kills, setup.faults.loss
        )
    });
    (what, nearest_m)
}

#[test]
fn drones_follow_a_moved_receiver_and_keep_apart() {
    let first = uav_relay_oracle::random::seed(1);
    let count = number("COUNT", 40);
    let all: Vec<_> = (first..first + count).into_par_iter().map(judged).collect();
    let nearest_m = all.iter().map(|it| it.1).fold(f64::INFINITY, f64::min);
    println!("{count} flights: nearest {nearest_m:.2} m");
    let wrong: Vec<String> = all.into_iter().filter_map(|it| it.0).collect();
    assert!(wrong.is_empty(), "{}: {}", wrong.len(), wrong.join("\n"));
}
