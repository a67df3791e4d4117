//! Random schedules of faults for simulated chains, and checks of the results.

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Instant, Mission, MissionConfig, Wiring};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome, RelayEnd};
use uav_relay_sim::simulator::setup::Setup;

/// Time limit from the last event of a schedule until the chain has settled, with lost frames.
///
/// It is twenty times `dead_after`, the silence after which a relay counts as lost.
pub const RECOVERY: Duration = Duration::from_millis(300_000);

/// Returns the environment variable `name` as a number; `usual` if the variable is not set.
///
/// # Panics
/// The variable is not a number.
pub fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Adds losses of up to three random relays to the schedule of `setup`.
///
/// `at` returns the time of each loss, ms. A lost relay returns with probability one half, or always if `all_return` is
/// true. The run may last until [`RECOVERY`] after the last event.
pub fn lose_relays(
    setup: &mut Setup,
    rng: &mut ChaCha8Rng,
    all_return: bool,
    at: impl Fn(&Setup, &mut ChaCha8Rng) -> u64,
) {
    let mut relays: Vec<u16> = (1..=8).collect();
    for _ in 0..rng.random_range(0..=3) {
        let relay = relays.swap_remove(rng.random_range(0..relays.len()));
        let at = at(setup, rng);
        setup.kills.push((relay, Instant::from_millis(at)));
        if all_return || rng.random_bool(0.5) {
            // The relay returns before its loss is noticed, or after.
            let soon = rng.random_bool(0.5);
            let off = rng.random_range(1..if soon { 2_000 } else { 60_000 });
            setup.boots.push((relay, Instant::from_millis(at + off)));
        }
    }
    let events = setup.kills.iter().chain(&setup.boots).map(|(_, at)| *at);
    let last = events.chain(setup.uploads.iter().map(|spec| spec.at)).max();
    setup.deadline = last.unwrap_or(Instant::ZERO) + RECOVERY;
}

/// Runs `count` random schedules and prints their recovery times. The seeds are `first` and the following numbers.
///
/// # Panics
/// `judge` has found a fault in one of the runs.
pub fn run_all(
    first: u64,
    count: u64,
    schedule: impl Fn(&mut ChaCha8Rng) -> Setup,
    judge: impl Fn(&Setup, &Outcome) -> Result<(), String>,
) {
    let (mut took, mut failed) = (Vec::new(), Vec::new());
    for seed in first..first + count {
        let setup = schedule(&mut ChaCha8Rng::seed_from_u64(seed));
        let outcome = run(setup.clone()).unwrap();
        if let Err(what) = judge(&setup, &outcome) {
            let uploads: Vec<_> = setup
                .uploads
                .iter()
                .map(|spec| (spec.end, spec.at))
                .collect();
            println!(
                "SEED={seed}: {what}; {uploads:?} kills {:?} boots {:?} wiring {:?}",
                setup.kills, setup.boots, setup.settings.wiring
            );
            failed.push(seed);
        }
        let left = setup.deadline.since(outcome.ended).as_micros();
        took.push(((RECOVERY.as_micros() - left) / 1_000, seed));
    }
    took.sort_unstable();
    let at = |part: usize| took[(took.len() - 1) * part / 100];
    println!(
        "{count} schedules: half settled within {} ms of the last event, 99 % within {} ms, the slowest (SEED={}) took {} ms",
        at(50).0,
        at(99).0,
        at(100).1,
        at(100).0
    );
    assert!(failed.is_empty(), "{failed:?}");
}

/// Returns the numbers, from 1, of the relays that are switched on at the end of a run.
pub fn left(outcome: &Outcome) -> Vec<u16> {
    let living = (1..).zip(&outcome.relays);
    let living = living.filter(|(_, relay)| relay.killed.is_none());
    living.map(|(index, _)| index).collect()
}

/// Runs a chain of only the relays `left`, the survivors of `setup`, without faults. Returns its result.
///
/// `config` is the chain's mission.
///
/// # Panics
/// The chain does not settle.
pub fn undisturbed(setup: &Setup, left: &[u16], config: MissionConfig) -> Outcome {
    let relays = u16::try_from(left.len()).unwrap();
    let mission = Mission::try_new(config).unwrap();
    let mut clean = Setup::new(mission.with_relays(relays).unwrap());
    clean.settings = setup.settings;
    clean.settings.wiring = Wiring::Pair;
    for (index, number) in (1..).zip(left) {
        let own = setup.profiles.iter().find(|(of, _)| of == number);
        let own = own.map(|(_, profile)| (index, *profile));
        clean.profiles.extend(own);
        let is_held = setup.held.contains(number);
        clean.held.extend(is_held.then_some(index));
    }
    let outcome = run(clean).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    outcome
}

/// Checks that the surviving relays `left` have the same result as a chain of only these relays.
///
/// Setpoints and target SIR must equal those of that chain without faults to the bit. `version` and `config` are those
/// of the final mission.
///
/// # Errors
/// The first difference, a relay with another mission version, or setpoints outside their limits.
pub fn judge(
    setup: &Setup,
    outcome: &Outcome,
    left: &[u16],
    version: u16,
    config: MissionConfig,
) -> Result<(), String> {
    if outcome.unsafe_setpoints > 0 {
        return Err(format!("{} unsafe setpoints", outcome.unsafe_setpoints));
    }
    let clean = undisturbed(setup, left, config);
    let target = |relay: &RelayEnd| relay.target.map(f32::to_bits);
    for ((place, number), alone) in (1..).zip(left).zip(&clean.relays) {
        let relay = &outcome.relays[usize::from(*number) - 1];
        let found = (relay.index, usize::from(relay.relays), relay.version);
        if found != (place, left.len(), version) {
            return Err(format!(
                "relay {number} is {found:?} (place, relays, mission)"
            ));
        }
        if relay.setpoint != alone.setpoint || target(relay) != target(alone) {
            let (at, to) = (relay.setpoint, alone.setpoint);
            return Err(format!("relay {number} is at {at:?}, not at {to:?}"));
        }
    }
    Ok(())
}
