//! Chains of this crate, and its computing times on this machine.

use std::hint::black_box;
use std::time::{Duration, Instant};

use uav_relay::optimiser::joint::Seat;
use uav_relay::optimiser::plan::solve;
use uav_relay::{Method, Mission, Placement, Profile, Schedule};
use uav_relay_scenario::mission;
use uav_relay_sim::report::{hop_sirs, place};
use uav_relay_sim::simulator::chain;
use uav_relay_sim::simulator::outcome::{Ending, Outcome};
use uav_relay_sim::simulator::setup::Setup;
use uav_relay_tools::plan::solved;

use crate::machine::Clock;
use crate::problem::{Choice, Problem};
use crate::results::{Answer, Mark, Run, Solution};

/// Relative tolerance of the target SIR, as in `cargo chain`.
const TOLERANCE: f64 = 1e-4;

/// Number of timed batches; the result is their median.
const BATCHES: usize = 5;
/// Minimum duration of a batch: far above the clock's resolution of some milliseconds.
const LONG_ENOUGH: Duration = Duration::from_millis(200);

/// Solves `problem` with this crate: first in one computation, then with relays that exchange messages.
///
/// Other solvers are compared with the result of the one computation.
pub(crate) fn runs(problem: Problem) -> Result<Vec<Run>, String> {
    let briefed = mission::mission(&problem.scenario()?, problem.relays, TOLERANCE);
    let (mission, _) = briefed.map_err(|error| error.to_string())?;
    let mut runs = Vec::new();
    let mut setup = Setup::new(mission);
    if problem.choice == Choice::Places {
        let (time_s, places) = timed(|| planned(&mission))?;
        runs.push(run(
            "**uav-relay**, as the leader predicts",
            time_s,
            &mission,
            &places,
        ));
    } else {
        setup.settings.method = Method::Joint;
        let (time_s, places) = timed(|| alone(&mission))?;
        runs.push(run(
            "**uav-relay**, one relay for all",
            time_s,
            &mission,
            &places,
        ));
    }
    let (time_s, places) = timed(|| flown(setup.clone()))?;
    runs.push(run(
        "**uav-relay**, all relays by messages",
        time_s,
        &mission,
        &places,
    ));
    Ok(runs)
}

/// Computes the positions of all relays from the mission alone, as the leader of a chain predicts them.
///
/// For N relays the search evaluates at most about fifty whole chains, and then N^2 / 2 single hops.
fn planned(mission: &Mission) -> Result<Vec<Placement>, String> {
    let none = || "no target SIR can be met".to_owned();
    let common = |_| mission.config().common;
    let agreed = solve(black_box(mission), Schedule::Bracketed, common).map_err(|_| none())?;
    (1..=mission.relays())
        .map(|index| place(mission, agreed.target, index, common).ok_or_else(none))
        .collect()
}

/// Computes the positions of all relays from the mission alone by the joint method.
///
/// It tries all initial chains of the method.
fn alone(mission: &Mission) -> Result<Vec<Placement>, String> {
    let mission = black_box(mission);
    let places = solved(mission, |_| Seat::common(mission));
    places.ok_or_else(|| "no target SIR can be met".to_owned())
}

fn flown(setup: Setup) -> Result<Vec<Placement>, String> {
    let outcome: Outcome = chain::run(setup).map_err(|error| error.to_string())?;
    let places = outcome.relays.iter().map(|relay| relay.setpoint).collect();
    let settled: Option<_> = (outcome.ending == Ending::Settled).then_some(());
    settled
        .and(places)
        .ok_or_else(|| format!("the chain ended {:?}", outcome.ending))
}

/// Runs `work` in several batches. Returns its median processor time per run, s, and its result.
fn timed<T>(work: impl Fn() -> Result<T, String>) -> Result<(f64, T), String> {
    // Not timed: it fills the caches.
    let result = work()?;
    let mut times = [0.0; BATCHES];
    for time_s in &mut times {
        let (wall, clock) = (Instant::now(), Clock::start());
        let mut runs: u32 = 0;
        while runs == 0 || wall.elapsed() < LONG_ENOUGH {
            black_box(work()?);
            runs += 1;
        }
        *time_s = clock.elapsed_s() / f64::from(runs);
    }
    times.sort_by(f64::total_cmp);
    let [.., median, _, _] = times;
    Ok((median, result))
}

fn run(solver: &str, time_s: f64, mission: &Mission, places: &[Placement]) -> Run {
    let power_w = mission.config().common.power_w;
    let with_profile = |place: &Placement| {
        let altitude_m = place.altitude_m;
        (
            *place,
            Profile {
                altitude_m,
                power_w,
            },
        )
    };
    let flown: Vec<_> = places.iter().map(with_profile).collect();
    let chain: Vec<[f64; 3]> = places
        .iter()
        .map(|place| [place.x_m, place.y_m, place.altitude_m].map(f64::from))
        .collect();
    Run {
        solver: solver.to_owned(),
        answer: Answer::Found(Solution {
            time_s,
            evaluations: None,
            sir: hop_sirs(mission, &flown)
                .into_iter()
                .fold(f64::INFINITY, f64::min),
            good: Some(Mark {
                after_s: time_s,
                chain: chain.clone(),
            }),
            level: Some(Mark {
                after_s: time_s,
                chain: chain.clone(),
            }),
            chain,
            cut: false,
        }),
    }
}
