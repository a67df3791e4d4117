//! Guarded drones with realistic dynamics. `COUNT` and `SEED` select other faults, a failure names its seed.

mod anywhere;
mod between;
mod closer;
mod cuts;
mod fleet;
mod leave;
mod moved;
mod storms;

use chacha20::ChaCha8Rng;
use host_tests::flights::{eight_apart, end_at, in_a_row, seconds};
use rand::RngExt;
use uav_relay::GuardConfig;
use uav_relay::Instant;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::outcome::{Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Partition, Setup};

const SEPARATION_M: f64 = 10.0;

/// Maximum constant error of each drone's reported position, m.
const BIAS_M: f64 = 0.5;
/// Maximum random error of each report of a drone's position, m, in addition to the constant error.
const NOISE_M: f64 = 0.5;

/// Rounding error of a position, m: positions are f32 of up to 1 km.
const ROUNDING_M: f64 = 2e-3;

/// Returns the setup of a flight of eight drones, which are in order along x, on one radio channel.
fn eight(rng: &mut ChaCha8Rng) -> Setup {
    let mission = eight_apart(SEPARATION_M as f32);
    let mut setup = Setup::on_shared_channel(mission);
    let guard = GuardConfig::of(&mission, mission.config().common);
    setup.settings.guard = Some(GuardConfig {
        hover_m: NOISE_M as f32,
        ..guard
    });
    let start = in_a_row(rng, SEPARATION_M + 2.0 * (BIAS_M + NOISE_M));
    setup.flight = Some(FlightSpec::multicopters(start, BIAS_M, NOISE_M));
    setup.seed = rng.random();
    setup
}

/// Returns the smallest permitted distance of two drones, m, if each starts at most `starts` times.
///
/// The motion guard keeps the separation between reported positions. The reported position of each drone has a constant
/// error, and the random error of one report for each start.
fn floor_m(starts: usize) -> f64 {
    SEPARATION_M - 2.0 * BIAS_M - 2.0 * starts as f64 * NOISE_M - ROUNDING_M
}

/// Returns the time when the last of eight relays accepted their final common membership view.
///
/// Returns `None` if the relays do not end in the same view of eight.
fn together(outcome: &Outcome) -> Option<Instant> {
    let view = outcome.relays[0].view;
    let all = outcome
        .relays
        .iter()
        .all(|relay| relay.view == view && relay.relays == 8 && relay.killed.is_none());
    let came = outcome
        .moments
        .iter()
        .filter_map(|moment| match moment.what {
            TimelineEvent::ViewAccepted { view: to, .. } if to == view => Some(moment.at),
            _ => None,
        });
    all.then(|| came.max().unwrap_or(Instant::ZERO))
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}
