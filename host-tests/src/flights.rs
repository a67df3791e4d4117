//! Simulated flights shared by tests: eight drones in a row, heavy faults, and ends of a run.

use rand::RngExt;
use uav_relay::{Duration, GuardConfig, Instant, Mission, MissionConfig, Profile};
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::{FlightSpec, Point};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::{Partition, Setup};

use crate::fixtures::mission;
use crate::make;

/// Returns the time `seconds` after the start.
pub const fn seconds(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

/// Makes a simulated run continue at least until `at`, even if the chain has settled.
pub fn go_on_until(setup: &mut Setup, at: Instant) {
    // A partition behind the last relay separates no relays, but prolongs the run.
    setup.partitions.push(Partition {
        after: setup.mission.relays(),
        from: at,
        until: None,
    });
}

/// Makes a simulated run end exactly at `at`, even if the chain has settled.
pub fn end_at(setup: &mut Setup, at: Instant) {
    go_on_until(setup, at);
    setup.deadline = at;
}

/// Runs `setup`. Checks that all relays end with agreed positions for the same target SIR.
///
/// # Panics
/// The chain does not settle, or a setpoint was outside its limits.
pub fn settle(setup: Setup) -> Outcome {
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    assert_eq!(outcome.unsafe_setpoints, 0);
    outcome
}

/// Runs `setup` without faults and with [`Faults::BAD_DAY`], and checks that both runs end alike.
///
/// Both runs must have the same [`Ending`] and bit-identical positions. Returns the run with faults; its random numbers
/// come from `seed`.
///
/// # Panics
/// The runs differ, a setpoint was outside its limits, or a round of Algorithm 2 has lowered the chain's SIR.
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

/// Returns the paper's mission of eight relays with a minimum separation of `separation_m`.
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

/// Returns random start positions of eight drones, m, in ascending x and at least `gap_m` apart.
pub fn in_a_row(rng: &mut impl RngExt, gap_m: f64) -> Vec<Point> {
    let mut x_m = 0.0;
    let start = (0..8).map(|_| {
        x_m += gap_m + rng.random_range(0.0..60.0_f64);
        [x_m, 0.0, 20.0]
    });
    start.collect()
}

/// Returns eight drones that start in a row at least `gap_m` apart, with random speeds.
///
/// The drones report their exact positions.
pub fn exact(rng: &mut impl RngExt, gap_m: f64) -> FlightSpec {
    let start = in_a_row(rng, gap_m);
    let speed_mps = (0..8).map(|_| rng.random_range(0.5..15.0)).collect();
    FlightSpec::exact(start, speed_mps, Duration::from_millis(200))
}

/// Minimum separation of drones in test flights with a collision guard, m.
pub const SEPARATION_M: f32 = 5.0;

/// Smallest distance of two drones that the tests permit, m.
///
/// It is 2 mm less than the separation, which allows for the rounding of f32 positions up to 1 km.
pub const APART_M: f64 = SEPARATION_M as f64 - 2e-3;

/// Adds a collision guard to `setup`, and eight drones that start at least the separation apart.
pub fn guard(setup: &mut Setup, rng: &mut impl RngExt) {
    let common = setup.mission.config().common;
    setup.settings.guard = Some(GuardConfig::of(&setup.mission, common));
    setup.flight = Some(exact(rng, f64::from(SEPARATION_M) + 0.01));
}

/// Returns random profiles (power, altitude) of eight relays in 30 % of the calls, else none.
pub fn own_profiles(rng: &mut impl RngExt) -> Vec<(u16, Profile)> {
    if !rng.random_bool(0.3) {
        return Vec::new();
    }
    let own = (1..=8).map(|index| {
        let power_w = rng.random_range(0.5..2.0);
        let altitude_m = rng.random_range(15.0..40.0);
        let own = make::profile(altitude_m, power_w);
        (index, own)
    });
    own.collect()
}

/// Returns random fault probabilities of a frame: loss up to 50 %, all other faults up to 20 %.
pub fn bad_day(rng: &mut impl RngExt) -> Faults {
    Faults {
        loss: rng.random_range(0.0..=0.5),
        corrupt: rng.random_range(0.0..=0.2),
        duplicate: rng.random_range(0.0..=0.2),
        reorder: rng.random_range(0.0..=0.2),
    }
}

/// Returns the mission of `config` with the altitude and lateral ranges of `corridor`.
///
/// Returns `None` if this mission is not valid.
pub fn with_room(config: &MissionConfig, corridor: Corridor) -> Option<Mission> {
    let config = MissionConfig {
        band: make::band(corridor.least_m as f32, corridor.most_m as f32),
        lateral: make::band(corridor.left_m as f32, corridor.right_m as f32),
        ..*config
    };
    Mission::try_new(config).ok()
}
