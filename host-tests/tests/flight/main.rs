//! Drones that fly as drones do, guarded: they take a while to get going and to stop, and know where they are only nearly.
//!
//! `COUNT` and `SEED` in the environment take other sequences of faults; a failure names the seed of its one.

mod anywhere;
mod between;
mod closer;
mod cuts;
mod fleet;
mod leave;
mod moved;
mod storms;

use host_tests::flights::{eight_apart, end_at, in_a_row, seconds};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use uav_relay::GuardConfig;
use uav_relay::Instant;
use uav_relay_sim::simulator::drones::FlightSpec;
use uav_relay_sim::simulator::outcome::{Outcome, Turning};
use uav_relay_sim::simulator::setup::{Partition, Setup};

const SEPARATION_M: f64 = 10.0;

/// How far off a drone takes itself to be at most, all the time and each time that it says so, m.
const BIAS_M: f64 = 0.5;
const NOISE_M: f64 = 0.5;

/// What a place may be off by rounding, m: places are f32 of up to 1 km.
const ROUNDING_M: f64 = 2e-3;

/// Eight drones in order along x that know it, on one radio channel.
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

/// How near two drones may come to each other of which none was switched on more than `starts` times, m.
///
/// A guard keeps the places apart that drones take themselves to be at. Either is off that by its bias. What it says is off by
/// the noise besides: in flight, or hovering where it said it was when it was switched on, as much again each time.
fn floor_m(starts: usize) -> f64 {
    SEPARATION_M - 2.0 * BIAS_M - 2.0 * starts as f64 * NOISE_M - ROUNDING_M
}

/// When all eight have come to the view that they are in at the end, if that is one of all.
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
            Turning::Reformed { view: to, .. } if to == view => Some(moment.at),
            _ => None,
        });
    all.then(|| came.max().unwrap_or(Instant::ZERO))
}

/// The environment variable `name` as a number, or `usual`.
fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}
