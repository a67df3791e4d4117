//! Common flights of tests: eight drones in a row, heavy faults, and settings for the end of a run.

use rand::RngExt;
use uav_relay::{Band, Duration, GuardConfig, Instant, Mission, MissionConfig, Profile};
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::{FlightSpec, Point};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::{Partition, Setup};

use crate::fixtures::mission;

/// Returns the time `seconds` after the start.
pub const fn seconds(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

/// Makes a run continue until `at`, even after it has settled.
pub fn go_on_until(setup: &mut Setup, at: Instant) {
    // A partition behind the last relay separates no relays, but keeps the run going.
    setup.partitions.push(Partition {
        after: setup.mission.relays(),
        from: at,
        until: None,
    });
}

/// Makes a run end at `at`, even after it has settled.
pub fn end_at(setup: &mut Setup, at: Instant) {
    go_on_until(setup, at);
    setup.deadline = at;
}

/// Runs `setup` to the end, where all relays hold their positions and no setpoint has left its limits.
///
/// # Panics
/// This is not so.
pub fn settle(setup: Setup) -> Outcome {
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    assert_eq!(outcome.unsafe_setpoints, 0);
    outcome
}

/// Runs `setup` without faults and on a [`Faults::BAD_DAY`]. The faults must change neither the ending nor a bit of the
/// positions.
///
/// Returns the run with faults.
///
/// # Panics
/// The runs differ, a setpoint has left its limits, or a round of Algorithm 2 has made the chain worse.
pub fn unharmed(mut setup: Setup, seed: u64) -> Outcome {
    let clean = run(setup.clone()).unwrap();
    setup.faults = Faults::BAD_DAY;
    setup.seed = seed;
    let faulty = run(setup).unwrap();
    assert_eq!(clean.ending, faulty.ending, "seed {seed}");
    assert_eq!(clean.bits(), faulty.bits(), "seed {seed}");
    assert_eq!((clean.unsafe_setpoints, faulty.unsafe_setpoints), (0, 0));
    assert!(faulty.rounds.windows(2).all(|pair| pair[1] >= pair[0]));
    faulty
}

/// Returns the paper's mission of eight relays with a minimum separation.
///
/// # Panics
/// No mission has this separation.
pub fn eight_apart(separation_m: f32) -> Mission {
    let config = MissionConfig {
        min_separation_m: separation_m,
        ..*mission(8).config()
    };
    Mission::try_new(config).unwrap()
}

/// Returns start positions of eight drones, in order along x and at least `gap_m` apart.
pub fn in_a_row(rng: &mut impl RngExt, gap_m: f64) -> Vec<Point> {
    let mut x_m = 0.0;
    let start = (0..8).map(|_| {
        x_m += gap_m + rng.random_range(0.0..60.0_f64);
        [x_m, 0.0, 20.0]
    });
    start.collect()
}

/// Returns eight drones in a row with random speeds and exact position reports.
pub fn exact(rng: &mut impl RngExt, gap_m: f64) -> FlightSpec {
    let start = in_a_row(rng, gap_m);
    let speed_mps = (0..8).map(|_| rng.random_range(0.5..15.0)).collect();
    FlightSpec::exact(start, speed_mps, Duration::from_millis(200))
}

/// Separation of guarded flights, m.
pub const SEPARATION_M: f32 = 5.0;

/// Smallest permitted distance of two drones, m. Positions are f32 of up to 1 km, with rounding errors of 2 mm.
pub const APART_M: f64 = SEPARATION_M as f64 - 2e-3;

/// Gives `setup` a guard, and eight drones that start at least the separation apart.
pub fn guard(setup: &mut Setup, rng: &mut impl RngExt) {
    let common = setup.mission.config().common;
    setup.settings.guard = Some(GuardConfig::of(&setup.mission, common));
    setup.flight = Some(exact(rng, f64::from(SEPARATION_M) + 0.01));
}

/// Returns own profiles of all eight relays with a probability of 30 %, otherwise an empty list.
pub fn own_profiles(rng: &mut impl RngExt) -> Vec<(u16, Profile)> {
    if !rng.random_bool(0.3) {
        return Vec::new();
    }
    let own = (1..=8).map(|index| {
        let power_w = rng.random_range(0.5..2.0);
        let altitude_m = rng.random_range(15.0..40.0);
        let own = Profile {
            altitude_m,
            power_w,
        };
        (index, own)
    });
    own.collect()
}

/// Returns random faults: loss up to 50 %; corruption, duplicates and reordering up to 20 % each.
pub fn bad_day(rng: &mut impl RngExt) -> Faults {
    Faults {
        loss: rng.random_range(0.0..=0.5),
        corrupt: rng.random_range(0.0..=0.2),
        duplicate: rng.random_range(0.0..=0.2),
        reorder: rng.random_range(0.0..=0.2),
    }
}

/// Returns a mission with the altitudes and lateral positions of `corridor`. `None` if its numbers are refused.
pub fn with_room(config: &MissionConfig, corridor: Corridor) -> Option<Mission> {
    let config = MissionConfig {
        band: Band {
            least_m: corridor.least_m as f32,
            most_m: corridor.most_m as f32,
        },
        lateral: Band {
            least_m: corridor.left_m as f32,
            most_m: corridor.right_m as f32,
        },
        ..*config
    };
    Mission::try_new(config).ok()
}
