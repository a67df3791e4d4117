//! Loss and return of relays: the rest ends in an undisturbed chain's positions (`COUNT`, `SEED`).

mod duplicates;
mod flights;
mod losses;
mod parts;
mod schedules;

use host_tests::fixtures::mission;
use host_tests::flights::{go_on_until, seconds};
use uav_relay::{Duration, Instant, Mission};
use uav_relay_sim::simulator::chain::run;
use uav_relay_sim::simulator::outcome::{Ending, Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Partition, Setup};

/// Returns the paper's chain of `relays` on one radio channel.
fn paper(relays: u16) -> Setup {
    Setup::on_shared_channel(mission(relays))
}

/// Returns the numbers of the relays that are alive at the end, from 1.
fn left(outcome: &Outcome) -> Vec<u16> {
    let living = (1..).zip(&outcome.relays);
    living
        .filter(|(_, relay)| relay.killed.is_none())
        .map(|(index, _)| index)
        .collect()
}

/// Returns the bits of the positions and SIR of an undisturbed chain of the relays `left` of `setup`.
fn alone(setup: &Setup, left: &[u16]) -> (Vec<Option<[u32; 3]>>, u32) {
    let relays = u16::try_from(left.len()).unwrap();
    let mut clean = Setup::new(setup.mission.with_relays(relays).unwrap());
    clean.settings.predict = setup.settings.predict;
    clean.settings.method = setup.settings.method;
    for (index, number) in (1..).zip(left) {
        let own = setup.profiles.iter().find(|(of, _)| of == number);
        clean
            .profiles
            .extend(own.map(|(_, profile)| (index, *profile)));
    }
    let outcome = run(clean).unwrap();
    assert_eq!(outcome.ending, Ending::Settled);
    (outcome.bits(), outcome.relays[0].target.unwrap().to_bits())
}

/// Compares the relays `left` with an undisturbed chain. Returns the first difference as an error.
fn judge(setup: &Setup, outcome: &Outcome, left: &[u16]) -> Result<(), String> {
    let (bits, target) = alone(setup, left);
    let relays: Vec<_> = left
        .iter()
        .map(|number| &outcome.relays[usize::from(*number) - 1])
        .collect();
    for (at, relay) in relays.iter().enumerate() {
        let place = relay
            .setpoint
            .map(|place| [place.x_m, place.y_m, place.altitude_m].map(f32::to_bits));
        if usize::from(relay.index) != at + 1 || usize::from(relay.relays) != left.len() {
            return Err(format!(
                "relay {} is {} of {}",
                left[at], relay.index, relay.relays
            ));
        }
        if relay.target.map(f32::to_bits) != Some(target) || place != bits[at] {
            return Err(format!(
                "relay {} is at {:?} for {:?}",
                left[at], relay.setpoint, relay.target
            ));
        }
    }
    if outcome.unsafe_setpoints > 0 {
        return Err(format!("{} unsafe setpoints", outcome.unsafe_setpoints));
    }
    Ok(())
}

/// Returns how often a relay accepted a new view.
fn views(outcome: &Outcome, relay: u16) -> usize {
    let reformed = |what| matches!(what, TimelineEvent::ViewAccepted { .. });
    outcome
        .moments
        .iter()
        .filter(|moment| moment.relay == relay && reformed(moment.what))
        .count()
}

fn ms(span: Duration) -> u64 {
    span.as_micros() / 1_000
}

fn number(name: &str, usual: u64) -> u64 {
    std::env::var(name).map_or(usual, |text| text.parse().unwrap())
}
