//! What several tests fly: eight drones in a row, the faults of a bad day, and how a run is told to go on.

use rand::RngExt;
use uav_relay::{Band, Duration, Instant, Mission, MissionConfig, Profile};
use uav_relay_oracle::reference::joint::Corridor;
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::drones::{FlightSpec, Point};
use uav_relay_sim::simulator::faults::Faults;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::{Partition, Setup};

use crate::fixtures::mission;

/// So many seconds after the start.
pub const fn seconds(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

/// Has the run go on until `at`, whatever has come of it before.
pub fn go_on_until(setup: &mut Setup, at: Instant) {
    // Nobody is beyond the last relay, so nobody is parted.
    setup.partitions.push(Partition {
        after: setup.mission.relays(),
        from: at,
        until: None,
    });
}

/// Has the run end at `at`, whatever has come of it before.
pub fn end_at(setup: &mut Setup, at: Instant) {
    go_on_until(setup, at);
    setup.deadline = at;
}

/// Runs to the end: all relays hold their places, and none was ever told to leave its limits.
///
/// # Panics
/// Where that is not so.
pub fn settle(setup: Setup) -> Outcome {
    let outcome = run(setup).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    assert_eq!(outcome.unsafe_setpoints, 0);
    outcome
}

/// The paper's eight relays, which keep `separation_m` from each other.
///
/// # Panics
/// For a separation that no mission has.
pub fn eight_apart(separation_m: f32) -> Mission {
    let config = MissionConfig {
        min_separation_m: separation_m,
        ..*mission(8).config()
    };
    Mission::try_new(config).unwrap()
}

/// Where eight drones begin, in order along x and at least `gap_m` apart.
pub fn in_a_row(rng: &mut impl RngExt, gap_m: f64) -> Vec<Point> {
    let mut x_m = 0.0;
    let start = (0..8).map(|_| {
        x_m += gap_m + rng.random_range(0.0..60.0_f64);
        [x_m, 0.0, 20.0]
    });
    start.collect()
}

/// Eight drones in a row, each with a speed of its own, that know where they are.
pub fn exact(rng: &mut impl RngExt, gap_m: f64) -> FlightSpec {
    let start = in_a_row(rng, gap_m);
    let speed_mps = (0..8).map(|_| rng.random_range(0.5..15.0)).collect();
    FlightSpec::exact(start, speed_mps, Duration::from_millis(200))
}

/// Of eight relays: three times in ten each has a power and an altitude of its own, otherwise they are alike.
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

/// Loss up to 50 %; corruption, duplicates and reordering up to 20 % each.
pub fn bad_day(rng: &mut impl RngExt) -> Faults {
    Faults {
        loss: rng.random_range(0.0..=0.5),
        corrupt: rng.random_range(0.0..=0.2),
        duplicate: rng.random_range(0.0..=0.2),
        reorder: rng.random_range(0.0..=0.2),
    }
}

/// `config` with the room of `corridor` for altitudes and sides; `None` where a relay would refuse the numbers.
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
