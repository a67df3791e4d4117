//! One-way links between neighbours.

use uav_relay::Phase;
use uav_relay_sim::simulator::flying::groups;
use uav_relay_sim::simulator::one_way::OneWayFailure;
use uav_relay_sim::simulator::outcome::TimelineEvent;

use super::*;

/// Duration of a run, and of the stable period at its end, s.
const ALL_S: u64 = 400;
const STILL_S: u64 = 120;

/// Returns all one-way links in chains of 4 and 8 relays. They have tags or not, and begin at 0 s or at 20 s.
fn cases(seed: u64) -> Vec<Setup> {
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
                all.push(setup.soaked(at(ALL_S)));
            }
        }
    }
    all
}

/// Describes the error in the final state, if any.
fn wrong(setup: &Setup, outcome: &Outcome) -> Option<String> {
    let seen: Vec<_> = outcome.relays.iter().map(|relay| relay.seen).collect();
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
    let still = at(ALL_S - STILL_S);
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
fn in_the_end_all_but_one_of_those_that_hear_each_other_have_one_agreement() {
    let first = number("SEED", 1);
    let cases: Vec<_> = (first..first + number("COUNT", 1))
        .flat_map(cases)
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
            "--seed {seed} --uavs {relays} --air csma --baud 57600{auth} --deaf {by}:{of}@{from} --soak {ALL_S}: {wrong}; most at once {end}"
        ))
    });
    let found: Vec<String> = found.into_iter().flatten().collect();
    println!("{} of {}:\n{}", found.len(), cases.len(), found.join("\n"));
    assert!(found.is_empty(), "{}", found.join("\n"));
}
