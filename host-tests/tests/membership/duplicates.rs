//! Two drones with equal index, number, key and epoch, as from a cloned image; `COUNT` sets the chains.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uav_relay::MAX_FRAME;
use uav_relay::{Auth, Event, Identity, Key, Port, Relay, Settings, Wiring};

use super::*;

/// Step of the medium, ms; a frame arrives one step after it was sent.
const STEP_MS: u64 = 10;

/// Time limit for one duplicate to give up its setpoint after it has received the other, ms.
const LIMIT_MS: u64 = 2_000;

/// Time limit for two setpoints at duplicates that receive each other, ms. A settled chain sends few frames.
const HEARD_MS: u64 = 10_000;

/// Time limit for duplicates that do not receive each other, ms: several claims in a row may be lost.
const HIDDEN_MS: u64 = 40_000;

/// Time limit until the whole chain has setpoints for good, with one of the duplicates, ms.
const FLIES_MS: u64 = 60_000;

/// Time of observation after the second duplicate was switched on, ms.
const WATCHED_MS: u64 = 100_000;

/// Medium between the duplicates and the other relays.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Medium {
    /// Shared channel on which the duplicates receive each other.
    Shared,
    /// Links to both neighbours, shared by the duplicates, which receive each other.
    Links,
    /// Links to both neighbours, shared by the duplicates, which do not receive each other.
    HiddenLinks,
}

impl Medium {
    /// Returns the port at which drone `receiver` receives a frame of `sender`, if any. `port` is the port of the sender.
    fn carries(self, sender: u16, port: Port, receiver: u16) -> Option<Port> {
        match port {
            Port::Shared => Some(Port::Shared),
            _ if sender == receiver => (self == Self::Links).then_some(port),
            Port::Upstream => (receiver + 1 == sender).then_some(Port::Downstream),
            Port::Downstream => (receiver == sender + 1).then_some(Port::Upstream),
        }
    }
}

#[derive(Clone, Copy, Debug)]
struct Case {
    medium: Medium,
    signed: bool,
    loss: f64,
    /// True if both are switched on at time 0.
    at_once: bool,
    seed: u64,
}

/// Results of one chain, ms.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Longest time with two setpoints, from `LIMIT_MS` after the first frame between the duplicates.
    both: u64,
    /// Longest time with two setpoints, from the start of the second duplicate.
    both_at_all: u64,
    /// Total time without a setpoint at either duplicate, from the start of the second.
    neither: u64,
    /// Time from the second start until the whole chain, with one duplicate, has setpoints for good.
    flies: u64,
    /// True if the duplicate that started first has the setpoint in the end.
    first_stays: bool,
    /// Records for each duplicate that it raised `Event::DuplicateIndex`.
    reported: [bool; 2],
}

struct Drone {
    index: u16,
    relay: Relay,
    on_at: u64,
}

/// Creates a drone for each index and start time, ms, each with its own random seed.
fn switched_on(
    mission: Mission,
    settings: Settings,
    starts: &[(u16, u64)],
    rng: &mut ChaCha8Rng,
) -> Vec<Drone> {
    let drone = |&(index, on_at)| {
        let identity = Identity { network: 7, index };
        let at = Instant::from_millis(on_at);
        let relay = Relay::new(mission, identity, settings, rng.random(), at).unwrap();
        Drone {
            index,
            relay,
            on_at,
        }
    };
    starts.iter().map(drone).collect()
}

fn flown(case: Case) -> Found {
    let rng = &mut ChaCha8Rng::seed_from_u64(case.seed);
    let relays = rng.random_range(3..=8);
    let twice = rng.random_range(1..=relays);
    let mission = mission(relays);
    let wiring = match case.medium {
        Medium::Shared => Wiring::Shared,
        _ => Wiring::Pair,
    };
    let settings = Settings {
        wiring,
        auth: case.signed.then(|| Auth {
            key: Key::new([7; 32]),
            epoch: 5,
        }),
        ..Settings::default()
    };
    let later = if case.at_once {
        0
    } else {
        10 * rng.random_range(1..6_000)
    };
    let starts = (1..=relays).map(|index| (index, 0)).chain([(twice, later)]);
    let starts: Vec<_> = starts.collect();
    let mut drones = switched_on(mission, settings, &starts, rng);
    let (first, second) = (usize::from(twice) - 1, drones.len() - 1);
    let mut flying: Vec<(usize, Port, Vec<u8>)> = Vec::new();
    let mut found = Found::default();
    let (mut heard, mut run, mut run_at_all) = (None, 0, 0);
    let mut reported = [false; 2];
    for step in 0..(later + WATCHED_MS) / STEP_MS {
        let ms = step * STEP_MS;
        let now = Instant::from_millis(ms);
        for (from, port, bytes) in std::mem::take(&mut flying) {
            let sender = drones[from].index;
            for (at, drone) in drones.iter_mut().enumerate() {
                if at == from || drone.on_at > ms {
                    continue;
                }
                let Some(through) = case.medium.carries(sender, port, drone.index) else {
                    continue;
                };
                if rng.random_bool(case.loss) {
                    continue;
                }
                if drone.index == sender {
                    heard.get_or_insert(ms);
                }
                drone.relay.handle_bytes(now, through, &bytes);
            }
        }
        for (at, drone) in drones.iter_mut().enumerate() {
            if drone.on_at > ms {
                continue;
            }
            let relay = &mut drone.relay;
            if relay.poll_timeout().is_some_and(|due| due <= now) {
                relay.handle_timeout(now);
            }
            let mut frame = [0; MAX_FRAME];
            relay.persist(|_| true);
            while let Some(transmit) = relay.poll_transmit(now, &mut frame) {
                flying.push((at, transmit.port, frame[..transmit.len].to_vec()));
            }
            while let Some(event) = relay.poll_event() {
                let taken = event == Event::DuplicateIndex { node: twice };
                if taken && at == first {
                    reported[0] = true;
                } else if taken && at == second {
                    reported[1] = true;
                }
            }
            assert!(relay.poll_timeout().is_none_or(|due| due > now), "it spins");
        }
        if ms < later {
            continue;
        }
        let has = |at: usize| drones[at].relay.setpoint().is_some();
        let both = has(first) && has(second);
        let limited = heard.is_some_and(|heard| ms > heard + LIMIT_MS);
        run_at_all = if both { run_at_all + STEP_MS } else { 0 };
        run = if both && limited { run + STEP_MS } else { 0 };
        found.both = found.both.max(run);
        found.both_at_all = found.both_at_all.max(run_at_all);
        found.neither += if has(first) || has(second) {
            0
        } else {
            STEP_MS
        };
        let others = (0..relays.into()).all(|at| at == first || has(at));
        if !(others && (has(first) || has(second))) {
            found.flies = ms + STEP_MS - later;
        }
    }
    found.first_stays = drones[first].relay.setpoint().is_some();
    found.reported = reported;
    found
}

fn count() -> u64 {
    std::env::var("COUNT").map_or(12, |text| text.parse().unwrap())
}

/// Flies `count` chains of one kind and prints the results.
fn fly(medium: Medium, signed: bool, loss: f64, at_once: bool) -> Vec<(u64, Found)> {
    let found: Vec<(u64, Found)> = (0..count())
        .map(|seed| {
            let case = Case {
                medium,
                signed,
                loss,
                at_once,
                seed,
            };
            (seed, flown(case))
        })
        .collect();
    let most = |of: fn(&Found) -> u64| found.iter().map(|(_, found)| of(found)).max().unwrap();
    let both = found.iter().filter(|(_, found)| found.both > 0).count();
    let stays = found.iter().filter(|(_, found)| found.first_stays).count();
    let reported = found
        .iter()
        .filter(|(_, found)| found.reported == [true; 2])
        .count();
    println!(
        "{medium:?}, signed {signed}, loss {loss}, at once {at_once}: {both} of {} chains with two setpoints later than {LIMIT_MS} ms after the \
         first frame heard, for {} ms at most; two setpoints at all for {} ms at most; none for {} ms at most; whole after {} ms at most; \
         the first stays in {stays}; both report it in {reported}",
        found.len(),
        most(|found| found.both),
        most(|found| found.both_at_all),
        most(|found| found.neither),
        most(|found| found.flies),
    );
    found
}

fn kinds() -> impl Iterator<Item = (bool, f64, bool)> {
    [false, true].into_iter().flat_map(|signed| {
        [0.0, 0.3]
            .into_iter()
            .flat_map(move |loss| [true, false].map(move |at_once| (signed, loss, at_once)))
    })
}

/// Checks the time limits, the report of a duplicate, and that the chain flies within `FLIES_MS`.
fn at_most_one_flies(medium: Medium, most_ms: u64) {
    let mut faults = Vec::new();
    for (signed, loss, at_once) in kinds() {
        for (seed, found) in fly(medium, signed, loss, at_once) {
            let reported = found.reported.contains(&true);
            let both = found.both > 0 || found.both_at_all > most_ms;
            if both || found.flies > FLIES_MS || !reported {
                faults.push((signed, loss, at_once, seed, found));
            }
        }
    }
    assert!(
        faults.is_empty(),
        "{} of them: {:#?}",
        faults.len(),
        &faults[..faults.len().min(4)]
    );
}

#[test]
fn of_two_with_one_index_on_a_shared_channel_one_has_a_setpoint() {
    at_most_one_flies(Medium::Shared, HEARD_MS);
}

#[test]
fn of_two_with_one_index_on_links_one_has_a_setpoint() {
    at_most_one_flies(Medium::Links, HEARD_MS);
}

#[test]
fn of_two_with_one_index_that_do_not_hear_each_other_one_has_a_setpoint() {
    at_most_one_flies(Medium::HiddenLinks, HIDDEN_MS);
}
