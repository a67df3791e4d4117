//! Faults on the air, one by one and at random: partitions, one-way links, losses, deaths.
//!
//! `COUNT` and `SEED` in the environment set the number and the first seed of random runs.
#![cfg(test)]

use std::fmt::Write as _;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, thread};

use chacha20::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use uav_relay::{Duration, Instant, Mission, Phase};
use uav_relay_scenario::{Scenario, mission};
use uav_relay_sim::report::seconds;
use uav_relay_sim::simulator::chain::{run, run_seeds};
use uav_relay_sim::simulator::faults::{Bursts, OneWayFailure};
use uav_relay_sim::simulator::medium::Access;
use uav_relay_sim::simulator::outcome::{Outcome, TimelineEvent};
use uav_relay_sim::simulator::setup::{Partition, Setup};
use uav_relay_sim::simulator::watch::groups;

/// Returns the mission of `cargo chain --uavs N`, that is, of the default scenario, for N relays.
fn paper(relays: u16) -> Mission {
    mission::mission(&Scenario::default(), relays, 1e-4)
        .unwrap()
        .0
}

fn by_radio(relays: u16, baud: u32) -> Setup {
    let mut setup = Setup::on_air(paper(relays), Access::Csma);
    setup.link.baud = baud;
    setup
}

const fn at(seconds: u64) -> Instant {
    Instant::from_millis(1_000 * seconds)
}

/// Returns the number in the environment variable `name`; `usual` if it is not set.
fn number(name: &str, usual: u64) -> u64 {
    env::var(name).map_or(usual, |text| text.parse().unwrap())
}

/// Simulates all `setups` on all cores and returns `of(setup, outcome)` of each, in their order.
fn run_all<T: Send>(setups: &[Setup], of: impl Fn(&Setup, Outcome) -> T + Sync) -> Vec<T> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let at = next.fetch_add(1, Ordering::Relaxed)
            && let Some(setup) = setups.get(at)
        {
            done.push((at, of(setup, run(setup.clone()).unwrap())));
        }
        done
    };
    let cores = thread::available_parallelism().map_or(1, usize::from);
    let mut all: Vec<(usize, T)> = thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(work)).collect();
        let done = workers.into_iter().map(|worker| worker.join().unwrap());
        done.flatten().collect()
    });
    all.sort_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, one)| one).collect()
}

fn median_and_worst(mut all: Vec<f64>) -> (f64, f64) {
    all.sort_by(f64::total_cmp);
    let middle = all.get(all.len() / 2).copied();
    let worst = all.last().copied();
    (middle.unwrap_or(f64::NAN), worst.unwrap_or(f64::NAN))
}

/// Time at which relay 4 of eight is switched off, s.
const DIES_S: u64 = 20;

/// Returns the total time, s, in which the chain was not at its best positions after relay 4 was lost.
///
/// `None` if the relays never agreed, or if a remaining relay has no view of seven relays at the end.
fn recovery(outcome: &Outcome) -> Option<f64> {
    let left = || outcome.relays.iter().filter(|relay| relay.killed.is_none());
    // The remaining relays may be forming another view when the run ends.
    let same = left().all(|relay| relay.relays == 7);
    let watched = outcome.watched?;
    let first = seconds(watched.first_agreement?);
    let wrong = (1.0 - watched.availability?) * (seconds(outcome.ended) - first);
    same.then_some(wrong + (first - DIES_S as f64).max(0.0))
}

#[test]
fn without_losses_the_chain_recovers_within_a_minute() {
    let setups: Vec<Setup> = (1..=number("COUNT", 50))
        .map(|seed| {
            let mut setup = losing(0.0, 1.0);
            setup.kills = vec![(4, at(DIES_S))];
            setup.seed = seed;
            setup.soaked(at(400))
        })
        .collect();
    let ends = run_all(&setups, |setup, outcome| (setup.seed, recovery(&outcome)));
    for (seed, time_s) in ends {
        assert!(
            time_s.is_some_and(|time_s| time_s < 60.0),
            "SEED={seed}: {time_s:?}"
        );
    }
}

/// Longest allowed time from the end of all partitions until all relays are in one view, s.
const MOST_S: f64 = 120.0;

fn cut(after: u16, from: u64, until: u64) -> Partition {
    Partition {
        after,
        from: at(from),
        until: Some(at(until)),
    }
}

/// Returns the setups of runs with all pairs of different partitions of eight relays.
///
/// Both partitions begin at the same time, or the second partition begins later.
fn cuts() -> Vec<Setup> {
    let mut all = Vec::new();
    for one in 1..8 {
        for other in (1..8).filter(|other| *other != one) {
            for (from, until) in [(20, 120), (60, 160)] {
                let mut setup = by_radio(8, 57_600);
                setup.partitions = vec![cut(one, 20, 120), cut(other, from, until)];
                all.push(setup.soaked(at(until + 240)));
            }
        }
    }
    all
}

/// Returns the first time, not before `healed`, at which all eight relays are in one view.
fn joined(outcome: &Outcome, healed: Instant) -> Option<Instant> {
    let mut views = [(0, 8); 8];
    for moment in &outcome.moments {
        if moment.at > healed && views.iter().all(|one| *one == (views[0].0, 8)) {
            return Some(healed);
        }
        if let TimelineEvent::ViewAccepted { view, relays, .. } = moment.what {
            views[usize::from(moment.relay - 1)] = (view, relays);
            if moment.at >= healed && views.iter().all(|one| *one == (view, 8)) {
                return Some(moment.at);
            }
        }
    }
    None
}

#[test]
fn after_two_cuts_all_relays_return_to_one_view() {
    let cases = cuts();
    assert_eq!(cases.len(), 84);
    let ends = run_all(&cases, |setup, outcome| {
        let healed = setup
            .partitions
            .iter()
            .filter_map(|cut| cut.until)
            .max()
            .unwrap();
        let joined = joined(&outcome, healed).map(|at| (seconds(at) - seconds(healed)).max(0.0));
        let cuts = setup.partitions.iter().map(|cut| {
            let until = seconds(cut.until.unwrap());
            format!("--partition {}@{}-{until}", cut.after, seconds(cut.from))
        });
        let cuts: Vec<String> = cuts.collect();
        (joined, outcome.watched.unwrap().most_flying, cuts.join(" "))
    });
    let times = ends.iter().filter_map(|(joined, ..)| *joined).collect();
    let (median, worst) = median_and_worst(times);
    println!("all in one view after the last healing: median {median:.1} s, worst {worst:.1} s");
    let wrong: Vec<_> = ends
        .iter()
        .filter(|(joined, most, _)| !joined.is_some_and(|after| after <= MOST_S) || *most > 1)
        .collect();
    assert!(wrong.is_empty(), "{} of 84: {wrong:#?}", wrong.len());
}

/// Duration of a run with a one-way link, s.
const ONE_WAY_S: u64 = 400;
/// Period at the end of a run with a one-way link, s, in which the chain must not change any more.
const STILL_S: u64 = 120;

/// Returns the setups of runs with each possible one-way link in chains of 4 and 8 relays.
///
/// Frames are signed or not, and the link fails in one direction at 0 s or at 20 s.
fn one_way_links(seed: u64) -> Vec<Setup> {
    let mut all = Vec::new();
    for relays in [4, 8] {
        for (by, of) in (1..relays).flat_map(|one| [(one, one + 1), (one + 1, one)]) {
            for (auth, from) in [(false, 0), (false, 20), (true, 0), (true, 20)] {
                let mut setup = by_radio(relays, 57_600);
                setup.auth = auth;
                setup.seed = seed;
                setup.deaf = vec![OneWayFailure {
                    by,
                    of,
                    from: at(from),
                    until: None,
                }];
                all.push(setup.soaked(at(ONE_WAY_S)));
            }
        }
    }
    all
}

/// Describes the fault at the end of a run with a one-way link. `None` if there is no fault.
///
/// All relays, except one of the two at the failed link, must have positions in one view, without changes in the last
/// [`STILL_S`].
fn wrong(setup: &Setup, outcome: &Outcome) -> Option<String> {
    let seen: Vec<_> = outcome.relays.iter().map(|relay| relay.observed).collect();
    let agreements = groups(&seen);
    if agreements != 1 {
        return Some(format!("{agreements} agreements"));
    }
    let holds = |node: &u16| {
        let one = seen[usize::from(*node - 1)];
        one.leased && one.phase == Phase::Holding
    };
    let nodes: Vec<u16> = (1..=setup.mission.relays()).filter(holds).collect();
    let OneWayFailure { by, of, .. } = setup.deaf[0];
    let least = usize::from(setup.mission.relays() - 1);
    if nodes.len() != least || nodes.contains(&by) && nodes.contains(&of) {
        return Some(format!("{nodes:?} hold their places"));
    }
    let still = at(ONE_WAY_S - STILL_S);
    let last = outcome.moments.iter().rfind(|moment| {
        let changes = matches!(
            moment.what,
            TimelineEvent::ViewAccepted { .. } | TimelineEvent::Converged | TimelineEvent::NoQuorum
        );
        changes && nodes.contains(&moment.relay)
    });
    let last = last.filter(|moment| moment.at >= still)?;
    Some(format!(
        "{:?} of relay {} at {:.1} s",
        last.what,
        last.relay,
        seconds(last.at)
    ))
}

#[test]
fn one_way_links_exclude_at_most_one_relay() {
    let first = number("SEED", 1);
    let cases: Vec<_> = (first..first + number("COUNT", 1))
        .flat_map(one_way_links)
        .collect();
    let found = run_all(&cases, |setup, outcome| {
        let wrong = wrong(setup, &outcome)?;
        let OneWayFailure { by, of, from, .. } = setup.deaf[0];
        let (relays, auth) = (
            setup.mission.relays(),
            if setup.auth { " --auth" } else { "" },
        );
        let from = seconds(from);
        let end = outcome.watched.unwrap().most_flying;
        let seed = setup.seed;
        Some(format!(
            "--seed {seed} --uavs {relays} --air csma --baud 57600{auth} --deaf {by}:{of}@{from} --soak {ONE_WAY_S}: {wrong}; most at once {end}"
        ))
    });
    let found: Vec<String> = found.into_iter().flatten().collect();
    println!("{} of {}:\n{}", found.len(), cases.len(), found.join("\n"));
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Time within which all faults of a random run begin, s.
const EVENTS_S: u64 = 240;

/// Duration of a random run, s.
const ALL_S: u64 = 360;

fn during(rng: &mut ChaCha8Rng) -> Instant {
    Instant::from_millis(rng.random_range(0..1_000 * EVENTS_S))
}

/// Draws start and end of a fault: it lasts up to 10 s, from 5 s to 2 min, or to the end of the run.
fn spell(rng: &mut ChaCha8Rng) -> (Instant, Option<Instant>) {
    let from = during(rng);
    let span = match rng.random_range(0..4) {
        0 => None,
        1 => Some(rng.random_range(100..10_000)),
        _ => Some(rng.random_range(5_000..120_000)),
    };
    (from, span.map(|span| from + Duration::from_millis(span)))
}

/// Draws a run of 3 to 10 relays with lost frames, partitions, one-way links, failures and reboots.
fn sequence(seed: u64) -> Setup {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let relays = rng.random_range(3..=10);
    let baud = [38_400, 57_600, 115_200][rng.random_range(0..3)];
    let mut setup = by_radio(relays, baud);
    setup.seed = seed;
    setup.auth = rng.random_bool(0.3);
    if rng.random_bool(0.7) {
        setup.faults.loss = rng.random_range(0.0..=0.6);
        if rng.random_bool(0.3) {
            let shortest = Bursts::shortest(setup.faults.loss);
            setup.burst = rng.random_range(shortest..=shortest + 30.0);
        }
    }
    for _ in 0..rng.random_range(0..=4) {
        let (from, until) = spell(&mut rng);
        let after = rng.random_range(1..relays);
        setup.partitions.push(Partition { after, from, until });
    }
    for _ in 0..rng.random_range(0..=4) {
        let (from, until) = spell(&mut rng);
        let by = rng.random_range(1..=relays);
        let near = [by.saturating_sub(1), by + 1, by.saturating_sub(2), by + 2];
        let of = near[rng.random_range(0..4)];
        if (1..=relays).contains(&of) {
            setup.deaf.push(OneWayFailure {
                by,
                of,
                from,
                until,
            });
        }
    }
    // Separate generator, so that the reboots do not change the other draws.
    let mut boots = ChaCha8Rng::seed_from_u64(seed);
    boots.set_stream(1);
    let mut alive: Vec<u16> = (1..=relays).collect();
    for _ in 0..rng.random_range(0..=relays / 2) {
        let relay = alive.swap_remove(rng.random_range(0..alive.len()));
        let from = during(&mut rng);
        setup.kills.push((relay, from));
        let off = Duration::from_millis(rng.random_range(100..60_000));
        if boots.random_bool(0.6) {
            setup.boots.push((relay, from + off));
        }
    }
    setup.soaked(at(ALL_S))
}

/// Returns the `cargo chain` command that repeats the run of `setup`.
fn command(setup: &Setup) -> String {
    let until =
        |until: Option<Instant>| until.map_or(String::new(), |at| format!("-{}", seconds(at)));
    let mut line = format!(
        "cargo chain --uavs {} --seed {} --air csma --baud {} --loss {} --burst {} --soak {ALL_S}",
        setup.mission.relays(),
        setup.seed,
        setup.link.baud,
        setup.faults.loss,
        setup.burst
    );
    if setup.auth {
        line += " --auth";
    }
    for cut in &setup.partitions {
        _ = write!(
            line,
            " --partition {}@{}{}",
            cut.after,
            seconds(cut.from),
            until(cut.until)
        );
    }
    for deaf in &setup.deaf {
        _ = write!(
            line,
            " --deaf {}:{}@{}{}",
            deaf.by,
            deaf.of,
            seconds(deaf.from),
            until(deaf.until)
        );
    }
    for (relay, at) in &setup.kills {
        _ = write!(line, " --kill {relay}@{}", seconds(*at));
    }
    for (relay, at) in &setup.boots {
        _ = write!(line, " --boot {relay}@{}", seconds(*at));
    }
    line
}

fn fly(first: u64, count: u64) {
    judge(&(first..first + count).map(sequence).collect::<Vec<_>>());
}

fn judge(setups: &[Setup]) {
    let ends = run_all(setups, |setup, outcome| {
        let watched = outcome.watched.unwrap();
        (
            setup.seed,
            watched.most_flying,
            watched.first_agreement.is_some(),
        )
    });
    let flew = ends.iter().filter(|(_, most, _)| *most > 0).count();
    let agreed = ends.iter().filter(|(_, _, agreed)| *agreed).count();
    println!("{} sequences: {agreed} agreed, {flew} flew", ends.len());
    let wrong: Vec<String> = ends
        .iter()
        .filter(|(_, most, _)| *most > 1)
        .map(|(seed, _, _)| format!("SEED={seed} COUNT=1, {}", command(&sequence(*seed))))
        .collect();
    assert!(wrong.is_empty(), "two groups at once: {}", wrong.join("\n"));
    assert!(
        10 * flew >= 8 * ends.len(),
        "most sequences have a chain that flies"
    );
}

#[test]
fn random_faults_let_at_most_one_group_fly() {
    fly(number("SEED", 1), number("COUNT", 300));
}

/// Checks a run in which, before a fix, two groups of relays flew by separate agreements.
///
/// Only the last relay had accepted view A. Then view B was formed without the relays that had voted for A and relied
/// on the lease of A.
#[test]
fn an_unheard_decision_ends_no_lease() {
    let mut sequence = sequence(6_450);
    sequence.boots.clear();
    judge(&[sequence]);
}

/// Returns the setup of eight relays that sign their frames on a CSMA channel of 57 600 baud.
///
/// `loss` is the fraction of lost frames, `burst` the mean number of frames in a burst of losses.
fn losing(loss: f64, burst: f64) -> Setup {
    let mut setup = by_radio(8, 57_600);
    setup.auth = true;
    setup.faults.loss = loss;
    setup.burst = burst;
    setup
}

/// Required availability for a fraction of lost frames and a mean length of their bursts.
///
/// Each entry is loss, burst length in frames (1 for independent losses), availability.
const ASKED: [(f64, f64, f64); 4] = [
    (0.5, 1.0, 0.999),
    (0.7, 1.0, 0.97),
    (0.3, 20.0, 0.97),
    (0.5, 20.0, 0.85),
];

#[test]
fn the_mean_availability_of_ten_chains_is_high_enough() {
    for (loss, burst, asked) in ASKED {
        let setup = losing(loss, burst).soaked(at(600));
        let ends = run_seeds(&setup, 1..=10, |seed, outcome| {
            let end = outcome.watched.unwrap();
            (seed, end.availability.unwrap(), end.most_flying)
        });
        let ends = ends.unwrap();
        let mean = ends.iter().map(|(_, share, _)| share).sum::<f64>() / ends.len() as f64;
        let least = ends.iter().min_by(|one, two| one.1.total_cmp(&two.1));
        let (seed, least, _) = least.unwrap();
        println!("loss {loss}, runs of {burst}: mean {mean:.5}, least {least:.5} (seed {seed})");
        assert!(mean >= asked, "loss {loss}, runs of {burst}: {ends:?}");
        let most_flying = ends.iter().map(|(_, _, flying)| *flying).max();
        assert!(
            *least > 0.0 && most_flying == Some(1),
            "loss {loss}, runs of {burst}, seed {seed}"
        );
    }
}
